# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How evenly a surface bends along its curves, and so how well these show its curvatures at the point.

Not in the paper. A smooth surface turns a little between all contacts. One of few facets, or with a fold,
turns at few places: its contacts show a curvature as a rule of integration with as few nodes would, and those
within a facet share an error. The fit explains such contacts, so its own deviation has neither of both.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..arguments import Array
from ..contours.contour import Contour, unit_normals
from ..contours.local_geometry import Frame
from ..patch.monge import TERMS, monomials
from .posterior import largest_curvature_std
from .prior import FREE

# M bends show the mean curvature of a curve to the share (FEW_BENDS / M)^3 (benchmarks.curvatures: folds).
FEW_BENDS = 3.5
FLAT = 1e-6  # A curve whose normals turn by less, in radians, turns by rounding.


class Bends(NamedTuple):
    """How unevenly a surface bends along curves.

    covariance : (3, 3), of the coefficients of x^2, xy and y^2 in unit radius, for want of bends
    contacts : how many contacts share a bend, 1 or more
    """

    covariance: Array
    contacts: float

    @property
    def std(self) -> float:
        """The largest deviation of a normal curvature for want of bends, in unit radius."""
        return largest_curvature_std(self.covariance)


class _Curve(NamedTuple):
    """One curve: its direction (x, y) in the tangent plane, the sum of turns, and what `Bends` has, of it."""

    x: float
    y: float
    turned: float
    std: float
    contacts: float


def bends_of(contours: Sequence[Contour], frame: Frame, radius: float) -> Bends:
    """The bends along contours with normals; without any, and on a plane, nothing is uneven.

    Along a curve, turns d of the normals from contact to contact count as M = (sum |d|)^2 / sum d^2 bends: as
    many as there are turns if all are equal, and one if there is a single one.
    """
    of_each = (_curve(contour, frame, radius) for contour in contours if contour.normals is not None)
    x, y, turned, stds, contacts = np.array([of for of in of_each if of is not None]).reshape(-1, 5).T
    if not turned.any():
        return Bends(np.zeros((3, 3)), 1.0)
    inverse = np.linalg.pinv(2.0 * monomials(np.column_stack([x, y]), TERMS[2:FREE]))
    return Bends((inverse * stds**2) @ inverse.T, float(np.average(contacts, weights=turned)))


def _curve(contour: Contour, frame: Frame, radius: float) -> _Curve | None:
    """The bends along one contour, or None if it is too short to have any."""
    ahead = (contour.points[-1:] - contour.points[:1]) @ frame.axes[:, :2] / radius
    length = float(np.linalg.norm(ahead))
    if len(contour.points) < 3 or length == 0.0:
        return None
    x, y = (ahead[0] / length).tolist()
    normals = unit_normals(contour.normals) @ frame.axes  # type: ignore[arg-type]
    # Normals may be those of either side.
    angles = np.unwrap(np.arctan2(normals[:, :2] @ (x, y), normals[:, 2]), period=np.pi)
    # One contact alone that turns another way and back is an outlier.
    angles[1:-1] = np.median([angles[:-2], angles[1:-1], angles[2:]], axis=0)
    turns = np.diff(angles)
    turned = float(np.abs(turns).sum())
    if turned <= FLAT:
        return _Curve(x, y, 0.0, 0.0, 1.0)
    bends = turned**2 / float(turns @ turns)
    share = FEW_BENDS**3 * max(bends**-3 - len(turns) ** -3, 0.0)
    return _Curve(x, y, turned, share * abs(float(turns.sum())) / length, len(turns) / bends)
