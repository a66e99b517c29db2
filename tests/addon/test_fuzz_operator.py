# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The installed extension in any scene, with any file: it makes a patch or says why not."""

import contextlib
import math
import os
import zlib

import numpy as np
import pytest
from fuzzing import in_time
from hypothesis import event, given
from hypothesis import strategies as st

pytest.importorskip("bpy", reason="needs Blender as a Python module: run make test")
from mathutils import Matrix

NAMES = st.sampled_from([
    "Thing", "a" * 63, "Ünïcødé 面 🖐", 'with "quotes" and \'more\'', "two\nlines", "  ", "%s {0} \\n",
    "Thing Patch", "Tactile Patches", "Tactile Curvature", "-1", "\t",
])  # fmt: skip
ODD = st.sampled_from([
    0.0, -0.0, 1.0, -1.0, 2.0, 1e-3, 1e-7, 1e-20, 1e-38, 1e-45, 1e3, 1e7, 1e20, 3e38, -3e38, math.inf,
    -math.inf, math.nan,
])  # fmt: skip
TINY = st.floats(-3.0, 3.0, width=32)


def finite_blocks(bpy):
    return [getattr(bpy.data, p.identifier) for p in bpy.data.bl_rna.properties if p.type == "COLLECTION"]


def mesh_state(mesh):
    arrays = []
    for name, layer in sorted(mesh.attributes.items()):
        if name == "curvature_color":  # All patches of a mesh share one range of colors.
            continue
        key = {
            "FLOAT_VECTOR": "vector",
            "FLOAT_COLOR": "color",
            "BYTE_COLOR": "color",
            "FLOAT2": "vector",
        }.get(layer.data_type, "value")
        width = {"FLOAT_VECTOR": 3, "FLOAT_COLOR": 4, "BYTE_COLOR": 4, "FLOAT2": 2, "INT32_2D": 2}
        out = np.empty(len(layer.data) * width.get(layer.data_type, 1))
        layer.data.foreach_get(key, out)
        arrays.append((name, zlib.crc32(out)))
    return arrays, len(mesh.polygons), len(mesh.edges), mesh.materials.keys()


def object_state(obj):
    matrices = [obj.matrix_world, obj.matrix_basis, obj.matrix_parent_inverse]
    return (
        [repr(list(map(tuple, m))) for m in matrices],
        obj.parent and obj.parent.name,
        obj.data and obj.data.name,
        [(m.type, m.name) for m in obj.modifiers],
        sorted(obj.keys()),
        sorted(c.name for c in obj.users_collection),
        obj.hide_viewport,
    )


def digest(bpy):
    """All datablocks of the file with their data, by their numbers, which no two datablocks ever share."""
    found = {}
    for blocks in finite_blocks(bpy):
        for block in blocks:
            more = ()
            if isinstance(block, bpy.types.Mesh):
                more = mesh_state(block)
            elif isinstance(block, bpy.types.Object):
                more = object_state(block)
            found[block.session_uid] = (type(block).__name__, block.name, block.users, more)
    return found


def selection(bpy):
    layer = bpy.context.view_layer
    return layer.objects.active, sorted(o.name for o in layer.objects.selected), bpy.context.mode


# Things to touch.


def ball(bpy, draw):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=2.0)


def grid(bpy, draw):
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=draw(st.integers(1, 40)), y_subdivisions=20, size=4.0)


def cube(bpy, draw):
    bpy.ops.mesh.primitive_cube_add(size=3.0)


def raw(bpy, draw):
    """A mesh of any vertices, edges and faces: loose ones, ngons, faces of no area, non-manifold."""
    coordinate = st.one_of(TINY, TINY, TINY, st.sampled_from([0.0, 1.0, -1.0]))
    vertices = draw(st.lists(st.tuples(coordinate, coordinate, coordinate), max_size=12))
    index = st.integers(0, max(len(vertices) - 1, 0))
    edges = (
        draw(st.lists(st.tuples(index, index).filter(lambda e: e[0] != e[1]), max_size=4)) if vertices else []
    )
    faces = (
        draw(st.lists(st.lists(index, min_size=3, max_size=7, unique=True), max_size=8))
        if len(vertices) > 7
        else []
    )
    mesh = bpy.data.meshes.new("Raw")
    mesh.from_pydata(vertices, edges, faces)
    add(bpy, mesh)


