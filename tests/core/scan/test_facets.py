# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a touch has felt so few facets that its curvature is theirs: on prisms, which are known exactly."""

import math

import numpy as np
import pytest

import core

UP = (0.0, 0.0, 1.0)


class Prism:
    """Strips along y, 2 long, over a polygon (x, z) in the order of x; rays from above meet it."""

    def __init__(self, profile):
        self.profile = np.array(profile, dtype=float)

    def ray_cast(self, origin, direction, distance):
        found = None
        for face in range(len(self.profile) - 1):
            a, b, c = self.corners_of(face)[:3]
            normal = np.cross(b - a, c - a)
            normal /= np.linalg.norm(normal)
            speed = normal @ direction
            gone = normal @ (a - origin) / speed if abs(speed) > 1e-12 else -1.0
            point = np.add(origin, gone * np.array(direction))
            inside = a[0] - 1e-12 <= point[0] <= b[0] + 1e-12 and abs(point[1]) <= 1.0
            if inside and 0.0 <= gone <= distance and (found is None or gone < found[0]):
                found = gone, tuple(point), tuple(normal)
        return None if found is None else found[1:]

    def corners_of(self, face):
        (x, z), (u, w) = self.profile[face : face + 2]
        return np.array([(x, -1.0, z), (u, -1.0, w), (u, 1.0, w), (x, 1.0, z)])

    def face_near(self, point):
        at, ahead = self.profile[:-1], self.profile[1:]
        along, off = ahead - at, np.array(point)[[0, 2]] - at
        share = np.clip((off * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
        return int(np.argmin(np.linalg.norm(off - share[:, None] * along, axis=1)))


def arc(facets, bend=60.0):
    """An arc of radius 1 that bends by `bend` degrees to either side, in facets."""
    angles = np.radians(np.linspace(-bend, bend, facets + 1))
    return Prism(np.column_stack([np.sin(angles), np.cos(angles)]))


def has_few(prism, extent, x=0.01):
    z = np.interp(x, *prism.profile.T)
    r = core.explore(prism, (x, 0.0, z), UP, extent=extent).result
    return core.has_few_facets(r, prism.face_near, prism.corners_of)


@pytest.mark.parametrize(
    ("facets", "extent", "few"), [(5, 0.15, True), (8, 0.5, True), (9, 0.1, True), (41, 0.4, False)]
)
def test_few_facets_of_an_arc_are_not_its_shape(facets, extent, few):
    assert has_few(arc(facets), extent) is few


def test_a_flat_face_between_sharp_edges_is_the_shape():
    assert not has_few(Prism([(-1.0, -1.0), (-0.99, 0.0), (0.99, 0.0), (1.0, -1.0)]), 0.5)
    assert not has_few(Prism([(-1.0, 0.0), (-0.3, 0.0), (0.2, 0.0), (1.0, 0.0)]), 0.5)


def test_a_flat_face_next_to_a_fillet_is_the_shape():
    round_ = [
        (1.0 + 0.05 * math.sin(a), -0.05 + 0.05 * math.cos(a)) for a in np.radians(np.arange(0, 100, 18))
    ]
    assert not has_few(Prism([(-1.0, 0.0), *round_]), 0.5, x=0.7)
