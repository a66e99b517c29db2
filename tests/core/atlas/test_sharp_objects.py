# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects with edges: closed, sharp and right from any start, with signs and intervals that are true."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import core
from core.atlas.reference_mesh import ReferenceMesh, closest_point
from core.atlas.touching import CHECKS, SHARPEST, rays_at
from tests import solids

BLOCK = solids.block()
HALF = np.array([1.0, 0.7, 0.5])
CORNERS = HALF * (np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), axis=-1).reshape(-1, 3))
CONE = solids.cone()
TOLERANCE = 8e-3


class Room(solids.Convex):
    """The inside of the block: air with six walls around it, whose edges are all concave."""

    def ray_cast(self, origin, direction, distance):
        hit = super().ray_cast(origin, direction, distance)
        return hit and (hit[0], tuple(-n for n in hit[1]))


ROOM = Room(BLOCK.distance, (0.05, 0.03, -0.5), (0.0, 0.0, 1.0), BLOCK.walls)


def explored(solid, **options):
    options = {"tolerance": TOLERANCE, "noise": 1e-3, "rng": 0} | options
    return core.explore_object(solid, solid.start, solid.outward, **options)


@pytest.fixture(scope="module")
def block():
    return explored(BLOCK)


@pytest.fixture(scope="module")
def room():
    return explored(ROOM)


def volume(mesh):
    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    return np.einsum("ni,ni->", np.cross(a, b), c) / 6.0


@pytest.mark.parametrize(("name", "sign"), [("block", 1.0), ("room", -1.0)])
def test_a_block_and_the_room_inside_it_are_closed_and_sharp(name, sign, request):
    mesh = request.getfixturevalue(name).mesh(0.06)
    assert solids.topology(mesh.triangles) == solids.Topology(0, 0, 2, 1)
    assert volume(mesh) == pytest.approx(sign * 8.0 * HALF.prod(), rel=0.003)
    for point in CORNERS:
        assert np.linalg.norm(mesh.vertices - point, axis=1).min() < 0.5 * TOLERANCE
    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    areas = np.linalg.norm(normals, axis=1)
    turned = np.degrees(np.arccos(np.clip(np.abs(normals / areas[:, None]).max(axis=1), 0.0, 1.0)))
    assert areas[turned > 5.0].sum() < 1e-3 * areas.sum()


@pytest.mark.parametrize("edge", [0.2, 0.1, 0.04, 0.02])
def test_edges_of_any_length_leave_the_topology_and_the_place(block, edge):
    mesh = block.mesh(edge)
    assert solids.topology(mesh.triangles) == solids.Topology(0, 0, 2, 1)
    assert np.abs(BLOCK.distances(mesh.vertices)).max() < TOLERANCE
    assert mesh.edge == pytest.approx(edge, rel=0.3)


@pytest.mark.long
@pytest.mark.parametrize(("sides", "flat", "sharp"), [(4, 0.99, 0.95), (6, 0.99, 0.95), (8, 0.97, 0.9)])
def test_walls_that_turn_by_45_degrees_or_more_are_sharp_and_take_few_touches(sides, flat, sharp):
    solid = solids.prism(sides)
    atlas = explored(solid)
    assert atlas.status == "ok"
    assert len(atlas.patches) <= 30
    mesh = atlas.mesh(0.06)
    assert solids.topology(mesh.triangles) == solids.Topology(0, 0, 2, 1)
    a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
    across = np.cross(b - a, c - a)
    areas = np.linalg.norm(across, axis=1)
    walls = np.array([normal for normal, _ in solid.walls])
    straight = (across @ walls.T).max(axis=1) > math.cos(math.radians(5.0)) * areas
    assert areas[straight].sum() > flat * areas.sum()
    off = ReferenceMesh(mesh, atlas.reference.indicator).feet(solid.edges(50))[0] - solid.edges(50)
    assert np.mean(np.linalg.norm(off, axis=1) < 0.5 * TOLERANCE) > sharp