def coincident(bpy, draw):
    """A ball with one face collapsed or flattened, and a second one inside out on top of it.

    Blender's own ball has another order of corners and faces each time, and where faces coincide the first
    one is felt. The ball is made by hand because what Hypothesis draws later must not depend on that.
    """
    polar, azimuths = np.meshgrid(np.pi / 24 * np.arange(25), np.pi / 24 * np.arange(48), indexing="ij")
    x, y, z = np.sin(polar) * np.cos(azimuths), np.sin(polar) * np.sin(azimuths), np.cos(polar)
    vertices = 2.0 * np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    number = np.arange(vertices.shape[0]).reshape(25, 48)
    right = np.roll(number, -1, axis=1)
    faces = np.stack([number[:-1], number[1:], right[1:], right[:-1]], axis=-1).reshape(-1, 4)
    chosen = faces[draw(st.sampled_from([2, 7, 50]))]
    if draw(st.booleans()):
        vertices[chosen] = vertices[chosen[0]]
    else:
        vertices[chosen, 2] = 0.0
    mesh = bpy.data.meshes.new("Coincident")
    mesh.from_pydata(
        np.vstack([vertices] * 2).tolist(), [], [*faces.tolist(), *(faces[:, ::-1] + len(vertices)).tolist()]
    )
    add(bpy, mesh)


def none(bpy, draw):
    add(bpy, bpy.data.meshes.new("Empty"))


def other(bpy, draw):
    """No mesh at all."""
    draw(st.sampled_from([
        lambda: bpy.ops.curve.primitive_bezier_circle_add(),
        lambda: bpy.ops.object.text_add(),
        lambda: bpy.ops.object.metaball_add(),
        lambda: bpy.ops.object.empty_add(),
        lambda: bpy.ops.object.light_add(),
        lambda: bpy.ops.object.camera_add(),
        lambda: bpy.ops.surface.primitive_nurbs_surface_sphere_add(),
        lambda: bpy.ops.object.armature_add(),
        lambda: bpy.ops.object.add(type="LATTICE"),
    ]))()  # fmt: skip


def add(bpy, data):
    obj = bpy.data.objects.new(data.name, data)
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj


MODIFIERS = (
    "MASK", "DECIMATE", "BOOLEAN", "NODES", "ARRAY", "SUBSURF", "WELD", "SOLIDIFY", "WAVE", "DISPLACE",
    "CAST", "WIREFRAME", "DATA_TRANSFER",
)  # fmt: skip


def one_of(things, draw):
    """One of these things; what Hypothesis draws does not depend on how many there are."""
    things = list(things)
    return things[draw(st.integers(0, 99)) % len(things)]


# What may be wrong with them; `obj` is the active object.


def nowhere(bpy, obj, draw):
    """A vertex that is at no place, or far away."""
    if obj.type == "MESH" and len(obj.data.vertices):
        one_of(obj.data.vertices, draw).co[draw(st.integers(0, 2))] = draw(ODD)


def transform(bpy, obj, draw):
    obj.scale = [draw(st.one_of(ODD, st.just(1.0))) for _ in range(3)]
    obj.rotation_euler = (0.3, 1.0, draw(ODD))


def sheared(bpy, obj, draw):
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    obj.parent = parent
    parent.scale = (draw(st.sampled_from([1.0, -2.0, 0.0, 1e-6, 1e6])), 3.0, 1.0)
    parent.rotation_euler = (0.5, 0.2, 0.1)
    obj.rotation_euler = (0.0, 0.7, 0.4)
    if draw(st.booleans()):
        obj.matrix_parent_inverse = Matrix.Diagonal((draw(ODD), 1.0, 1.0, 1.0))


