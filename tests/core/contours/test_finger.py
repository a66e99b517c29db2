# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A finger that moves freely: around edges, against walls, under roofs, never onto the back of a surface."""

from types import SimpleNamespace

import numpy as np
import pytest

from core.atlas.finger import Finger
from tests import solids

BLOCK = solids.block(1.0, 1.0, 0.5)
UP, EAST = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)


def test_on_a_face_it_comes_down_ahead():
    point, normal = Finger(BLOCK, 1.0).ahead((0.0, 0.0, 0.5), UP, EAST, 0.5, 0.2)
    assert point == pytest.approx((0.2, 0.0, 0.5))
    assert normal == UP


def test_at_an_edge_it_bends_around():
    point, normal = Finger(BLOCK, 1.0).ahead((0.95, 0.0, 0.5), UP, EAST, 0.5, 0.2)
    assert point[0] == pytest.approx(1.0)
    assert normal == EAST


def test_where_a_patch_ends_a_little_beyond_its_surface_it_starts_half_a_way_back():
    found = Finger(BLOCK, 1.0).ahead((1.02, 0.0, 0.5), UP, EAST, 0.5, 0.2)
    assert found is not None and found[1] == EAST
    assert Finger(BLOCK, 1.0).ahead((1.12, 0.0, 0.5), UP, EAST, 0.5, 0.2) is None


def test_a_hit_on_the_back_of_a_surface_is_none():
    inward = SimpleNamespace(
        ray_cast=lambda *ray: (p := BLOCK.ray_cast(*ray)) and (p[0], tuple(-n for n in p[1]))
    )
    assert Finger(inward, 1.0).ahead((0.0, 0.0, 0.5), UP, EAST, 0.5, 0.2) is None
    assert Finger(inward, -1.0).ahead((0.0, 0.0, 0.5), UP, EAST, 0.5, 0.2) is not None


def test_a_disk_has_the_contacts_around_and_ends_where_the_surface_turns_away():
    whole = Finger(BLOCK, 1.0).disk((0.0, 0.0, 0.5), UP, EAST, 0.3)
    half = Finger(BLOCK, 1.0).disk((1.0, 0.0, 0.5), UP, EAST, 0.3)
    assert whole.shape == (37, 2, 3)
    assert (whole[:, 0, 2] == 0.5).all() and (whole[:, 1] == UP).all()
    out = np.hypot(*whole[1:, 0, :2].T) / 0.3
    assert out**2 == pytest.approx((np.arange(36) + 0.5) / 36)
    assert 15 < len(half) < 22


def test_a_disk_is_felt_from_half_way_to_a_roof():
    def ray_cast(origin, direction, distance):
        """The floor z = 0, and a roof above it whose lower face slopes from .1 down to .03."""
        hits = []
        for normal, offset in (
            (np.array([0.0, 0.0, 1.0]), 0.0),
            (np.array([0.23, 0.0, -1.0]) / 1.026, -0.0975),
        ):
            across = normal @ direction
            gone = (offset - normal @ origin) / across if across else -1.0
            if 0.0 < gone <= distance:
                hits.append((gone, normal))
        if not hits:
            return None
        gone, normal = min(hits, key=lambda hit: hit[0])
        return tuple(np.add(origin, np.multiply(gone, direction))), tuple(normal / np.linalg.norm(normal))

    disk = Finger(SimpleNamespace(ray_cast=ray_cast), 1.0).disk((0.0, 0.0, 0.0), UP, EAST, 0.2)
    assert len(disk) > 30
    assert np.abs(disk[:, 0, 2]).max() < 1e-9


@pytest.mark.parametrize(
    "answer", [((0.0, 0.0), UP), ((np.nan, 0.0, 0.0), UP), ((0.0, 0.0, 0.0), (0.0, 0.0, 2.0))]
)
def test_an_answer_that_is_no_contact_gets_a_sentence(answer):
    finger = Finger(SimpleNamespace(ray_cast=lambda *ray: answer), 1.0)
    with pytest.raises(ValueError, match="surface: expected a point and its unit normal of ray_cast, got"):
        finger.ahead((0.0, 0.0, 0.0), UP, EAST, 0.5, 0.2)