@pytest.mark.long
def test_a_fillet_that_was_felt_stays_round():
    solid = solids.rounded(0.1)
    atlas = explored(solid)
    assert atlas.status == "ok"
    mesh = atlas.mesh(0.04)
    assert solids.topology(mesh.triangles) == solids.Topology(0, 0, 2, 1)
    assert np.quantile(np.abs(solid.distances(mesh.vertices)), 0.99) < TOLERANCE
    true = np.array([solid.normal(*point) for point in mesh.vertices])
    assert np.quantile(np.einsum("ni,ni->n", true, mesh.normals), 0.02) > math.cos(math.radians(10.0))


@pytest.mark.long
def test_edges_are_straight_to_half_a_tolerance(block):
    mesh, along = block.mesh(0.06), np.linspace(-0.95, 0.95, 200)
    for axis in range(3):
        for signs in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
            points = np.insert(np.outer(np.ones(200), signs), axis, along, axis=1) * HALF
            triangles = mesh.vertices[mesh.triangles]
            near = np.linalg.norm(triangles.mean(axis=1)[None] - points[:, None], axis=2).argsort(axis=1)[
                :, :12
            ]
            feet, _ = closest_point(triangles[near], points[:, None])
            off = np.linalg.norm(feet - points[:, None], axis=2).min(axis=1)
            assert np.percentile(off, 95) < 0.5 * TOLERANCE


def test_a_cube_along_the_axes_takes_few_touches():
    """Points of the lattice lie in the planes of its faces, where these have no inside and no outside."""
    atlas = explored(solids.block(1.0, 1.0, 1.0), tolerance=2e-3, noise=0.0)
    assert (atlas.status, len(atlas.patches) < 14) == ("ok", True)


@pytest.mark.parametrize("seed", [1, 6, 9])
def test_no_triangle_bridges_a_concave_edge_or_cuts_a_corner(seed):
    bracket = solids.bracket(Rotation.random(random_state=seed).as_matrix())
    atlas = explored(bracket, tolerance=2e-3, noise=0.0)
    assert atlas.status == "ok"
    mesh = atlas.mesh(0.02)
    assert solids.topology(mesh.triangles) == solids.Topology(0, 0, 2, 1)
    off = np.abs(bracket.distances(mesh.vertices[mesh.triangles].mean(axis=1)))
    assert off.max() < 1.5 * 2e-3


@pytest.fixture(scope="module")
def cone():
    return core.explore_object(CONE, CONE.start, CONE.outward, tolerance=TOLERANCE, noise=5e-4, rng=1)


@pytest.mark.long
def test_a_tip_that_no_patch_reaches_is_where_the_planes_of_walls_meet(cone):
    tip = cone.reference.mesh.vertices[cone.reference.mesh.vertices[:, 2].argmax()]
    assert tip == pytest.approx((0.0, 0.0, 1.0), abs=TOLERANCE)
    points = np.random.default_rng(0).uniform((-0.5, -0.5, -0.1), (0.5, 0.5, 1.1), (6000, 3))
    distance, std = cone.distance(points)
    off = np.abs(distance - CONE.distances(points))
    assert np.isfinite(std).all()
    assert np.mean((off > 8.0 * std) & (off > 5e-3)) <= 1e-3
    assert np.mean(off <= 1.645 * std) > 0.85


@pytest.mark.long
def test_edges_so_long_that_no_triangle_is_left_are_refused_with_a_sentence(cone):
    with pytest.raises(ValueError, match=r"edge: expected one for which there is room, got 0\.8"):
        cone.mesh(0.8)


@pytest.mark.long
def test_the_sharpest_places_are_checked_and_touched_again():
    cone = core.explore_object(CONE, CONE.start, CONE.outward, tolerance=TOLERANCE, noise=5e-4, rng=0)
    assert cone.status == "ok"
    mesh = cone.reference.mesh
    top = mesh.vertices[mesh.vertices[:, 2].argmax()]
    assert top == pytest.approx((0.0, 0.0, 1.0), abs=TOLERANCE)
    starts, aims, _, length = rays_at(cone.reference)
    assert (aims[CHECKS:][:SHARPEST] == top).all(axis=1).any()
    assert CONE.distances(starts).min() > 0.0
    assert np.linalg.norm(aims - starts, axis=1).max() < length