def far(bpy, obj, draw):
    obj.location = (draw(ODD), 0.0, draw(ODD))


def modified(bpy, obj, draw):
    """Modifiers that leave nothing, or fail."""
    if obj.type != "MESH":
        return
    kind = draw(st.sampled_from(MODIFIERS))
    modifier = obj.modifiers.new(kind.title(), kind)
    if kind == "MASK":
        modifier.vertex_group = obj.vertex_groups.new(name="None").name
    elif kind == "DECIMATE":
        modifier.ratio = draw(st.sampled_from([0.0, 0.1]))
    elif kind == "DISPLACE":
        modifier.strength = draw(st.sampled_from([1.0, 1e30, 3e38]))
    elif kind == "WELD":
        modifier.merge_threshold = 10.0
    elif kind == "NODES":
        tree = modifier.node_group = bpy.data.node_groups.new("Nothing", "GeometryNodeTree")
        if draw(st.booleans()):
            tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
            tree.nodes.new("NodeGroupOutput")


def hidden(bpy, obj, draw):
    how = draw(st.sampled_from(["hide_viewport", "hide_set", "unlinked", "excluded", "hide_select"]))
    if how == "hide_set":
        obj.hide_set(True)
    elif how == "unlinked":
        for found in list(obj.users_collection):
            found.objects.unlink(obj)
    elif how == "excluded":
        found = bpy.data.collections.new("Out")
        bpy.context.scene.collection.children.link(found)
        for was in list(obj.users_collection):
            was.objects.unlink(obj)
        found.objects.link(obj)
        bpy.context.view_layer.layer_collection.children["Out"].exclude = True
    else:
        setattr(obj, how, True)


def instanced(bpy, obj, draw):
    group = bpy.data.collections.new("Group")
    group.objects.link(obj)
    instance = bpy.data.objects.new("Instance", None)
    instance.instance_type, instance.instance_collection = "COLLECTION", group
    bpy.context.scene.collection.objects.link(instance)


def edited(bpy, obj, draw):
    if obj.type == "MESH" and obj.name in bpy.context.view_layer.objects and obj.visible_get():
        bpy.context.view_layer.objects.active = obj
        bpy.ops.object.mode_set(mode=draw(st.sampled_from(["EDIT", "SCULPT"])))


def keyed(bpy, obj, draw):
    if obj.type == "MESH" and len(obj.data.vertices):
        obj.shape_key_add(name="Basis")
        key = obj.shape_key_add(name="Key")
        key.data[0].co[0] = draw(ODD)
        key.value = 1.0


def touched(bpy, obj, draw):
    """There is a patch, or a probe, already."""
    with contextlib.suppress(RuntimeError):
        draw(st.sampled_from([bpy.ops.tactile.reconstruct, bpy.ops.tactile.pick]))(
            target=obj.name, location=(0.3, -0.2, 1.9), extent=0.6
        )


THINGS = (ball, ball, ball, grid, cube, raw, coincident, none, other)
WRONGS = (nowhere, transform, sheared, far, modified, hidden, instanced, edited, keyed, touched)


def make(bpy, data):
    """Makes a scene with something to touch in it and returns the name of that."""
    draw = data.draw
    bpy.ops.wm.read_homefile(use_empty=True)
    thing = draw(st.sampled_from(THINGS))
    thing(bpy, draw)
    obj = bpy.context.view_layer.objects.active
    if obj is None:
        return ""
    obj.name = draw(NAMES)
    name = obj.name  # taken now, because an object that is in no collection may be gone later
    wrongs = draw(st.lists(st.sampled_from(WRONGS), max_size=2, unique=True))
    for wrong in wrongs:
        wrong(bpy, obj, draw)
        event(f"wrong: {wrong.__name__}")
    event(f"thing: {thing.__name__}")
    bpy.context.view_layer.update()
    return name


