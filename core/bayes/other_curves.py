# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether one curve contradicts the others, as if it were flipped or its plane were another.

Not in the paper. Three curves always agree, because the normal curvatures H + A cos 2 phi + B sin 2 phi are
three numbers. Where there are more contacts, all others predict each curve, with a deviation.
"""

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..verdict import NOTICED
from .joint_fit import posteriors_of
from .posterior import SurfacePosterior

LEAST_CURVES = 4  # Fewer curves, where all strokes count as one, never contradict each other.
OUTER = 0.5  # A curve counts from this share of its reach on, where it leaves the tangent plane.


def contradicting_curve(
    contacts: Array, curve: NDArray[np.intp], posterior: SurfacePosterior, noise: float, point_std: float
) -> tuple[float, float]:
    """The number of deviations, and the height in unit radius, by which a curve is off what the others show.

    contacts : (n, 3), without the reference point, in the frame and in unit radius
    curve : (n,), the number of the curve of each contact, -1 for contacts of strokes
    posterior : of all contacts; noise : least deviation of a contact; point_std : as in `Observations`

    Both are medians over the outer contacts of the curve that is off by most deviations, so outliers do not
    count. There are LEAST_CURVES or more. Waviness and noise of the others are estimated if a curve is off by
    more than NOTICED deviations without that.
    """
    numbers = np.unique(curve)
    others = (curve != numbers[numbers >= 0][:, None]).astype(float)
    k1, k2 = (2.0 * float(posterior.polynomial[i]) for i in (2, 4))  # The terms x^2 and y^2.
    usual = posteriors_of(k1, k2, contacts, others, float(posterior.noise), point_std, by_evidence=False)
    most_off = _most_off(contacts, others, usual)
    if most_off[0] <= NOTICED:
        return most_off
    return _most_off(contacts, others, posteriors_of(k1, k2, contacts, others, noise, point_std))


def _most_off(contacts: Array, others: Array, posteriors: SurfacePosterior) -> tuple[float, float]:
    """By how many deviations, and by what height, the curve that is most off is off the others: medians.

    others : (b, n), for each curve the weights of contacts, 0 for its own
    """
    reach, medians = np.hypot(contacts[:, 0], contacts[:, 1]), []
    for i, weights in enumerate(others):
        own_reach = reach * (weights == 0.0)
        outer, predicted = contacts[own_reach > OUTER * own_reach.max()], posteriors.at(i)
        off = outer[:, 2] - predicted.height(*outer[:, :2].T)
        std = np.hypot(predicted.height_std(*outer[:, :2].T), predicted.noise)
        medians.append((abs(float(np.median(off / std))), abs(float(np.median(off)))))
    return max(medians)
