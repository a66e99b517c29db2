# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contours whose place is unknown, put onto meshes of exact surfaces."""

from functools import cache

import numpy as np
import pytest
import surfaces
from scipy.spatial import ConvexHull, cKDTree
from scipy.spatial.transform import Rotation

from core import Contour, reconstruct, register
from core.scan import pose_search, scanned_mesh
from core.triangles import triangle_cross

PLANES = surfaces.planes((0, 60, 120))
TURN, SHIFT = Rotation.from_euler("xyz", (0.7, -1.1, 2.3)).as_matrix(), np.array([310.0, -40.0, 75.0])
WAVES = ((1.0, (0.27, 0.08, -0.14), 0.4), (0.8, (-0.1, 0.3, 0.19), 1.9), (0.9, (0.16, -0.19, 0.24), 3.0))


@cache
def ball(count=10000):
    """Points all over the unit sphere (n, 3), and counterclockwise triangles."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(count)
    across = np.sqrt(1.0 - z**2)
    points = np.column_stack([across * np.cos(turn), across * np.sin(turn), z])
    faces = ConvexHull(points).simplices
    corners = points[faces]
    inward = np.einsum("ij,ij->i", np.cross(corners[:, 1], corners[:, 2]), corners[:, 0]) < 0.0
    faces[inward] = faces[inward, ::-1]
    return points, faces


def bumps(p):
    return sum(a * np.sin(p @ np.array(w) + phase) for a, w, phase in WAVES)


@cache
def bumpy():
    """A bumpy ball without symmetry, of radius 25: an exact surface with a point of it, and a mesh."""

    def gradient(p):
        slopes = (a * np.cos(p @ np.array(w) + phase) * np.array(w) for a, w, phase in WAVES)
        return p / np.linalg.norm(p) - sum(slopes)

    directions, faces = ball()
    radii = np.full(len(directions), 25.0)
    for _ in range(60):
        radii = 25.0 + bumps(radii[:, None] * directions)
    vertices = radii[:, None] * directions
    surface = surfaces.Exact(
        lambda x, y, z: np.sqrt(x**2 + y**2 + z**2) - 25.0 - bumps(np.stack([x, y, z], axis=-1)),
        gradient,
        vertices[1234],
        0.0,
        0.0,
    )
    return surface, vertices, faces


@cache
def touch(surface, *, side=1.0, factor=1.0, noise=0.0, step=1.6):
    """A reconstruction of `surface`, scaled by `factor`, moved to where TURN and SHIFT bring it back."""
    lengths = {"extent": 10.0, "step": step, "noise": noise, "rng": 3}
    contours = surface.track(PLANES, **lengths)
    moved = [Contour((factor * c.points - SHIFT) @ TURN, noise=factor * noise) for c in contours]
    return reconstruct((factor * surface.point - SHIFT) @ TURN, moved, outward=side * surface.normal @ TURN)


@cache
def bumpy_poses():
    """The poses of the bumpy ball's touch on its mesh."""
    surface, vertices, faces = bumpy()
    return register(touch(surface), vertices, faces)


def off(pose, r, point, turn=TURN):
    """How far a pose misses: in place, and in degrees."""
    place = pose.rotation @ r.frame.origin + pose.translation
    angle = np.arccos(np.clip((np.sum(turn * pose.rotation) - 1.0) / 2.0, -1.0, 1.0))
    return np.linalg.norm(place - point), np.degrees(angle)


