# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Atlases of measured contacts: rasters without normals, contours with them."""

import re
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial import cKDTree

import core
from core.atlas import measured
from core.atlas.charts import AZIMUTHS
from core.atlas.connectivity import graph_of
from tests import solids


def bump(x, y):
    return 0.3 * np.exp(-(x**2 + y**2) / 0.3)


def raster(noise=0.0, lines=17, each=60):
    rng = np.random.default_rng(0)
    x = np.linspace(-1.0, 1.0, each)
    rows = []
    for y in np.linspace(-1.0, 1.0, lines):
        z = bump(x, y) + rng.normal(0.0, noise, each)
        rows.append(np.column_stack([x, np.full(each, y), z]))
    return rows


@pytest.mark.long
def test_a_raster_becomes_a_surface():
    atlas = core.atlas_of(raster(noise=1e-3), outward=(0, 0, 1), tolerance=4e-3, noise=1e-3)
    x, y = np.random.default_rng(1).uniform(-0.7, 0.7, (2, 200))
    distance, std = atlas.distance(np.column_stack([x, y, bump(x, y)]))
    assert np.isfinite(std).mean() > 0.95
    assert np.abs(distance[np.isfinite(std)]).mean() < 2e-3
    above, _ = atlas.distance(np.column_stack([x, y, bump(x, y) + 0.02]))
    assert (above > 0.0).mean() > 0.98


@pytest.mark.long
def test_steps_tell_the_share_that_is_covered_and_return_the_same():
    steps, shares = core.cover_contacts(raster(), outward=(0, 0, 1), tolerance=4e-3), []
    while True:
        try:
            shares.append(next(steps))
        except StopIteration as end:
            atlas = end.value
            break
    assert shares == sorted(shares) and shares[0] == 0.0 and shares[-1] == 1.0
    same = core.atlas_of(raster(), outward=(0, 0, 1), tolerance=4e-3)
    assert [r.patch.k1 for r in atlas.patches] == [r.patch.k1 for r in same.patches]


def test_contours_with_normals_need_no_direction():
    solid = solids.ball()
    planes = [core.SamplingPlane(a) for a in np.radians([0, 45, 90, 135])]
    contours = core.track(solid, solid.start, solid.outward, planes, extent=0.7, step=0.05)
    atlas = core.atlas_of(contours, tolerance=1e-2)
    assert atlas.patches[0].patch.k1 == pytest.approx(-1.0, rel=0.1)


@pytest.mark.parametrize(
    ("given", "outward", "message"),
    [
        ([np.eye(3)], (0, 0, 1), "contacts: expected 40 or more at different places, got 3: feel more of"),
        (raster(), None, "outward: expected a direction where contacts have no normals"),
        (
            [np.column_stack([np.linspace(0, 1, 60), np.zeros(60), np.zeros(60)])],
            (0, 0, 1),
            "all around at least one of them",
        ),
        (7, (0, 0, 1), "contours_or_strokes: expected a list"),
        ([1e-60 * np.vstack(raster())], (0, 0, 1), "expected them at least 1e-50 apart, got nearer ones"),
        ([1e-200 * np.vstack(raster())], (0, 0, 1), "use another unit of length"),
        ([1e14 + np.vstack(raster())], (0, 0, 1), "are 0.016 apart in double precision, too coarse"),
        ([core.Contour(row, normals=0.0 * row) for row in raster()], None, "normals: expected vectors with"),
        ([core.Contour(np.vstack(raster()), noise=2.1)], (0, 0, 1), "noise: expected less than the size"),
    ],
)
def test_what_carries_no_atlas_gets_a_sentence(given, outward, message):
    with pytest.raises(ValueError, match=message):
        core.atlas_of(given, outward=outward)


