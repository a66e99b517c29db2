# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Outward normals of strokes that were measured without normals."""

import re

import numpy as np
import pytest

import core
from core.atlas.orientation import doubts_of, oriented, planes_of


def sphere(radius, gap, middle=(0.0, 0.0, 0.0)):
    """Circles of contacts on a sphere, around z and around x."""
    strokes = []
    for z in np.arange(-radius + 0.3 * gap, radius, gap):
        r = np.sqrt(radius**2 - z**2)
        t = np.linspace(0.0, 2.0 * np.pi, max(4, int(12.0 * r / gap)), endpoint=False)
        ring = np.column_stack([r * np.cos(t), r * np.sin(t), np.full(len(t), z)])
        strokes += [ring + middle, ring[:, [2, 0, 1]] + middle]
    return strokes


def box(sizes, gap):
    """Rows on the six faces of a box, and the outward normals."""
    strokes, normals = [], []
    for axis in range(3):
        u, v = (k for k in range(3) if k != axis)
        for side in (-1.0, 1.0):
            for at in np.arange(-sizes[u] + 0.4 * gap, sizes[u], gap):
                along = np.arange(-sizes[v] + 0.1 * gap, sizes[v], 0.3 * gap)
                row = np.zeros((len(along), 3))
                row[:, u], row[:, v], row[:, axis] = at, along, side * sizes[axis]
                strokes.append(row)
                normals.append(np.tile(side * np.eye(3)[axis], (len(row), 1)))
    return strokes, np.vstack(normals)


def outward(strokes, **options):
    points = np.vstack(strokes)
    planes = planes_of(points, 0.0)
    normals = oriented(points, planes, **options)
    return normals, next(doubts_of(points, normals, planes.links), None)


def test_normals_follow_from_each_other_around_the_edges_of_a_box():
    strokes, truth = box((0.5, 0.4, 0.3), 0.1)
    normals, doubt = outward(strokes)
    assert (np.einsum("ni,ni->n", normals, truth) > 0.0).mean() > 0.98
    assert doubt is None


def test_a_thin_plate_has_two_sides():
    strokes, truth = box((0.5, 0.4, 0.03), 0.028)
    normals, doubt = outward(strokes)
    assert (np.einsum("ni,ni->n", normals, truth) > 0.0).mean() > 0.98
    assert doubt is None


def test_a_shell_inside_another_faces_its_cavity():
    outer, inner = sphere(1.0, 0.15), sphere(0.6, 0.15)
    normals, doubt = outward([*outer, *inner])
    out = np.einsum("ni,ni->n", normals, np.vstack([*outer, *inner])) > 0.0
    count = sum(map(len, outer))
    assert out[:count].all()
    assert not out[count:].any()
    assert doubt is None


def test_each_of_two_balls_faces_outward_and_a_hint_along_their_surface_changes_nothing():
    one, two = sphere(1.0, 0.15), sphere(1.0, 0.15, (2.5, 0.0, 0.0))
    middles = np.repeat([[0.0, 0.0, 0.0], [2.5, 0.0, 0.0]], sum(map(len, one)), axis=0)
    for up in (None, np.array([0.0, 0.0, 1.0])):
        normals, _ = outward([*one, *two], up=up)
        assert (np.einsum("ni,ni->n", normals, np.vstack([*one, *two]) - middles) > 0.0).all()


@pytest.mark.parametrize("gap", [0.005, 0.01, 0.02, 0.05])
def test_each_of_two_balls_faces_outward_with_a_gap_below_what_separates_their_contacts(gap):
    one, two = sphere(0.5, 0.1), sphere(0.5, 0.1, (1.0 + gap, 0.0, 0.0))
    middles = np.repeat([[0.0, 0.0, 0.0], [1.0 + gap, 0.0, 0.0]], sum(map(len, one)), axis=0)
    normals, _ = outward([*one, *two])
    assert (np.einsum("ni,ni->n", normals, np.vstack([*one, *two]) - middles) > 0.0).mean() > 0.95


def test_a_hint_decides_for_what_is_open():
    flat = [row for row in box((0.5, 0.4, 0.3), 0.1)[0] if (row[:, 2] == 0.3).all()]
    for side in (1.0, -1.0):
        normals, _ = outward(flat, up=np.array([0.0, 0.0, side]))
        assert (side * normals[:, 2] > 0.9).all()
    with pytest.raises(ValueError, match="outward: expected a direction where contacts have no normals and"):
        outward(flat)


def test_measured_normals_decide_before_a_hint():
    strokes = sphere(1.0, 0.15)
    known = np.zeros((sum(map(len, strokes)), 3))
    known[: len(strokes[0])] = -strokes[0]
    normals, _ = outward(strokes, known=known)
    assert (np.einsum("ni,ni->n", normals, np.vstack(strokes)) < 0.0).all()


def test_strokes_that_are_too_far_apart_for_a_wall_are_a_doubt_that_names_a_place():
    atlas = core.atlas_of([*sphere(1.0, 0.4), *sphere(0.8, 0.4)], noise=0.05)
    assert atlas.doubts[0].code in ("opposed", "confused")
    assert re.search(
        r"(most together|each other) around \(.*\).* strokes are (too far|farther) apart", atlas.message
    )


def thin_plate(thickness):
    """Random contacts all over a plate of 1 by .8, and its normals."""
    rng = np.random.default_rng(0)
    half = 0.5 * np.array([1.0, 0.8, thickness])
    areas = half.prod() / half
    axis = rng.choice(3, 1500, p=areas / areas.sum())
    normals = np.eye(3)[axis] * rng.choice([-1.0, 1.0], (1500, 1))
    points = np.where(normals, normals, rng.uniform(-1.0, 1.0, (1500, 3))) * half
    return points, normals


@pytest.mark.parametrize("thickness", [0.1, 0.03, 0.01])
def test_the_two_sides_of_a_thin_plate_do_not_contradict_each_other(thickness):
    points, normals = thin_plate(thickness)
    assert not list(doubts_of(points, normals, planes_of(points, 0.0).links))


@pytest.mark.parametrize(("share", "count"), [(0.005, 0), (0.02, 1)])
def test_normals_contradict_each_other_if_more_than_a_fiftieth_of_neighbors_do(share, count):
    points, normals = thin_plate(0.3)
    normals[: int(share * len(normals))] *= -1.0
    found = list(doubts_of(points, normals, planes_of(points, 0.0).links))
    assert len(found) == count
    assert [doubt.value for doubt in found] == pytest.approx([2.0 * share] * count, rel=0.2)