def test_contours_are_found_on_a_shape_without_symmetry():
    surface, _, _ = bumpy()
    r, poses = touch(surface), bumpy_poses()
    place, angle = off(poses[0], r, surface.point)
    assert place < 0.05
    assert angle < 0.2
    assert poses[0].residual < 0.02
    assert poses[0].vertex == 1234
    assert not poses[0].is_ambiguous
    assert all(pose.is_ambiguous for pose in poses[1:])
    assert len(poses) == 5
    assert [pose.residual for pose in poses] == sorted(pose.residual for pose in poses)
    for pose in poses:
        assert np.allclose(pose.rotation @ pose.rotation.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(pose.rotation) == pytest.approx(1.0)


def test_the_residual_is_the_distance_of_the_contacts_to_the_mesh():
    """The mesh is a ball of another radius than the one that was touched, so contacts stay off it."""
    directions, faces = ball(2000)
    r = touch(surfaces.sphere(25.0))
    pose = register(r, 26.0 * directions, faces)[0]
    contacts = r.frame.to_world(r.contacts) @ pose.rotation.T + pose.translation
    corners = 26.0 * directions[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # The distance to a convex body is that of its farthest plane, for contacts that are nearly on it.
    heights = np.max(np.einsum("nfi,fi->nf", contacts[:, None] - corners[None, :, 0], normals), axis=1)
    assert pose.residual == pytest.approx(np.sqrt(np.mean(heights**2)), rel=0.02)


def test_an_ellipsoid_has_four_places_as_good():
    surface = surfaces.ellipsoid(40.0, 28.0, 20.0, 0.6, 0.5)
    directions, faces = ball()
    r = touch(surface)
    poses = register(r, directions * [40.0, 28.0, 20.0], faces)
    found = set()
    for pose in poses[:4]:
        assert pose.is_ambiguous
        for i, signs in enumerate(([1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1])):
            place, angle = off(pose, r, signs * surface.point, np.diag(signs) @ TURN)
            if place < 0.2 and angle < 0.5:
                found.add(i)
    assert found == {0, 1, 2, 3}
    assert len(poses) == 4 or poses[4].residual > 5.0 * poses[3].residual


def tube(sides, rings, long):
    """An open cylinder of radius 20 around z, with `sides` facets around it and `rings` rings of vertices."""
    turn, z = 2.0 * np.pi / sides * np.arange(sides), np.linspace(-long / 2.0, long / 2.0, rings)
    vertices = np.array([[20.0 * np.cos(t), 20.0 * np.sin(t), h] for h in z for t in turn])
    i, k = (a.ravel() for a in np.meshgrid(np.arange(sides), sides * np.arange(rings - 1)))
    a, b = i + k, (i + 1) % sides + k
    return vertices, np.vstack(
        [np.column_stack([a, b, b + sides]), np.column_stack([a, b + sides, a + sides])]
    )


@pytest.mark.parametrize("rings", [61, 2], ids=["fine", "one facet long"])
def test_on_a_cylinder_the_place_is_ambiguous(rings):
    r = touch(surfaces.cylinder(20.0))
    poses = register(r, *tube(180, rings, 60.0))
    assert all(pose.is_ambiguous for pose in poses)
    assert poses[0].residual < 0.02
    place = poses[0].rotation @ r.frame.origin + poses[0].translation
    assert np.hypot(*place[:2]) == pytest.approx(20.0, abs=0.05)
    assert abs((poses[0].rotation @ r.frame.axes)[2, 1]) > 0.999  # d2, which does not curve, is the axis


def test_on_a_sphere_and_on_a_plane_the_place_is_ambiguous():
    directions, faces = ball()
    poses = register(touch(surfaces.sphere(25.0)), 25.0 * directions, faces)
    assert all(pose.is_ambiguous for pose in poses)
    assert poses[0].residual < 0.02
    square = np.array([[-40, -40, 0], [40, -40, 0], [40, 40, 0], [-40, 40, 0]])
    poses = register(touch(surfaces.plane()), square, [[0, 1, 2], [0, 2, 3]])
    assert all(pose.is_ambiguous for pose in poses)
    assert poses[0].residual < 1e-6


def test_a_mirror_image_is_no_place():
    surface, vertices, faces = bumpy()
    r = touch(surface)
    assert register(r, vertices * [-1, 1, 1], faces[:, ::-1])[0].residual > 5.0 * bumpy_poses()[0].residual


@pytest.mark.long
def test_a_pose_turns_moves_and_scales_with_the_mesh():
    surface, vertices, faces = bumpy()
    first = bumpy_poses()[0]
    turn, shift = Rotation.from_euler("zyx", (2.0, 0.5, -1.0)).as_matrix(), np.array([1e3, -2e3, 500.0])
    second = register(touch(surface), vertices @ turn.T + shift, faces)[0]
    assert np.allclose(second.rotation, turn @ first.rotation, atol=1e-3)
    r = touch(surface)
    assert np.allclose(
        second.rotation @ r.frame.origin + second.translation,
        turn @ (first.rotation @ r.frame.origin + first.translation) + shift,
        atol=0.02,
    )
    r = touch(surface, factor=1e-3)
    place, angle = off(register(r, 1e-3 * vertices, faces)[0], r, 1e-3 * surface.point)
    assert place < 5e-5
    assert angle < 0.2


@pytest.mark.long
def test_of_two_walls_the_normals_choose():
    """A shell of 1 mm, whose inner wall has the shape of the outer one."""
    surface, vertices, faces = bumpy()
    shell = np.vstack([vertices, 0.96 * vertices]), np.vstack([faces, faces[:, ::-1] + len(vertices)])
    for factor, side in ((1.0, 1.0), (0.96, -1.0)):
        r = touch(surface, factor=factor, side=side)
        pose = register(r, *shell)[0]
        place, angle = off(pose, r, factor * surface.point)
        assert place < 0.05
        assert angle < 0.2
        assert pose.vertex == 1234 + (len(vertices) if side < 0 else 0)


@pytest.mark.long
def test_noise_moves_a_pose_by_no_more_than_itself():
    surface, vertices, faces = bumpy()
    r = touch(surface, noise=0.1, step=0.8)
    pose = register(r, vertices, faces)[0]
    place, angle = off(pose, r, surface.point)
    assert place < 0.5
    assert angle < 2.0
    assert 0.07 < pose.residual < 0.13
    # Noise in the mesh, a tenth of the length of its edges, hardly moves the pose either.
    scanned = vertices + np.random.default_rng(1).normal(0.0, 0.1, vertices.shape)
    place, angle = off(register(r, scanned, faces)[0], r, surface.point)
    assert place < 0.5
    assert angle < 2.0


SQUARE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"vertices": np.zeros((4, 2))}, "vertices: expected shape"),
        ({"vertices": [[0.0, 0.0, np.nan]]}, "vertices: expected finite numbers"),
        ({"vertices": "mesh"}, "vertices: expected numbers"),
        ({"faces": []}, "faces: expected triangles, got none"),
        ({"faces": [[0, 1, 2, 0]]}, "faces: expected shape"),
        ({"faces": [[0, 1, 3]]}, "faces: expected whole numbers from 0 to 2"),
        ({"faces": [[0, 1, -1]]}, "faces: expected whole numbers"),
        ({"faces": [[0, 1, 0.5]]}, "faces: expected whole numbers"),
        ({"faces": [[0, 1, 1]], "vertices": 50.0 * SQUARE}, "none that has an area"),
        ({"best": 0}, "best: expected a whole number"),
        ({"best": 1.5}, "best: expected a whole number"),
        ({}, "vertices: expected a mesh from .* bring both to one unit"),
        ({"vertices": 1e5 * SQUARE}, "vertices: expected a mesh from .* bring both to one unit"),
    ],
)
def test_bad_arguments_are_refused_with_a_sentence(arguments, says):
    r = touch(surfaces.sphere(25.0))
    given = {"r": r, "vertices": SQUARE, "faces": [[0, 1, 2]], **arguments}
    with pytest.raises(ValueError, match=says):
        register(given.pop("r"), given.pop("vertices"), given.pop("faces"), **given)