FLOATS = st.one_of(st.floats(width=32), ODD, st.floats(0.0, 1.0, width=32))
VECTORS = st.one_of(st.tuples(FLOATS, FLOATS, FLOATS), st.tuples(TINY, TINY, TINY), st.just((0.0, 0.0, 1.0)))
SIXES = st.lists(FLOATS, min_size=6, max_size=6)
INPUTS = {
    "location": VECTORS,
    "outward": VECTORS,
    "plane_count": st.integers(-1, 7),
    "azimuths": SIXES,
    "tilts": SIXES,
    "extent": FLOATS,
    "step": FLOATS,
    "noise": FLOATS,
    "seed": st.integers(-5, 2**31 - 1),
    "method": st.sampled_from(["bayes", "tagc", "quadratic-variation", "least-squares"]),
    "degree": st.integers(-1, 7),
    "weight": FLOATS,
    "solver": st.sampled_from(["fast", "fast", "fast", "descent"]),
}


TOUCH = {"location": (0.3, -0.2, 1.9), "extent": 0.6}
MAP = {"extent": 0.6, "spacing": 1.5}
MAP_INPUTS = {n: v for n, v in INPUTS.items() if n not in ("location", "outward")} | {"spacing": FLOATS}


def inputs(draw, good=TOUCH, odd=INPUTS):
    """Good arguments of a touch on the balls, or of a map, with up to two odd ones among them."""
    names = draw(st.lists(st.sampled_from(sorted(odd)), max_size=2, unique=True))
    return good | {name: draw(odd[name]) for name in names}


def assert_sentence(words):
    """One line that says something, in words: no exception's name, no traceback."""
    assert words.startswith("Error: "), words
    said = words.removeprefix("Error: ").rstrip("\n")
    # Blender itself adds a "Location: " to warnings of scripts.
    assert "Traceback" not in said
    assert "Location: " not in said
    assert 20 < len(said) < 500, said
    assert "\n" not in said
    assert said[0].isupper() or said[0] in "\"'", said
    assert not any(
        word in said for word in ("matrix", "Matrix", "must be", "not converge", "array(", "float32")
    ), said


def is_finite(mesh):
    """Whether all numbers in the attributes of a mesh, its positions among them, are finite."""
    for attribute in mesh.attributes:
        if attribute.data_type in ("FLOAT", "FLOAT_VECTOR", "FLOAT_COLOR"):
            key, width = {
                "FLOAT": ("value", 1),
                "FLOAT_VECTOR": ("vector", 3),
                "FLOAT_COLOR": ("color", 4),
            }[attribute.data_type]
            out = np.empty(len(attribute.data) * width)
            attribute.data.foreach_get(key, out)
            if not np.isfinite(out).all():
                return False
    return True


def examine(patch, *more):
    """Asserts that a patch consists of finite numbers and returns its status, which may be one `more`."""
    report = patch["tactile"].to_dict()
    assert report["status"] in ("ok", "uncertain", "not_converged", *more)
    assert report["message"].endswith(".")
    numbers = [v for v in report.values() if isinstance(v, float)]
    numbers += [*report["coefficients"], *np.ravel(report["axes"]), *report["frame"]["origin"]]
    assert np.isfinite(numbers).all(), report
    # A patch cannot be kept in its place under a probe whose own place is no usable number.
    lost = patch.parent is not None and not np.abs(np.array(patch.parent.matrix_world)).max() < 1e15
    assert lost or np.isfinite(np.array(patch.matrix_world)).all()
    assert len(patch.data.vertices) > 100
    assert is_finite(patch.data), patch.name
    return report["status"]


def others(before, after, allowed):
    """Datablocks that are not as before, except for kinds that new datablocks may share."""
    return {
        uid: (state, after.get(uid))
        for uid, state in before.items()
        if after.get(uid) != state and state[0] not in allowed
    }