def test_a_ray_comes_straight_down_to_the_least_certain_vertex(block):
    """Patches that round an obtuse crease are off on a strip that random rays miss, as they miss a slot."""
    mesh, vertex = block.reference.mesh, 1234
    std = mesh.std.copy()
    std[vertex] = 2.0 * std.max()
    starts, aims, _, _ = rays_at(replace(block.reference, mesh=mesh._replace(std=std)))
    ray = CHECKS + np.flatnonzero((aims[CHECKS:] == mesh.vertices[vertex]).all(axis=1))[0]
    up = starts[ray] - aims[ray]
    assert up / np.linalg.norm(up) == pytest.approx(mesh.normals[vertex])


def test_a_ray_comes_straight_down_to_where_a_finger_met_nothing(block):
    point, up = (0.1, 0.2, 0.3), (0.0, 0.6, 0.8)
    starts, aims, _, length = rays_at(block.reference, [(point, up)])
    assert tuple(aims[-1]) == point
    assert (starts[-1] - aims[-1]) / np.linalg.norm(starts[-1] - aims[-1]) == pytest.approx(up)
    assert np.linalg.norm(starts[-1] - aims[-1]) < length


@pytest.mark.long
@pytest.mark.parametrize(("width", "depth"), [(0.05, 0.2), (0.06, 0.4)])
def test_a_slot_as_wide_as_the_tolerance_that_the_surface_bridges_is_not_ok(width, depth):
    slotted = solids.slotted(width, depth)
    atlas = core.explore_object(slotted, slotted.start, slotted.outward, tolerance=0.05, rng=0)
    assert atlas.status == "uncertain"
    assert "rays" in [doubt.code for doubt in atlas.doubts]


def test_angles_around_a_vertex_are_those_of_its_triangles(block):
    angles = block.reference.angles
    corners = np.linalg.norm(block.reference.mesh.vertices[:, None] - CORNERS, axis=2).argmin(axis=0)
    assert angles[corners] == pytest.approx(1.5 * np.pi, abs=0.02)
    assert (2.0 * np.pi - angles).sum() == pytest.approx(4.0 * np.pi)  # Gauss and Bonnet: 2 pi times 2


@pytest.mark.long
@pytest.mark.parametrize("edge", [0.03, 0.012, 0.008, 0.006])
def test_what_is_closed_at_one_length_of_edges_is_so_at_another(cone, edge):
    assert cone.status == "ok"
    assert cone.reference.mesh.is_closed
    assert solids.topology(cone.mesh(edge).triangles) == solids.Topology(0, 0, 2, 1)


@pytest.mark.parametrize("name", ["block", "room"])
def test_signs_and_intervals_are_true_around_edges(name, request):
    atlas, sign = request.getfixturevalue(name), 1.0 if name == "block" else -1.0
    points = np.random.default_rng(1).uniform(-1.3, 1.3, (4000, 3)) * HALF
    distance, std = atlas.distance(points)
    true = sign * BLOCK.distances(points)
    finite, off = np.isfinite(std), np.abs(distance - true)
    assert finite.mean() > 0.99
    assert (np.sign(distance) == np.sign(true))[finite & (np.abs(true) > 3.0 * std)].all()
    assert np.mean((off <= 1.645 * std)[finite]) > 0.8
    assert np.mean(((off > 8.0 * std) & (off > 5e-3 * 2.0))[finite]) < 1e-3