def test_few_triangles_are_enough():
    poses = register(touch(surfaces.plane()), 50.0 * SQUARE, [[0, 1, 2]], best=1)
    assert len(poses) == 1
    assert poses[0].residual < 1e-6
    assert np.isfinite(poses[0].rotation).all()


@pytest.mark.parametrize(
    ("turning", "shifting", "slides"), [(1.2, 1.2, False), (0.8, 1.2, True), (1.2, 0.8, True)]
)
def test_noise_shifts_a_pose_by_a_20th_of_the_radius_or_turns_it_by_2_degrees(
    monkeypatch, turning, shifting, slides
):
    """At these limits distances grow by `turning` or `shifting` times three least residuals."""
    growth = np.repeat([turning / np.radians(2.0), shifting / 0.05], 3) * 3e-3
    monkeypatch.setattr(
        pose_search, "mesh_distances", lambda *_: (np.zeros((1, 6, 1)), np.diag(growth)[None])
    )
    place = np.concatenate([np.eye(3), np.zeros((3, 1))], axis=1)[None]
    assert pose_search._registered(place, np.zeros((2, 6, 3)), None, 1, 1)[2].tolist() == [slides]


def test_the_coarse_search_forgives_a_tilt_and_a_shift_along_the_normal_and_nothing_else():
    rng = np.random.default_rng(2)
    x, y = rng.uniform(-1.0, 1.0, (2, 30))
    fields = 0.1 * rng.normal(size=(15, 4))

    def scores(z, weight=1.0):
        up = np.tile([0.0, 0.0, weight], (30, 1))
        return pose_search._costs(np.array([np.column_stack([x, y, z]), up]), fields)

    z = 0.2 * x * y
    assert scores(z + 0.3 + 0.2 * x - 0.1 * y) == pytest.approx(scores(z), rel=1e-9)
    assert scores(z + 0.1 * x**2).min() > 0.0
    assert np.abs(scores(z + 0.1 * x**2) - scores(z)).min() > 1e-3
    assert scores(z, 0.5) == pytest.approx(0.25 * scores(z), rel=1e-9)