@pytest.mark.long
@given(st.data())
@in_time
def test_a_touch_in_any_scene(empty, data):
    bpy = empty
    target = make(bpy, data)
    arguments = inputs(data.draw)
    before, chosen = digest(bpy), selection(bpy)
    try:
        result = bpy.ops.tactile.reconstruct(target=target, **arguments)
    except RuntimeError as error:
        assert_sentence(str(error))
        assert digest(bpy) == before
        assert selection(bpy) == chosen
        event("refused")
        return
    assert result == {"FINISHED"}
    after = digest(bpy)
    # A patch may share its materials and its collection with earlier ones.
    assert others(before, after, ("Material", "Collection", "Scene")) == {}
    new = [block for uid, block in after.items() if uid not in before]
    assert sorted(kind for kind, *_ in new if kind in ("Object", "Mesh")) == ["Mesh", "Object"]
    assert {kind for kind, *_ in new} <= {"Object", "Mesh", "Material", "Collection", "ShaderNodeTree"}
    (patch,) = [obj for obj in bpy.data.objects if obj.session_uid not in before and "tactile" in obj]
    event(f"patch, {examine(patch)}")


def examine_map(painted):
    """Asserts that the record of a map adds up and that its mesh consists of finite numbers."""
    record, mesh = painted["tactile_map"].to_dict(), painted.data
    assert record["touched"] == record["points"] == record["patches"] + sum(record["refused"].values()) > 0
    assert 0 <= record["in_doubt"] <= record["patches"]
    numbers = [v for v in record.values() if isinstance(v, float)]
    assert np.isfinite([*numbers, *np.ravel(record["planes"])]).all(), record
    assert is_finite(mesh)
    for name in ("error", "height_std", "condition_number", "blind_share"):
        assert (f"{name}_median" in record) == (record["patches"] > 0) or name == "error"
        values = np.empty(len(mesh.vertices), dtype=np.float32)
        mesh.attributes[name].data.foreach_get("value", values)
        assert ((values >= 0.0) | (values == -1.0)).all(), name
    event("map, in doubt" if record["in_doubt"] else "map, patches" if record["patches"] else "map, none")


def is_long(bpy, extension, target, arguments):
    """Whether a map takes thousands of touches, and not so many that it is refused."""
    obj, graph = bpy.data.objects.get(target), bpy.context.evaluated_depsgraph_get()
    planes = [extension.core.SamplingPlane(azimuth) for azimuth in (0.0, 1.0, 2.0)]
    fit = {"method": "bayes", "degree": "auto", "weight": None, "solver": "fast"}
    lengths = {name: arguments[name] for name in ("spacing", "extent")} | {"step": 0.0, "noise": 0.0}
    try:
        stability = extension.tactile_addon.stability_map.stability
        return stability.StabilityMap(obj, graph, planes, seed=0, **lengths, **fit).expected_count() > 1000
    except (ArithmeticError, AttributeError, TypeError, ValueError):  # It is refused, whatever it is.
        return False


@pytest.mark.long
@given(st.data())
@in_time
def test_a_stability_map_in_any_scene(empty, extension, data):
    bpy = empty
    target = make(bpy, data)
    arguments = inputs(data.draw, MAP, MAP_INPUTS)
    if "step" in arguments:  # thousands of touches with thousands of contacts each take as long as a hang
        arguments |= MAP
    if is_long(bpy, extension, target, arguments):
        arguments = {}
    before, chosen = digest(bpy), selection(bpy)
    try:
        result = bpy.ops.tactile.stability_map(target=target, **arguments)
    except RuntimeError as error:
        if "poll() " not in str(error):  # in another mode
            assert_sentence(str(error))
        assert digest(bpy) == before
        assert selection(bpy) == chosen
        event("refused")
        return
    assert result == {"FINISHED"}
    after = digest(bpy)
    assert others(before, after, ("Material", "Collection", "Scene")) == {}
    new = [kind for uid, (kind, *_) in after.items() if uid not in before]
    assert (new.count("Object"), new.count("Mesh")) == (1, 1)
    assert set(new) <= {"Object", "Mesh", "Material", "Collection", "ShaderNodeTree"}
    painted = bpy.context.view_layer.objects.active
    assert painted.session_uid not in before
    examine_map(painted)


