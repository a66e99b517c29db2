# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a reconstruction can be trusted: what gives reason to doubt it."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ..arguments import Array
from ..bayes.normals import SLOPE_MISFIT
from ..bayes.posterior import CONFIDENCE, SurfacePosterior
from ..contours.contour import SURFACE_ENDS, UNEXPLAINED, Contour, unit_normals
from ..verdict import FROM_EDGE, LONGER, NOTICED, SHORTER, SIGNIFICANT, SUBDIVIDE, Doubt, beyond

# A fit is in doubt beyond these. benchmarks.stability chose them, benchmarks.real LIKELY and those of taps.
DOUBTFUL_STD = 0.02  # Mean deviation of the height over the domain, as a share of the radius.
DOUBTFUL_CONDITION = 1e3  # The factor by which plain least squares amplifies noise.
DOUBTFUL_TURN = math.radians(10.0)  # Angle by which the frame may be off.
LIKELY = 0.5  # Probability of that angle on a rough surface, whose directions differ at each scale.
DOUBTFUL_CURVATURE = 0.1  # Deviation of a curvature times the radius: that of curves a quarter as long.
# Mean curvature times the radius of a curve of few bends (benchmarks.curvatures: folds of 15 and 20 degrees).
# With less, a default cylinder is in doubt at its rim.
DOUBTFUL_FOLD = 0.2
DOUBTFUL_MISS = 0.005  # Share of the radius by which a curve misses the point, if it is SIGNIFICANT as well.
# Scatter counts as at least this share of a contact's noise: few contacts may scatter less.
LEAST_SCATTER = 0.3
# Angle in radians by which normals are off the curves, if it is above NOTICED of their deviations as well.
SCATTERED = 0.15
CONTRADICTING_CURVE = 7.0  # Deviations by which half of a curve is off what the others show.
# Share of the radius by which half of the contacts are off, beyond their noise, and that a quartic leaves of
# a rough surface along its curves. Contacts that are rougher are not fitted while an extent is chosen: with
# 0.01 there are a quarter more fits, for 4 % more area.
DOUBTFUL_FIT = 0.008
CONTRADICTING = 2.0  # Mean number of deviations by which the surface is off the patch between the curves.
# A point is on a flat face if more than this share of the contacts, those next to it, have its normal to half
# a degree.
FLAT_SHARE, FLAT_COSINE = 0.5, math.cos(math.radians(0.5))
# A patch bends there if its curvature is above this share of 1 / radius and NOTICED deviations (tests of
# core.scan).
BENT = 0.02
# The curvature is that of facets if it is off all estimates of the shape's by this share of the larger one,
# by this multiple of what estimates are apart, and by what bends a patch (benchmarks.facets --models).
OFF_SHAPE, DISAGREEING = 0.21, 1.5
DOUBTFUL_GAP = 0.04  # Share of the area that has no surface: near a straight edge it may be 0.03.


class Taps(NamedTuple):
    """What taps of the finger between the curves have met.

    number : how often it tapped
    missed : how often it met no surface within the radius
    off : the largest distance of the surface from the patch, in units of L, if taps contradict it; else 0
    missing : the share of the patch's area where there is no surface within the radius
    height : the mean distance in height where there is surface, at the Gauss points of the domain, or None
    """

    number: int
    missed: int = 0
    off: float = 0.0
    missing: float = 0.0
    height: float | None = None


def useless(method: str, contours: Sequence[Contour], shape: Array) -> tuple[str, ...]:
    """Advice that does not apply: a touch that chose its extent has tried shorter ones, a fine mesh is fine.

    shape : (n, 2), curvatures of the shape that few facets stand for; none on a fine mesh
    """
    has_tried = method == "bayes" and UNEXPLAINED in stops_of(contours)
    return (*([SHORTER] if has_tried else []), *([] if len(shape) else [SUBDIVIDE]))


def stops_of(contours: Sequence[Contour]) -> set[str]:
    """Why half curves end."""
    return {stop for contour in contours for stop in contour.stops or ()}


def about_taps(taps: Taps | None, is_at_edge: bool, useless: tuple[str, ...]) -> Iterator[Doubt]:
    """Whether taps contradict the fit; the surface may end at the point, as a half curve shows."""
    if taps is None:
        return
    yield from beyond("taps", taps.off, 0.0, useless)
    if taps.missed and is_at_edge:
        yield Doubt("near_edge", taps.missed)
    yield from beyond("gap", taps.missing, DOUBTFUL_GAP, useless)