def test_the_polynomials_of_the_coarse_search_are_of_one_side_of_a_thin_sheet():
    """Two bent sheets, of which one faces up and one down."""
    points = np.array(np.meshgrid(np.linspace(-2, 2, 41), np.linspace(-2, 2, 41))).reshape(2, -1).T
    heights = np.concatenate([0.05 + 0.1 * points[:, 0] ** 2, -0.05 + 0.3 * points[:, 1] ** 2])
    top, (x, y) = np.repeat([True, False], len(points)), np.tile(points, (2, 1)).T
    slopes = np.column_stack([np.where(top, -0.2 * x, 0.0), np.where(top, 0.0, -0.6 * y), np.ones(len(x))])
    normals = slopes / np.linalg.norm(slopes, axis=1, keepdims=True) * np.where(top, 1.0, -1.0)[:, None]
    centers = np.column_stack([x, y, heights])
    mesh = scanned_mesh.ScanMesh(None, normals, centers, normals, None)
    places, fields = pose_search._fields(mesh, 0.8)
    inner = np.hypot(places[:, 0, 3], places[:, 1, 3]) < 1.0
    up = inner & (places[:, 2, 2] > 0.9)
    assert np.count_nonzero(up) > 5
    assert np.abs(fields[0, up]).max() < 0.01  # each place lies on its own side
    assert np.abs(fields[[3, 4, 5]][:, up]).max() < 0.12  # bent by 0.1 in one direction


def test_poses_within_a_20th_of_the_radius_and_2_degrees_are_one():
    def place(shift=0.0, degrees=0.0):
        turn = Rotation.from_rotvec([0.0, np.radians(degrees), 0.0]).as_matrix()
        return np.column_stack([turn, [shift, 0.0, 0.0]])

    places = np.array([place(), place(0.04), place(0.06), place(0.0, 1.9), place(0.0, 2.1)])
    assert pose_search._distinct(places, np.arange(5.0)) == [0, 2, 4]


def test_places_that_are_tried_are_a_fifth_of_the_radius_apart_and_leave_no_gap():
    _, vertices, faces = bumpy()
    mesh = scanned_mesh.mesh_of(vertices / 10.0, faces, 2.0)
    places, _ = pose_search._fields(mesh, 1.0)
    origins = places[..., 3]
    tree = cKDTree(origins)
    assert tree.query(origins, 2)[0][:, 1].min() >= 0.2
    assert tree.query(mesh.centers)[0].max() < 0.2 + 2.0 * pose_search.SPACING
    assert np.abs(places[..., :3].swapaxes(1, 2) @ places[..., :3] - np.eye(3)).max() < 1e-12


def test_long_triangles_are_halved_until_a_patch_covers_many():
    corners = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 2.0, 0.0], [0.0, 2.0, 0.0]])
    mesh = scanned_mesh.mesh_of(corners, np.array([[0, 1, 2], [0, 2, 3]]), 1.0)
    edges = np.linalg.norm(np.roll(mesh.triangles, 1, axis=1) - mesh.triangles, axis=2)
    assert 0.125 < edges.max() <= 0.25
    assert np.linalg.norm(triangle_cross(mesh.triangles), axis=1).sum() / 2.0 == pytest.approx(6.0)
    assert mesh.centers == pytest.approx(mesh.triangles.mean(axis=1))
    assert mesh.smooth == pytest.approx(np.tile([0.0, 0.0, 1.0], (len(mesh.smooth), 1)))


def test_contours_are_tried_in_turns_of_ten_degrees(monkeypatch):
    tried, costs = [], pose_search._costs
    monkeypatch.setattr(
        pose_search, "_costs", lambda felt, fields: tried.append(felt[0, -1]) or costs(felt, fields)
    )
    register(touch(surfaces.plane()), 50.0 * SQUARE, [[0, 1, 2]])
    turns = np.sort(np.degrees(np.arctan2(*np.array(tried)[:, 1::-1].T)))
    assert np.diff(turns) == pytest.approx(np.full(35, 10.0))