def shift(bpy, probe, draw):
    getattr(probe, draw(st.sampled_from(["location", "rotation_euler", "scale"])))[
        draw(st.integers(0, 2))
    ] = draw(ODD)


def number(bpy, probe, draw):
    name = draw(st.sampled_from(sorted(set(INPUTS) - {"location", "normal"})))
    setattr(probe.tactile_probe, name, draw(INPUTS[name]))


def retarget(bpy, probe, draw):
    probe.tactile_probe.target = one_of([None, probe, *probe.children, *bpy.data.objects], draw)


def reshape(bpy, probe, draw):
    target = probe.tactile_probe.target
    if target is not None and target.type == "MESH":
        draw(st.sampled_from(WRONGS[:4]))(bpy, target, draw)


def delete(bpy, probe, draw):
    found = one_of(bpy.data.objects, draw)
    if found != probe:
        bpy.data.objects.remove(found)


def rename(bpy, probe, draw):
    one_of(bpy.data.objects, draw).name = draw(NAMES)


def unlive(bpy, probe, draw):
    probe.tactile_probe.live = not probe.tactile_probe.live


def press(bpy, probe, draw):
    with contextlib.suppress(RuntimeError):  # a poll may refuse it
        draw(
            st.sampled_from([bpy.ops.tactile.add_plane, bpy.ops.tactile.remove_plane, bpy.ops.tactile.update])
        )()


CHANGES = (shift, shift, number, number, number, retarget, reshape, delete, rename, unlive, press)


@pytest.mark.long
@given(st.data())
@in_time
def test_a_probe_in_any_scene(empty, capfd, data):
    """After any change its patch consists of finite numbers, or its message says why there is none."""
    bpy = empty
    target = make(bpy, data)
    arguments = inputs(data.draw)
    before, chosen = digest(bpy), selection(bpy)
    capfd.readouterr()
    try:
        assert bpy.ops.tactile.pick(target=target, new=True, **arguments) == {"FINISHED"}
    except RuntimeError as error:
        if "poll() " not in str(error):  # in another mode
            assert_sentence(str(error))
        assert digest(bpy) == before
        assert selection(bpy) == chosen
        event("refused")
        return
    probe = next(o for o in bpy.data.objects if o.session_uid not in before and o.type == "EMPTY")
    for change in data.draw(st.lists(st.sampled_from(CHANGES), max_size=6)):
        change(bpy, probe, data.draw)
        event(f"change: {change.__name__}")
        bpy.context.view_layer.update()
        said = "".join(capfd.readouterr())
        assert "Traceback" not in said, said
        message = probe.tactile_probe.message
        patch = next((child for child in probe.children if "tactile" in child), None)
        if message:
            assert message[0].isupper() or message[0] in "\"'", message
            assert 20 < len(message) < 500, message
            event("no patch")
        elif patch is not None:
            # A probe that is not live keeps a patch that no longer is that of its inputs, and says so.
            more = () if probe.tactile_probe.live else ("outdated",)
            event(f"patch, {examine(patch, *more)}")


WORDS = st.one_of(
    st.sampled_from([
        "nan", "inf", "-inf", "1e999", "1e-999", "", " ", "-", "--", "x", "0x10", "1,5", "9" * 30, "-1", "0",
        "1", "½", "0.3", "--location", "\n", "two\nlines",
    ]),
    st.text(max_size=5).filter(lambda t: "\0" not in t),
)  # fmt: skip
OPTIONS = (
    "--target", "--location", "--outward", "--azimuths", "--tilts", "--extent", "--step", "--noise", "--seed",
    "--method", "--degree", "--weight", "--solver", "--nonsense",
)  # fmt: skip