def about_facets(off: Sequence[float], shape: Array, radius: float) -> Iterator[Doubt]:
    """Whether few facets have other principal curvatures than the shape that they stand for.

    off : n numbers, how far the patch's curvatures are off estimates of the shape's; shape : (n, 2), these
    """
    if not off:
        return
    largest, apart = float(np.abs(shape).max()), float(np.ptp(shape, axis=0).max())
    if min(off) > max(OFF_SHAPE * largest, DISAGREEING * apart, BENT / radius):
        yield Doubt("facets", max(off) / largest, OFF_SHAPE)


def about_point(
    misses: Array, noise: float, point_std: float, contours: Sequence[Contour], point: Array, radius: float
) -> Iterator[Doubt]:
    """Whether curves miss the point, which makes everything else doubtful, too.

    misses : (c, 2), distances at which curves pass the point, and their deviations
    """
    distances, stds = misses.T / radius
    stds = np.maximum(stds, LEAST_SCATTER * noise)
    stds = np.hypot(stds, point_std) if point_std < 1.0 else stds
    limits = np.maximum(DOUBTFUL_MISS, SIGNIFICANT * stds)
    if (distances > limits).any():
        worst = int(np.argmax(np.where(distances > limits, distances, 0.0)))
        off, limit, words = float(distances[worst]), float(limits[worst]), (str(worst + 1),)
        # If one of its contacts is that near to the point, the fit to these is off.
        if contours[worst].distance_to(point) <= DOUBTFUL_MISS * radius:
            yield Doubt("kink", off, limit, words)
        else:
            yield Doubt("point", radius * off, radius * limit, words)


def about_normals(contradiction: tuple[float, float], scatter: tuple[float, float]) -> Iterator[Doubt]:
    """Whether measured normals contradict the contacts: numbers of deviations, and angles in radians."""
    deviations, angle = contradiction
    if deviations > SIGNIFICANT and angle > SLOPE_MISFIT:
        yield Doubt("normals", angle, max(SLOPE_MISFIT, SIGNIFICANT * angle / deviations))
    deviations, angle = scatter
    if deviations > NOTICED and angle > SCATTERED:
        explained = max(SCATTERED, NOTICED * angle / deviations)
        yield Doubt("scattered_normals", angle, explained)


def about_frame(
    posterior: SurfacePosterior, contours: Sequence[Contour], useless: tuple[str, ...]
) -> Iterator[Doubt]:
    """Whether principal directions or curvatures are uncertain.

    Curves that the surface or the fit has ended do not become longer.
    """
    stops = stops_of(contours)
    if stops.intersection(SURFACE_ENDS):
        useless = (*useless, LONGER)
    else:
        useless = (*useless, SHORTER, FROM_EDGE, *([LONGER] if UNEXPLAINED in stops else []))
    turn = posterior.turn(LIKELY if posterior.amplitude else CONFIDENCE)
    if turn > DOUBTFUL_TURN and not posterior.is_round:
        yield Doubt("directions", turn, DOUBTFUL_TURN, useless=useless)
    yield from beyond("curvatures", posterior.curvature_std(), DOUBTFUL_CURVATURE, useless)


def is_on_flat_face(bent: float, std: float, contours: Sequence[Contour], origin: Array) -> bool:
    """Whether the point is on a flat face, although it bends by a curvature with this deviation, in 1 / L."""
    return bent > max(BENT, NOTICED * std) and _flat_share(contours, origin) > FLAT_SHARE


def _flat_share(contours: Sequence[Contour], origin: Array) -> float:
    """The share of contacts with the normal at the point, on each half curve up to the first other one."""
    felt = [(contour.points, contour.normals) for contour in contours if contour.normals is not None]
    units, flat, start = unit_normals(np.concatenate([np.empty((0, 3)), *(n for _, n in felt)])), 0, 0
    for points, _ in felt:
        r, normals, start = points - origin, units[start : start + len(points)], start + len(points)
        at = int(np.einsum("ni,ni->n", r, r).argmin())
        turns = (np.abs(normals @ normals[at]) < FLAT_COSINE).tolist()
        flat += sum([*half, True].index(True) for half in (turns[:at][::-1], turns[at + 1 :]))
    return flat / max(len(units) - len(felt), 1)