def test_places_on_the_mesh_do_not_jump_to_another_wall_near_by(block):
    """The mesh is moved aside, as if it were the lower wall of a step whose upper one has a patch."""
    reference = block.reference
    moved = reference.mesh._replace(
        vertices=reference.mesh.vertices + np.array([0.0, 0.0, 0.7 * reference.edge])
    )
    top = np.flatnonzero(np.abs(reference.mesh.vertices - [0.0, 0.0, HALF[2]]).max(axis=1) < 0.3)
    distance, std = ReferenceMesh(moved, reference.indicator).distances(block.charts, moved.vertices[top])
    assert len(top) > 20
    assert np.abs(distance).max() < 1e-3 * reference.edge
    assert np.isfinite(std).all()


def test_far_away_and_outside_of_the_grid_the_side_is_right(block):
    far = np.random.default_rng(2).normal(size=(200, 3)) * 50.0
    distance, std = block.distance(far)
    assert (distance > 0.0).all()
    assert np.isfinite(std).all()
    assert distance == pytest.approx(BLOCK.distances(far), rel=1e-3)


@pytest.mark.long
def test_a_block_is_right_and_ok_from_any_start():
    """Starts on a face near an edge, and on other faces."""
    starts = [((0.99, 0.0, 0.5), (0, 0, 1)), ((-1.0, 0.5, 0.4), (-1, 0, 0)), ((0.3, 0.7, -0.3), (0, 1, 0))]
    for point, outward in starts:
        atlas = core.explore_object(BLOCK, point, outward, tolerance=TOLERANCE, noise=1e-3, rng=1)
        assert (atlas.status, atlas.reference.mesh.is_closed) == ("ok", True)
        assert solids.topology(atlas.reference.mesh.triangles) == solids.Topology(0, 0, 2, 1)
        assert np.abs(BLOCK.distances(atlas.reference.mesh.vertices)).max() < 1.5 * TOLERANCE


@pytest.mark.long
@pytest.mark.parametrize("point", [(1.0, 0.0, 0.5), (1.0, 0.7, 0.5), (1.0 - 1e-4, 0.7 - 1e-4, 0.5)])
def test_a_start_on_an_edge_or_in_a_corner_finds_a_good_place_beside_it(point):
    outward = np.array([1.0, 1.0, 1.0]) / np.sqrt(3.0)
    atlas = core.explore_object(BLOCK, point, outward, tolerance=TOLERANCE, noise=1e-3, rng=0)
    assert atlas.status == "ok"
    assert solids.topology(atlas.reference.mesh.triangles) == solids.Topology(0, 0, 2, 1)


def test_the_thin_rim_of_a_lens_is_closed_though_all_of_it_is_within_the_tolerance():
    def distance(x, y, z):
        size = math.hypot(x, y / 0.7, z / 0.08)
        return size * (size - 1.0) / max(math.hypot(x, y / 0.49, z / 0.0064), 1e-12)

    lens = solids.Solid(distance, (0.05, 0.03, 0.0798), (0.0, 0.0, 1.0))
    atlas = core.explore_object(lens, lens.start, lens.outward, tolerance=0.02, rng=0)
    assert atlas.status == "ok"
    assert solids.topology(atlas.reference.mesh.triangles) == solids.Topology(0, 0, 2, 1)


@pytest.mark.long
def test_two_balls_with_a_gap_are_two_pieces_though_no_finger_slides_from_one_to_the_other():
    def distance(x, y, z):
        return min(math.hypot(x + 1.04, y, z), math.hypot(x - 1.04, y, z)) - 1.0

    solid = solids.Solid(distance, (-2.04, 0.0, 0.0), (-1.0, 0.0, 0.0))
    atlas = explored(solid)
    assert atlas.status == "ok"
    assert solids.topology(atlas.reference.mesh.triangles) == solids.Topology(0, 0, 4, 2)
    assert np.abs(solid.distances(atlas.reference.mesh.vertices)).max() < 1.5 * TOLERANCE


