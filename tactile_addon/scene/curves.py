# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The curves of a patch that the viewport draws: contours, contacts of strokes, rim, principal directions."""

from typing import TypeAlias

import numpy as np

from ... import core
from ..touch.types import Array

CURVES = "tactile_curves"  # The custom property of a patch with its Curves.
# By name, lists of curves with three coordinates a point, in the Darboux frame: contours, strokes (the
# contacts beside these), rim, and directions (d1 and d2).
Curves: TypeAlias = dict[str, list[list[float]]]
RIM_CORNERS = 96  # The number of points of the rim.
ALONG, POINTS = 0.4, 9  # How far a principal direction is drawn, as a share of the radius, and its points.


def curves_of(result: core.Reconstruction) -> Curves:
    """The curves of a reconstruction."""
    to_local = result.frame.to_local
    edge = result.domain.boundary(RIM_CORNERS)
    along, across = np.linspace(-ALONG, ALONG, POINTS) * result.radius, np.zeros(POINTS)
    plane = {"rim": [np.vstack([edge, edge[:1]])]}
    plane["directions"] = [np.column_stack(pair) for pair in ((along, across), (across, along))]
    found: dict[str, list[Array]] = {
        name: [np.column_stack([at, result.height(*at.T)]) for at in paths] for name, paths in plane.items()
    }
    found["contours"] = [to_local(contour.points) for contour in result.contours]
    if len(result.strokes):
        found["strokes"] = [to_local(result.strokes)]
    return {name: [path.ravel().tolist() for path in paths] for name, paths in found.items()}