def ball(count=600):
    """Contacts all over a ball, which are its normals."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    return np.stack([np.sqrt(1.0 - z**2) * np.cos(turn), np.sqrt(1.0 - z**2) * np.sin(turn), z], axis=1)


@cache
def ball_atlas(scale=1.0, length=1.0):
    """The atlas of contacts on a ball, with normals of this length."""
    return core.atlas_of([core.Contour(scale * ball(), normals=length * ball())])


HALF_AXES, MIDDLE = np.array([60.0, 45.0, 30.0]), np.array([30.0, 0.0, 30.0 * 0.75**0.5])


def rows_over_ellipsoid(height):
    """Rows of contacts on an ellipsoid with a feature that is this high and holds 2 % of them."""
    rng, found = np.random.default_rng(6), []
    for polar in np.linspace(0.08, np.pi - 0.08, 40):
        t = np.linspace(0.0, 2.0 * np.pi, max(8, int(330 * np.sin(polar))), endpoint=False)
        around, up = np.sin(polar) * np.stack([np.cos(t), np.sin(t)], axis=1), np.full(len(t), np.cos(polar))
        points = HALF_AXES * np.column_stack([around, up])
        normals = points / HALF_AXES**2
        normals *= height / np.linalg.norm(normals, axis=1)[:, None]
        normals *= np.exp(-((points - MIDDLE) ** 2).sum(axis=1) / 144.0)[:, None]
        found.append(points + normals + rng.normal(0.0, 0.05, points.shape))
    return found


@pytest.mark.long
@pytest.mark.parametrize("height", [-6.0, 4.0])
def test_a_dent_or_a_bump_of_few_contacts_is_not_erased(height):
    rows = rows_over_ellipsoid(height)
    atlas, points = core.atlas_of(rows, noise=0.05), np.vstack(rows)
    assert atlas.status == "ok"
    off = np.abs(atlas.distance(points[np.linalg.norm(points - MIDDLE, axis=1) < 14.0])[0])
    assert off.mean() < 1.5 * 0.05
    assert off.max() < 7.0 * 0.05


@pytest.mark.long
def test_contacts_that_no_patch_explains_are_counted_and_named():
    for height, status, message in (
        (0.03, "ok", "All but 2 of 600 contacts agree with it, which are off by up to 0.027"),
        (0.1, "uncertain", "2 of 600 contacts are off the surface or face the other way, by up to 0.099"),
    ):
        moved = ball()
        moved[::300] *= 1.0 + height
        atlas = core.atlas_of([core.Contour(moved, normals=ball())], noise=1e-3)
        assert atlas.status == status
        assert message in atlas.message
        assert (atlas.next_touch() is None) == (status == "ok")
    near = np.linalg.norm(ball() - (0.6, 0.0, 0.8), axis=1) < 0.5
    moved = (1.0 + 0.05 * near * np.random.default_rng(0).normal(size=600))[:, None] * ball()
    atlas = core.atlas_of([core.Contour(moved, normals=ball())], noise=1e-3)
    assert atlas.status == "uncertain"
    found = re.match(
        r"(\d+) of 600 contacts are off the surface or face the other way, by up to", atlas.message
    )
    assert 6 < int(found[1]) <= 1.2 * np.count_nonzero(near)
    touch = atlas.next_touch()
    assert np.linalg.norm(touch.point - np.array([0.6, 0.0, 0.8])) < 0.6
    assert touch.outward @ (0.6, 0.0, 0.8) > 0.8


@pytest.mark.long
def test_a_gap_that_is_narrower_than_strokes_are_apart_is_a_doubt_that_names_it():
    one = [0.5 * ring for ring in rings_of_ball(gap=0.2)]
    two = [ring + np.array([1.02, 0.0, 0.0]) for ring in one]
    for hint in (None, (0.0, 0.0, 1.0)):
        atlas = core.atlas_of([*one, *two], outward=hint)
        middles = np.where(atlas.contacts.points[:, :1] > 0.51, (1.02, 0.0, 0.0), (0.0, 0.0, 0.0))
        outward = np.einsum("ni,ni->n", atlas.contacts.normals, atlas.contacts.points - middles) > 0.0
        assert outward.mean() > 0.97
        assert atlas.status == "uncertain"
        # Rounding decides whether a few contacts or more are off, and so which of two doubts it is.
        assert atlas.gravest.code in ("confused", "sparse")
        assert np.linalg.norm(atlas.next_touch().point - np.array([0.51, 0.0, 0.0])) < 0.2


def rectangle(corner, one, two, spacing=0.04):
    """Contacts inside a rectangle, half a spacing from its sides, and its normals."""
    a, b = (
        (np.arange(round(np.linalg.norm(side) / spacing)) + 0.5) * spacing / np.linalg.norm(side)
        for side in (one, two)
    )
    points = np.array(corner) + a[:, None, None] * np.array(one) + b[:, None] * np.array(two)
    normal = np.cross(one, two) / np.linalg.norm(np.cross(one, two))
    return points.reshape(-1, 3), np.tile(normal, (points.size // 3, 1))


@cache
def angle_atlas():
    """The atlas of an L of width .4 with contacts on each wall up to .02 from its edges."""
    x, y, z = np.eye(3)
    polygon = np.array([(0, 0, 0), (1, 0, 0), (1, 0.4, 0), (0.4, 0.4, 0), (0.4, 1, 0), (0, 1, 0)])
    walls = [rectangle(a, b - a, 0.4 * z) for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True)]
    for corner, long, wide in ((polygon[0], x, 0.4 * y), (0.4 * y, 0.4 * x, 0.6 * y)):
        walls += [rectangle(corner + 0.4 * z, long, wide), rectangle(corner, wide, long)]
    points, normals = (np.vstack(values) for values in zip(*walls, strict=True))
    points += np.random.default_rng(0).normal(0.0, 5e-4, points.shape)
    return core.atlas_of([core.Contour(points, normals=normals)], noise=5e-4)


def test_no_patch_spans_a_notch_whose_walls_were_felt():
    atlas, along = angle_atlas(), np.linspace(0.005, 0.395, 40)[:, None] * (0.0, 0.0, 1.0)
    assert atlas.status == "ok"
    for out in (0.0, 0.03, 0.06, 0.1):
        distance, _ = atlas.distance(np.array([0.4 + out, 0.4 + out, 0.0]) + along)
        assert distance == pytest.approx(np.full(40, out), abs=2e-3)


def test_a_patch_does_not_explain_what_the_noise_hides_from_single_contacts_but_not_from_their_mean():
    contacts = angle_atlas().contacts
    tree = cKDTree(contacts.points)
    cloud = measured._Cloud(contacts, tree, graph_of(contacts.links), 5e-4, None)
    _, i = tree.query((0.2, 0.7, 0.4))
    (r,), some = cloud.patches([i], 0.3), cloud.same_sheet(i, 0.3)
    near, up = np.unique(contacts.links[i]), contacts.normals[i]
    another = some[np.argmax(np.linalg.norm(contacts.points[some] - contacts.points[i], axis=1))]
    for which, height, is_explained in (
        (near, 0.0, True),
        (near, 2.0, False),
        (np.append(near, another), np.append(np.full(len(near), 2.0), 100.0)[:, None], False),
        (near[:1], 100.0, True),
        (near[:2], 100.0, False),
    ):
        points = contacts.points.copy()
        points[which] += 5e-4 * height * up
        assert cloud._replace(contacts=contacts._replace(points=points)).explains(r, some) == is_explained


def test_a_patch_goes_on_from_its_last_contact_to_the_edge_of_its_wall():
    contacts = angle_atlas().contacts
    tree = cKDTree(contacts.points)
    cloud = measured._Cloud(contacts, tree, graph_of(contacts.links), 5e-4, None)
    _, i = tree.query((0.1, 0.3, 0.4))
    (r,) = cloud.patches([i], 0.15)
    toward_edge = np.array([-1.0, 0.0, 0.0]) @ r.frame.axes
    turn = np.arctan2(toward_edge[1], toward_edge[0]) / (2.0 * np.pi)
    rim = r.radius * cloud.rim(i, r)[round(turn * AZIMUTHS) % AZIMUTHS]
    assert rim == pytest.approx(contacts.points[i, 0], abs=0.005)


BOX = np.array([0.5, 0.35, 0.25])  # Half the sides of a box.


def cube(spacing, margin):
    """Contacts on a unit cube up to a margin from its edges."""
    found = []
    for normal in (*np.eye(3), *-np.eye(3)):
        one, two = np.roll(normal, 1), np.roll(normal, 2) * normal.sum()
        corner = 0.5 * normal + (margin - 0.5 * spacing - 0.5) * (one + two)
        length = 1.0 - 2.0 * margin + spacing
        found.append(rectangle(corner, length * one, length * two, spacing))
    points, normals = (np.vstack(values) for values in zip(*found, strict=True))
    return core.Contour(points, normals=normals)


def few_on_box(count):
    """Contacts at random on a box, no two of which are near each other."""
    rng, walls, found = np.random.default_rng(3), np.array([0.35, 0.5, 0.7]), []
    while len(found) < count:
        axis, side = rng.choice(3, p=walls / walls.sum()), rng.choice((-1.0, 1.0))
        normal = side * np.eye(3)[axis]
        tried = [BOX * np.where(np.eye(3)[axis], side, rng.uniform(-1.0, 1.0, 3)) for _ in range(10)]
        points = np.array([point for point, _ in found] or [np.full(3, 9.0)])
        away = [np.linalg.norm(points - point, axis=1).min() for point in tried]
        found.append((tried[np.argmax(away)], normal))
    points, normals = (np.array(values) for values in zip(*found, strict=True))
    return core.Contour(points, normals=normals)


def test_edges_that_no_contact_is_near_are_a_doubt_that_names_one():
    atlas = core.atlas_of([few_on_box(650)])
    assert atlas.status == "uncertain"
    off = np.abs(atlas.reference.mesh.vertices) - BOX
    assert off.max() > measured.MOST_OFF * 2.0 * BOX.max()
    assert "are so far apart that the surface between them may be off by" in atlas.message
    assert np.count_nonzero(BOX - np.abs(atlas.next_touch().point) < 0.06) > 1
    assert len(atlas.unexplained) > 1  # A finger may miss the first.


def random_on_cone(count, seed=0):
    """Contacts at random on a cone of radius .5 and height 1, and on its base."""
    rng = np.random.default_rng(seed)
    turn, u, is_base = 2.0 * np.pi * rng.random(count), np.sqrt(rng.random(count)), rng.random(count) < 0.309
    around = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    side = np.column_stack([0.5 * u[:, None] * around[:, :2], 1.0 - u])
    slant = (around + np.array([0.0, 0.0, 0.5])) / np.hypot(1.0, 0.5)
    points = np.where(is_base[:, None], side * (1.0, 1.0, 0.0), side)
    return core.Contour(points, normals=np.where(is_base[:, None], (0.0, 0.0, -1.0), slant))


def test_a_tip_that_is_cut_off_is_a_doubt_though_no_plane_is_far_from_the_surface():
    for seed, status in ((6, "uncertain"), (7, "ok")):
        atlas = core.atlas_of([random_on_cone(1200, seed)])
        off = abs(atlas.distance([(0.0, 0.0, 1.0)])[0][0])
        assert (off > measured.MOST_OFF) == (status == "uncertain")
        assert atlas.status == status
        if atlas.doubts:
            assert atlas.doubts[0].value == pytest.approx(off, rel=0.02)
            assert atlas.next_touch().point == pytest.approx((0.0, 0.0, 1.0), abs=1e-3)


X, Y, Z = np.eye(3)


def cloud_of(walls, noise=0.0):
    """A cloud of contacts, given as points (3,) and normals (3,); copies of the first make them eight."""
    walls = walls + walls[:1] * (measured.ABREAST - len(walls))
    points, normals = (np.array(values, dtype=float) for values in zip(*walls, strict=True))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    links = np.zeros((len(walls), 1), dtype=int)
    contacts = measured.MeasuredContacts(points, normals, np.ones(len(walls)), links)
    return measured._Cloud(contacts, cKDTree(contacts.points), graph_of(links), noise, None)


def off_enclosed(walls, place, up=Z, noise=0.0):
    """How far a place that faces up is off what few contacts enclose, where planes count up to .01."""
    place = np.array([place])
    most = 0.01 / measured.CONTRADICTED
    return cloud_of(walls, noise).enclosing(place, np.array([up]), most, 0.0 * place)[2][0]


def edge_walls(odd=None, out=None):
    """Four contacts on each of two walls to an edge: one may have an odd normal, four be on the other."""
    walls = [((-x if out is None else out, y, 0.0), Z) for x, y in zip(OUT, ALONG, strict=True)]
    walls[1] = walls[1][0], Z if odd is None else odd
    return walls + [((0.0, y, -z), X) for z, y in zip(OUT, ALONG, strict=True)]


OUT, ALONG = (0.1, 0.12, 0.14, 0.16), (-0.03, 0.01, 0.03, -0.01)


def test_a_fin_along_a_wall_is_off_the_other_within_the_noise_of_its_contacts():
    for walls, noise in ((edge_walls(), 0.0), (edge_walls(out=0.004), 0.004)):
        assert off_enclosed(walls, (0.0, 0.0, 0.03), X, noise) == pytest.approx(0.03)


def test_a_plane_that_contacts_of_its_wall_are_in_front_of_encloses_nothing():
    for odd in (None, (0.6, 0.0, 0.8)):
        assert off_enclosed(edge_walls(odd), (0.0, 0.0, 0.0), X) == pytest.approx(0.0, abs=1e-12)


TOP = ((-0.03, 0.0, 0.0), Z)


@pytest.mark.parametrize(
    ("side", "place", "off"),
    [
        ((0.0, 0.0, -0.05), (0.02, 0.0, 0.0), 0.02),  # convex
        ((0.0, 0.0, 0.05), (0.02, 0.0, 0.0), 0.0),  # The side goes on above the top.
        ((-0.1, 0.0, -0.05), (0.02, 0.0, 0.0), 0.0),  # The top goes on beyond the side.
        ((-0.035, 0.0, -0.05), (0.02, 0.0, 0.0), 0.0),
        ((-0.1, 0.0, 0.05), (-0.09, 0.0, 0.03), 0.01),  # concave
        ((0.0, 0.0, 0.05), (-0.09, 0.0, 0.03), 0.03),
        ((-0.1, 0.0, -0.05), (-0.09, 0.0, 0.03), 0.03),
    ],
)
def test_walls_enclose_a_place_if_both_are_behind_or_in_front_of_each_other(side, place, off):
    assert off_enclosed([TOP, (side, X)], place) == pytest.approx(off)


@pytest.mark.parametrize(("step", "off"), [(0.008, 0.02), (0.012, 0.008)])
def test_a_plane_may_be_contradicted_by_a_share_of_what_counts(step, off):
    walls = [TOP, ((0.0, 0.0, -0.05), X), ((step, 0.05, -0.06), X)]
    assert off_enclosed(walls, (0.02, 0.0, 0.0)) == pytest.approx(off)


def test_planes_of_two_walls_of_a_notch_do_not_contradict_each_other():
    walls = [((-0.03, -0.05, 0.0), Z), ((0.0, 0.1, -0.1), X), ((0.1, 0.0, -0.1), Y)]
    assert off_enclosed(walls, (0.03, -0.05, 0.0)) == pytest.approx(0.03)


def test_the_nearest_plane_encloses_even_if_it_is_contradicted():
    walls = [((0.0, 0.0, 0.0), (0.6, 0.0, 0.8)), ((0.04, 0.0, 0.0), Z), ((0.06, 0.0, 0.0), Z)]
    assert off_enclosed(walls, (0.0, 0.0, 0.02), (0.6, 0.0, 0.8)) == pytest.approx(0.016)


def corner_of(walls, place, most=0.04):
    """Where what few contacts enclose is farthest from a surface of one place, far from a ball."""
    atlas = SimpleNamespace(charts=ball_atlas().charts, reference=SimpleNamespace(feet=lambda _: (place,)))
    far = [(np.array(point) + 5.0 * Z, up) for point, up in walls]
    place = np.array([place]) + 5.0 * Z
    return measured._off_enclosed(atlas, cloud_of(far), most, place, Z[None])[1][0] - 5.0 * Z


@pytest.mark.parametrize(("slope", "ridge"), [(0.9, -0.1), (1.1, 0.0)])
def test_planes_meet_if_they_differ_by_more_than_contacts_normals_may(slope, ridge):
    slope *= measured.MEETING
    walls = [
        ((side * 0.3, y, -0.3 * slope), (side * slope, 0.0, 1.0)) for side in (-1, 1) for y in (-0.1, 0, 0.1)
    ]
    assert corner_of(walls, (-0.1, 0.0, -0.3 * slope))[0] == pytest.approx(ridge, abs=1e-9)


def pyramid(shift=0.0, heights=(0.7, 0.72)):
    """Contacts on four walls that meet in (0, 0, 1), one of which is moved outward."""
    ways = [np.array([np.cos(turn), np.sin(turn), 0.0]) for turn in 0.5 * np.pi * np.arange(4)]
    walls = [(0.5 * (1.0 - z) * way + z * Z, way + 0.5 * Z) for way in ways for z in heights]
    moved = shift * walls[0][1] / np.linalg.norm(walls[0][1])
    return [(point + moved * (k < len(heights)), up) for k, (point, up) in enumerate(walls)]


@pytest.mark.parametrize(("shift", "is_met"), [(0.04, True), (0.07, False)])
def test_walls_meet_in_a_tip_if_all_pass_it_within_half_of_what_counts(shift, is_met):
    top = corner_of(pyramid(shift), (0.0, 0.0, 0.8))
    assert (top[2] > 0.9) == is_met


@pytest.mark.parametrize(("most", "counts"), [(0.19, True), (0.21, False)])
def test_a_tip_counts_if_it_is_farther_than_what_counts(most, counts):
    top = corner_of(pyramid(), (0.0, 0.0, 0.8), most)
    assert (top[2] > 0.9) == counts


@pytest.mark.parametrize(("height", "counts"), [(0.97, False), (0.985, True)])
def test_a_tip_counts_if_no_contact_that_is_near_it_is_in_front_of_it(height, counts):
    cap = [((0.01 * k, 0.01, height), Z) for k in range(8)]
    top = corner_of(pyramid() + cap, (0.0, 0.0, 0.7))
    assert (top[2] > 0.9) == counts


def test_no_fin_along_a_wall_goes_on_past_the_edges_of_few_contacts():
    atlas = core.atlas_of([few_on_box(800)])
    assert atlas.status == "ok"
    off = np.abs(atlas.reference.mesh.vertices) - BOX
    assert off.max() < measured.MOST_OFF * 2.0 * BOX.max()


def test_where_patches_lie_contacts_may_be_far_apart():
    points = ball(80)
    atlas = core.atlas_of([core.Contour(points, normals=points)])
    assert atlas.status == "ok"
    off = np.linalg.norm(atlas.reference.mesh.vertices, axis=1) - 1.0
    assert np.abs(off).max() < measured.MOST_OFF * np.ptp(points, axis=0).max()


@pytest.mark.parametrize("spacing", [0.05, 0.1])
def test_patches_go_on_to_edges_and_corners_that_contacts_are_near(spacing):
    atlas = core.atlas_of([cube(spacing, 0.5 * spacing)], noise=1e-3)
    assert atlas.status == "ok"
    vertices = np.abs(atlas.reference.mesh.vertices)
    assert np.abs(vertices.max(axis=1) - 0.5).max() < 0.01
    corners = np.array(list(np.ndindex(2, 2, 2))) - 0.5
    assert np.abs(atlas.distance(corners)[0]).max() < 0.02


def test_a_noise_that_was_not_given_is_named():
    assert re.search(r"No noise was given; that of the fit is 0\.001\d?\.$", ball_atlas().message)


@pytest.mark.long
def test_files_that_are_off_each_other_are_a_doubt_or_refused():
    points = ball(2000)
    points[::2] *= 1.03
    given = [core.Contour(points, normals=ball(2000))]
    atlas = core.atlas_of(given)
    assert atlas.status == "uncertain"
    assert re.match(
        r"Contacts scatter by 0\.02\d about the smallest patches, and no noise was given", atlas.message
    )
    with pytest.raises(
        ValueError, match="noise: expected one that explains how contacts are off smooth patches"
    ):
        core.atlas_of(given, noise=1e-3)


@pytest.mark.long
def test_normals_that_all_point_inward_surround_a_cavity():
    for hint in (None, (0.0, 0.0, 1.0)):
        atlas = core.atlas_of([core.Contour(ball(), normals=-ball())], outward=hint)
        assert atlas.status == "uncertain"
        assert atlas.message.startswith("Normals point inward all around, so the contacts surround a cavity")


def torus(count=3000):
    """Contacts at random on a torus, and its normals."""
    u, v, w = np.random.default_rng(0).uniform(size=(3, 2 * count))
    u, v = (2.0 * np.pi * turn[w < (1.0 + 0.4 * np.cos(2.0 * np.pi * v)) / 1.4][:count] for turn in (u, v))
    around = np.stack([np.cos(u), np.sin(u), 0.0 * u], axis=1)
    normals = np.cos(v)[:, None] * around + np.sin(v)[:, None] * (0.0, 0.0, 1.0)
    return around + 0.4 * normals, normals


@pytest.mark.long
@pytest.mark.parametrize("tolerance", [None, 0.02, 0.25])
def test_patches_end_before_a_torus_turns_away(tolerance):
    points, normals = torus()
    atlas = core.atlas_of([core.Contour(points, normals=normals)], tolerance=tolerance)
    assert atlas.status == "ok"
    x, y, z = atlas.reference.mesh.vertices.T
    assert np.abs(np.hypot(np.hypot(x, y) - 1.0, z) - 0.4).max() < 0.01


@pytest.mark.parametrize("tolerance", [0.21, 1e30])
def test_a_tolerance_beyond_a_tenth_of_the_object_is_refused(tolerance):
    with pytest.raises(ValueError, match=r"tolerance: expected at most 0\.2, a tenth of the size, got"):
        core.atlas_of([core.Contour(ball(), normals=ball())], tolerance=tolerance)


@pytest.mark.parametrize("noise", [2.1, 10.0, 1e9])
def test_noise_beyond_the_size_of_the_object_is_refused(noise):
    with pytest.raises(ValueError, match="noise: expected less than the size of what was felt, 2, got "):
        core.atlas_of([core.Contour(ball(), normals=ball())], noise=noise)


def second(normals, _):
    return np.where(np.arange(len(normals))[:, None] % 2, -normals, normals)


def twentieth(normals, rng):
    return np.where(rng.random((len(normals), 1)) < 0.05, -normals, normals)


def random(normals, rng):
    return rng.normal(size=normals.shape)


@pytest.mark.parametrize("noise", [0.0, 0.002, 0.02])
@pytest.mark.parametrize("wrong", [second, twentieth, random])
def test_normals_that_contradict_their_neighbors_are_refused_at_once(wrong, noise):
    rng = np.random.default_rng(0)
    points = ball() + rng.normal(0.0, noise, (600, 3))
    steps = core.cover_contacts([core.Contour(points, normals=wrong(ball(), rng))])
    with pytest.raises(ValueError, match="normals: expected those of neighboring contacts on one side, got"):
        next(steps)


def test_planes_of_neighbors_are_no_measured_normals_and_contradict_nothing():
    steps = core.cover_contacts([random(ball(), np.random.default_rng(0))], outward=(0, 0, 1))
    assert next(steps) == 0.0


@pytest.mark.parametrize(("thickness", "noise"), [(0.05, 0.01), (0.01, 0.002), (1e-6, 0.0)])
def test_the_two_sides_of_a_thin_plate_and_of_a_gap_contradict_nothing(thickness, noise):
    rng = np.random.default_rng(0)
    flat = rng.uniform(-1.0, 1.0, (3000, 2))
    up = np.where(rng.random(3000) < 0.5, 1.0, -1.0)
    points = np.column_stack([flat, 0.5 * thickness * up]) + rng.normal(0.0, noise, (3000, 3))
    normals = np.column_stack([np.zeros((3000, 2)), up])
    for outward in (normals, -normals):
        assert next(core.cover_contacts([core.Contour(points, normals=outward)])) == 0.0


@pytest.mark.long
@pytest.mark.parametrize(("scale", "length"), [(1e-48, 1.0), (1e49, 1.0), (1.0, 1e200), (1.0, 1e-200)])
def test_the_unit_of_contacts_and_the_length_of_normals_change_nothing(scale, length):
    plain, other = ball_atlas().reference.mesh, ball_atlas(scale, length).reference.mesh
    assert other.is_closed
    assert len(other.triangles) == pytest.approx(len(plain.triangles), rel=0.01)
    assert np.linalg.norm(other.vertices / scale, axis=1) == pytest.approx(1.0, abs=0.01)


@cache
def cap_atlas():
    return core.atlas_of(cap_rows(), outward=(0, 0, 1), tolerance=0.01)


def cap_rows():
    """Rows of contacts without noise on the cap of a unit ball."""
    x = np.linspace(-0.5, 0.5, 41)
    return [
        np.column_stack([x, np.full(41, y), np.sqrt(1.0 - x**2 - y**2)]) for y in np.linspace(-0.5, 0.5, 11)
    ]


@pytest.mark.long
def test_a_cap_is_uncertain_and_nothing_is_certain_where_nothing_was_felt():
    atlas = cap_atlas()
    assert atlas.status == "uncertain"
    assert "Nothing was felt beyond" in atlas.message
    assert atlas.uncovered
    touch = atlas.next_touch()
    assert np.linalg.norm(touch.point) == pytest.approx(1.0, abs=0.15)
    assert touch.point[2] < 0.88 and touch.gain > 0.0
    places = np.random.default_rng(0).uniform((-3, -3, -3), (3, 3, 0.5), (1000, 3))
    places = places[np.linalg.norm(places, axis=1) > 1.0]
    _, std = atlas.distance([*places, (-3.0, 0.5, -1.0)])
    assert np.isinf(std).all()


def test_deviations_grow_beyond_a_rim_and_are_then_infinite():
    atlas = cap_atlas()
    rim = atlas.reference.mesh.vertices[atlas.reference.is_open]
    at = rim[np.argmax(rim[:, 0])]
    way = np.eye(3)[0] - at[0] * at  # along the ball
    steps = np.outer([0.0, 0.3, 0.7, 3.0, 10.0], atlas.reference.mesh.edge * way / np.linalg.norm(way))
    _, std = atlas.distance(at + steps)
    assert std[0] < std[1] < std[2] < np.inf
    assert np.isinf(std[3:]).all()


def test_above_what_was_felt_distances_are_finite_and_right():
    atlas = cap_atlas()
    points = np.vstack(cap_rows())
    heights = np.random.default_rng(0).uniform(0.0, 0.1, len(points))
    distance, std = atlas.distance((1.0 + heights)[:, None] * points)
    felt = np.isfinite(std)
    assert felt.mean() > 0.9
    assert (np.abs(distance - heights)[felt] <= 1.645 * std[felt]).mean() > 0.8


def rings_of_ball(normals=None, gap=0.15):
    """Circles of contacts on a unit ball, around z and around x."""
    strokes = []
    for z in np.arange(-1.0 + 0.3 * gap, 1.0, gap):
        r = np.sqrt(1.0 - z**2)
        t = np.linspace(0.0, 2.0 * np.pi, max(4, int(12.0 * r / gap)), endpoint=False)
        ring = np.column_stack([r * np.cos(t), r * np.sin(t), np.full(len(t), z)])
        strokes += [ring, ring[:, [2, 0, 1]]]
    return strokes


@pytest.mark.long
def test_strokes_all_over_a_ball_need_no_normals_and_no_hint():
    strokes = rings_of_ball()
    for hint in (None, (0.0, 0.0, 1.0)):
        atlas = core.atlas_of(strokes, outward=hint)
        assert atlas.status == "ok"
        assert atlas.reference.mesh.is_closed
        assert np.einsum("ni,ni->n", atlas.contacts.normals, np.vstack(strokes)) == pytest.approx(
            1.0, abs=0.02
        )
    distance, std = atlas.distance([(0, 0, 0.5), (0, 0, -0.5), (0, 0, -1.5)])
    assert distance == pytest.approx([-0.5, -0.5, 0.5], abs=0.02)
    assert np.isfinite(std).all()


@pytest.mark.parametrize("wrong", [second, random])
@pytest.mark.parametrize("outward", [None, (0, 0, 1)])
def test_normals_that_contradict_each_other_are_never_ok(wrong, outward):
    points = np.vstack(rings_of_ball())
    normals = wrong(points, np.random.default_rng(0))
    with pytest.raises(ValueError, match="normals: expected those of neighboring contacts on one side"):
        core.atlas_of([core.Contour(points, normals=normals)], outward=outward)


@pytest.mark.long
def test_where_a_few_normals_contradict_each_other_the_surface_is_in_doubt():
    points = np.vstack(rings_of_ball())
    normals = np.where((points[:, 2] > 0.8)[:, None], second(points, None), points)
    atlas = core.atlas_of([core.Contour(points, normals=normals)])
    assert atlas.status == "uncertain"
    assert "around (" in atlas.message and "contradict each other" in atlas.message


def test_no_places_have_no_distances():
    assert [values.shape for values in ball_atlas().distance(np.empty((0, 3)))] == [(0,), (0,)]


def test_three_curves_of_one_patch_are_uncertain():
    solid = solids.ball()
    planes = [core.SamplingPlane(a) for a in np.radians([0, 60, 120])]
    contours = core.track(solid, solid.start, solid.outward, planes, extent=0.3, step=0.02)
    atlas = core.atlas_of(contours)
    assert atlas.status == "uncertain"
    assert atlas.uncovered


def test_an_empty_mesh_is_not_closed_and_has_edges_of_no_length():
    none = np.empty((0, 3))
    mesh = core.Mesh(none, none.astype(np.intp), np.empty(0), np.empty(0, dtype=np.intp))
    assert not mesh.is_closed
    assert mesh.edge == 0.0
    assert core.shortest_edge(mesh.vertices, mesh.triangles) == 0.0


@pytest.mark.long
def test_normals_that_contacts_have_count_and_the_others_follow_them():
    points = ball()
    half = [core.Contour(points[:400], normals=points[:400]), points[400:][points[400:, 2] > 0.5]]
    atlas = core.atlas_of([core.Contour(points, normals=points)], outward=(0, 0, 1), tolerance=0.05)
    distance, std = atlas.distance([(0.0, 0.0, -0.8), (0.0, 0.0, -1.2), (0.0, 0.0, 0.8)])
    assert np.isfinite(std).all()
    assert np.sign(distance).tolist() == [-1.0, 1.0, -1.0]
    for outward in (None, (0, 0, -1)):
        contacts = core.atlas_of(half, outward=outward, tolerance=0.05).contacts
        assert np.einsum("ni,ni->n", contacts.points, contacts.normals) == pytest.approx(1.0, abs=0.05)


def noisy_ball():
    rng = np.random.default_rng(0)
    return [ring + rng.normal(0.0, 1e-3, ring.shape) for ring in rings_of_ball(gap=0.1)]


def test_the_smallest_patch_reaches_the_next_line_of_contacts_where_these_are_dense():
    turn = np.linspace(0.0, 2.0 * np.pi, 800, endpoint=False)
    circle = np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    rings = [np.sqrt(1.0 - z**2) * circle + (0.0, 0.0, z) for z in np.linspace(-0.95, 0.95, 12)]
    atlas = core.atlas_of(rings, noise=1e-3)  # FEWEST contacts of one ring carry no patch.
    assert np.abs(np.linalg.norm(atlas.reference.mesh.vertices, axis=1) - 1.0).max() < 0.01


@pytest.mark.long
def test_deviations_are_those_of_the_mean_of_overlapping_patches():
    atlas = core.atlas_of(noisy_ball(), noise=1e-3)
    places = ball(2000)
    distance, std = atlas.distance(places)
    within = np.mean(np.abs(distance) <= 1.645 * std)
    assert within > 0.8
    assert np.median(std) < 3.0 * np.median(np.abs(distance))


def test_above_a_cap_the_deviation_is_of_what_may_rise_beyond_its_rim():
    out, heights = np.array([0.3, 0.35, 0.45]), np.array([0.5, 0.65, 0.7])
    feet = np.column_stack([out, np.zeros(3), np.sqrt(1.0 - out**2)])
    distance, std = cap_atlas().distance((1.0 + heights)[:, None] * feet)
    assert distance == pytest.approx(heights, abs=0.01)
    assert std[0] < 0.01 < std[1] < std[2] == np.inf


def test_nothing_is_outside_where_the_other_parts_close_around_it():
    reference = cap_atlas().reference
    near, far = 0.5 * reference.indicator.cell, 5.0 * reference.indicator.cell
    away, side = np.array([near, far, far]), np.array([near, far, far])
    behind = np.array([0.4, 0.4, -0.4])
    std, ends = np.full(3, 1e-3), np.zeros(3, dtype=bool)
    rim = np.full(3, 1.0)
    _, found = reference._distances_near_border(away, side, side, rim, std, behind, ends)
    assert np.isfinite(found).tolist() == [True, False, True]


@pytest.mark.long
def test_few_fits_find_how_large_patches_can_be(monkeypatch):
    fits = []

    def counted(points, *args, **options):
        fits.append(len(points))
        return fit(points, *args, **options)

    fit = measured.reconstruct_many
    monkeypatch.setattr(measured, "reconstruct_many", counted)
    atlas = core.atlas_of(noisy_ball(), noise=1e-3)
    assert sum(fits) < measured.SOME_PLACES + 4 * len(atlas.patches)


@pytest.mark.long
def test_contacts_that_several_strokes_have_count_once():
    strokes = noisy_ball()
    atlas, places = core.atlas_of(strokes, noise=1e-3), ball(100)
    for given in ([*strokes, *strokes], [*strokes, *([strokes[3][5]] for _ in range(20))]):
        again = core.atlas_of(given, noise=1e-3)
        assert np.array_equal(again.distance(places), atlas.distance(places))


@pytest.mark.long
def test_a_ball_that_is_larger_than_its_centers_bend_is_a_doubt():
    centers = [core.Contour(ring, ball=1.4) for ring in rings_of_ball()]
    atlas = core.atlas_of(centers)
    assert atlas.status == "uncertain"
    assert "bend more than a ball of this radius can" in atlas.message


@pytest.mark.parametrize("jitter", [1e-14, 1e-6])
def test_a_finger_that_rests_at_one_place_breaks_no_atlas(jitter):
    rest = np.array([1.0, 0.0, 0.0]) + np.random.default_rng(5).normal(0.0, jitter, (800, 3))
    atlas = core.atlas_of([np.vstack([ball(800), rest])])
    assert np.abs(np.linalg.norm(atlas.reference.mesh.vertices, axis=1) - 1.0).max() < 0.05