@pytest.mark.long
def test_half_a_shell_has_a_border_and_beyond_it_the_deviation_is_infinite():
    def sheet(origin, direction, distance):
        (x, y, z), (a, b, c) = origin, direction
        along = a * x + b * y + c * z
        root = along**2 - (x * x + y * y + z * z - 1.0)
        for way in (-along - math.sqrt(root), -along + math.sqrt(root)) if root > 0.0 else ():
            hit = tuple(o + way * d for o, d in zip(origin, direction, strict=True))
            if 0.0 < way <= distance and hit[2] > 0.0:
                return hit, hit
        return None

    class Shell:
        ray_cast = staticmethod(sheet)

    atlas = core.explore_object(Shell(), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), tolerance=TOLERANCE, rng=0)
    mesh = atlas.reference.mesh
    shape = solids.topology(mesh.triangles)
    assert (shape.euler, shape.pieces, shape.tangled) == (1, 1, 0)
    assert shape.open > 0
    border = mesh.vertices[np.unique(mesh.border)]
    assert np.abs(border[:, 2]).max() < 0.05
    assert atlas.status == "ok"
    points = np.random.default_rng(0).normal(size=(3000, 3))
    away = np.linalg.norm(points, axis=1)
    (distance, std), true, height = atlas.distance(points), away - 1.0, points[:, 2] / away
    finite = np.isfinite(std)
    assert finite[height > 0.1].all()
    assert not finite[height < -0.1].any()
    assert np.abs(distance - true)[finite].max() < 5.0 * TOLERANCE
    assert (np.sign(distance) == np.sign(true))[finite & (np.abs(true) > 3.0 * std)].all()


def test_the_nearest_places_on_triangles_are_no_farther_than_any_of_their_places():
    rng = np.random.default_rng(0)
    triangles, points = rng.normal(size=(300, 3, 3)), 2.0 * rng.normal(size=(300, 3))
    feet, weights = closest_point(triangles, points)
    assert weights.min() > -1e-12
    assert weights.sum(axis=1) == pytest.approx(np.ones(300))
    assert np.einsum("ni,nij->nj", weights, triangles) == pytest.approx(feet, abs=1e-12)
    away = np.linalg.norm(points - feet, axis=1)
    for _ in range(200):
        other = np.einsum("ni,nij->nj", rng.dirichlet(np.ones(3) * 0.5, 300), triangles)
        assert (np.linalg.norm(points - other, axis=1) >= away - 1e-9).all()


@pytest.mark.long
def test_where_walls_turn_smoothly_there_is_no_crease():
    """A mesh of a ball whose edges are so long that normals at their ends differ by up to 40 degrees."""
    atlas = explored(solids.ball(), rng=1)
    mesh = atlas.mesh(0.6)
    assert solids.topology(mesh.triangles) == solids.Topology(0, 0, 2, 1)
    assert np.abs(np.linalg.norm(mesh.vertices, axis=1) - 1.0).max() < TOLERANCE
    a, b = mesh.vertices[mesh.triangles[:, :2]].transpose(1, 0, 2)
    assert np.einsum("ni,ni->n", a, b).min() < 0.8


def chamfered(chamfer):
    """The block with beveled edges, and a triangle at each corner."""
    walls = []
    for signs in np.ndindex(3, 3, 3):
        way = np.array(signs) - 1
        count = np.abs(way).sum()
        if count:
            size = np.abs(way) @ HALF - (count - 1) * chamfer
            walls.append((tuple((way / math.sqrt(count)).tolist()), float(size / math.sqrt(count))))
    normals, sizes = (np.array(values) for values in zip(*walls, strict=True))
    return solids.Convex(
        lambda x, y, z: float((normals @ (x, y, z) - sizes).max()), BLOCK.start, BLOCK.outward, tuple(walls)
    )


@pytest.mark.long
def test_no_patch_takes_on_what_others_have_beyond_an_obtuse_crease():
    """Patches that were moved onto the blend of all of them were off there: touches improved them in vain."""
    solid = chamfered(0.1)
    atlas = explored(solid, tolerance=4e-3, noise=0.0)
    assert atlas.status == "ok" and len(atlas.patches) < 75
    assert np.abs(solid.distances(atlas.reference.mesh.vertices)).max() < 3.0 * 4e-3