@pytest.fixture(scope="module")
def balls(extension, tmp_path_factory):
    """The bytes of a ball as a file of each kind, and a folder for spoiled copies of them."""
    import bpy

    folder = tmp_path_factory.mktemp("files")
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, radius=2.0)
    bpy.ops.wm.ply_export(filepath=str(folder / "ball.ply"), ascii_format=True)
    bpy.ops.wm.stl_export(filepath=str(folder / "ball.stl"))
    bpy.ops.wm.obj_export(filepath=str(folder / "ball.obj"), forward_axis="Y", up_axis="Z")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "ball.blend"))
    return {kind: (folder / f"ball.{kind}").read_bytes() for kind in ("ply", "stl", "obj", "blend")}, folder


def spoiled(data, kind, draw):
    """The bytes of a file as they are, cut, changed, or replaced by others."""
    how = draw(st.sampled_from(["whole", "whole", "whole", "cut", "empty", "junk", "digits", "header"]))
    event(f"{kind}: {how}")
    if how == "cut":
        return data[: draw(st.integers(0, len(data) - 1))]
    if how == "digits" and kind in ("ply", "obj"):
        at = draw(st.integers(300, len(data) - 40))
        return (
            data[:at] + draw(st.sampled_from([b"nan", b"inf", b"1e99 ", b"x", b"-", b"\n"])) + data[at + 5 :]
        )
    junk = draw(st.binary(max_size=200))
    return {"empty": b"", "junk": junk, "header": data[:40] + junk}.get(how, data)


@given(st.data())
@in_time
def test_any_command_line(extension, balls, capfd, data):
    """It ends with 0 and a report, with 1 and a sentence, or with 2 and what is wrong with the arguments."""
    files, folder = balls
    kind = data.draw(st.sampled_from(sorted(files)))
    suffix = data.draw(st.sampled_from([kind] * 6 + ["PLY", "txt", "blend1", ""]))
    name = data.draw(st.sampled_from(["a", "a b", "ü", "-a", os.fsdecode(b"\xff"), "two\nlines", "a" * 200]))
    path = folder / f"{name}.{suffix}"
    path.write_bytes(spoiled(files[kind], kind, data.draw))
    words = ["reconstruct", str(path), "--location", "0.3", "-0.2", "1.9", "--extent", "0.6"]
    if data.draw(st.booleans()):
        words += [data.draw(st.sampled_from(OPTIONS)), *data.draw(st.lists(WORDS, min_size=1, max_size=3))]
    if data.draw(st.integers(0, 9)) == 0:
        words[1] = data.draw(
            st.sampled_from([str(folder), "", "/", "/dev/null", str(folder / "no" / "file.ply")])
        )
    if data.draw(st.integers(0, 9)) == 0:
        words += [data.draw(st.sampled_from(["--json", "--output"])), str(folder)]
    capfd.readouterr()
    try:
        code = extension.tactile_addon.command_line.main(words)
    except SystemExit as ended:
        code = ended.code
    out, err = capfd.readouterr()
    path.unlink()
    said = [line for line in err.splitlines() if line.startswith("tactile: ")]
    event(f"code {code}")
    assert "Traceback" not in out + err
    assert code in (0, 1, 2)
    assert len(said) == (code == 1), err
    if code == 0:
        assert "principal curvatures" in out
    elif code == 1:
        assert 20 < len(said[0]) < 600
        assert err.endswith(said[0] + "\n")
    else:
        assert "error: " in err


@pytest.mark.long
def test_a_million_faces(empty):
    """A mesh that is only large gets a good patch."""
    empty.ops.mesh.primitive_grid_add(x_subdivisions=1000, y_subdivisions=1000, size=4.0)
    assert empty.ops.tactile.reconstruct(location=(0.3, -0.2, 0.0), extent=0.6) == {"FINISHED"}
    assert examine(empty.context.object) == "ok"
