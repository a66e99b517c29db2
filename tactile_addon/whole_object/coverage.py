# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a mesh patches cover: the progress of touches all over it."""

from contextlib import suppress

import numpy as np

from ... import core

PLACES, SEED = 1000, 0  # So many places all over the mesh are looked at.
NEAR = 3.0  # A patch covers what is nearer to it than so many tolerances, as in core.


class Coverage:
    """Places all over a mesh, and which of them patches cover.

    share : the share of the mesh's area that is covered; it never reaches 1 if the mesh hides faces
    """

    def __init__(self, target, tolerance):
        """`target` is the DetachedMesh that is touched."""
        self._near, self.share = NEAR * tolerance, 0.0
        self._left, rng = np.zeros((0, 3)), np.random.default_rng(SEED)
        with suppress(ValueError):  # No face has an area, so touches cannot begin.
            self._left = core.scattered(target.points, target.triangles, PLACES, rng)[0]

    def add(self, r, rim):
        """Takes in a core.Reconstruction and its radii all round, (n,)."""
        x, y, z = r.frame.to_local(self._left).T
        turns = np.linspace(0.0, 2.0 * np.pi, len(rim), endpoint=False)
        inside = np.hypot(x, y) < np.interp(np.arctan2(y, x), turns, rim, period=2.0 * np.pi)
        inside[inside] = np.abs(z[inside] - r.height(x[inside], y[inside])) < self._near
        self._left = self._left[~inside]
        self.share = 1.0 - len(self._left) / PLACES
