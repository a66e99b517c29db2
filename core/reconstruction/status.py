# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a reconstruction can be trusted: what gives reason to doubt it, and what to do about that."""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from ..bayes.posterior import CONFIDENCE, terms_to
from ..contours.contour import SURFACE_ENDS, UNEXPLAINED, stops_at, unit_normals
from ..patch.domain import AT_POINT

# benchmarks.stability chose these, and benchmarks.real LIKELY and those of taps. A fit is in doubt beyond
# them.
DOUBTFUL_STD = 0.02  # Mean deviation of the height over the domain, as a share of the radius.
DOUBTFUL_WAVES = 0.012  # What a quartic leaves of a rough surface along its curves, as a share of the radius.
DOUBTFUL_CONDITION = 1e3  # The factor by which plain least squares amplifies noise.
DOUBTFUL_TURN = math.radians(10.0)  # Angle by which the frame may be off.
LIKELY = 0.5  # Probability of that angle on a rough surface, whose directions differ at each scale.
DOUBTFUL_CURVATURE = 0.1  # Deviation of a curvature times the radius: that of curves a quarter as long.
# Mean curvature times the radius of a curve of few bends (benchmarks.curvatures: folds of 15 and 20 degrees).
# With less, a default cylinder is in doubt at its rim.
DOUBTFUL_FOLD = 0.2
DOUBTFUL_MISS = 0.005  # Share of the radius by which a curve may miss the point, if it is
OWN_POINT = 1e-6  # A contact that is nearer to the point, in unit radius, is the point.
SIGNIFICANT = 5.0  # this many standard deviations as well.
# Scatter counts as at least this share of a contact's noise: few contacts may scatter less.
LEAST_SCATTER = 0.3
# Angle in radians by which normals contradict the contacts, if it is SIGNIFICANT as well.
CONTRADICTED = 0.01
# Angle in radians by which normals are off the curves, and the least multiple of their deviation that it is.
SCATTERED, SCATTERED_DEVIATIONS = 0.15, 3.0
CONTRADICTING_CURVE = 7.0  # Deviations by which half of a curve is off what the others show.
DOUBTFUL_FIT = 0.01  # Share of the radius by which half of the contacts are off, beyond their noise.
CONTRADICTING = 2.0  # Mean number of deviations by which the surface is off the patch between the curves.
FLAT = 0.5  # A point is on a flat face if more than this share of the contacts, those around it,
FLAT_COSINE = math.cos(math.radians(0.5))  # have its normal, to half a degree. Its curvature is then below
BENT, BENT_DEVIATIONS = 0.02, 3.0  # this share of 1 / radius, or this many deviations (tests of core.scan).
DOUBTFUL_GAP = 0.04  # Share of the area that has no surface: near a straight edge it may be 0.03.

Judged = Any  # A Reconstruction, whose module imports this one.


class Taps(NamedTuple):
    """What a finger that tapped between the curves has found.

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


def doubt(r: Judged) -> tuple[str, str] | None:
    """The status and a sentence of advice, or None if there is no doubt."""
    if not r.converged:
        return "not_converged", (
            "The minimization stopped at its step limit, and the patch is the best so far: use the "
            "fast solver or a smaller weight."
        )
    if r.method == "least-squares" and r.condition_number > DOUBTFUL_CONDITION:
        return "uncertain", (
            "The contacts alone do not determine the surface between the curves (condition number "
            f"{r.condition_number:.1e}): use another method or add sampling planes."
        )
    # The gravest come first.
    each = (
        _about_point,
        _about_data,
        _about_heights,
        _about_frame,
        _about_curves,
        _about_bends,
        _about_curvatures,
    )
    message = next((sentence for about in each for sentence in about(r)), None)
    return None if message is None else ("uncertain", message)


def contradicted(r: Judged) -> tuple[str, str] | None:
    """The status and a sentence of advice if taps contradict a fit, or None."""
    taps: Taps | None = r.taps
    if taps is None:
        return None
    if taps.off:
        return "uncertain", (
            f"Between the curves the surface is up to {100.0 * taps.off:.2g} % of the radius off the "
            f"patch, perhaps at an edge or a pocket that no curve crosses: {_denser(r)}."
        )
    if taps.missed and _is_at_edge(r):
        return "uncertain", (
            "The point is so near an edge that taps beside it feel no surface: move the point away from the "
            "edge."
        )
    if taps.missing > DOUBTFUL_GAP:
        return over_nothing(r, taps.missing)
    return None


def over_nothing(r: Judged, share: float) -> tuple[str, str]:
    """The status and a sentence of advice if there is no surface at this share of a patch's area."""
    return "uncertain", (
        f"At {100.0 * share:.0f} % of the patch there is no surface, which ends or has a hole between the "
        f"curves: {_denser(r)}."
    )


def _denser(r: Judged) -> str:
    """What brings curves nearer to each other."""
    return "add sampling planes" if _has_tried_shorter(r) else "use a shorter extent or add sampling planes"


def _has_tried_shorter(r: Judged) -> bool:
    """Whether the touch chose its extent, and so has tried shorter ones."""
    return r.method == "bayes" and UNEXPLAINED in _stops(r)


def _is_at_edge(r: Judged) -> bool:
    """Whether the surface ends at the point, as a half curve shows."""
    return any(stop in SURFACE_ENDS for stop in stops_at(r.contours, r.frame.origin, AT_POINT * r.radius))


def notes(r: Judged) -> str:
    """Further notes, whatever the status: sentences, each after a space."""
    message = ""
    if r.taps is not None and r.taps.missed:
        message += f" At {r.taps.missed} of {r.taps.number} taps between the curves there is no surface."
    if r.posterior.is_round:
        message += " The two curvatures are equal within their error, so there are no principal directions."
    if r.null_space_dimension:
        terms = terms_to(r.patch.degree)
        message += f" These planes cannot show {r.null_space_dimension} of the {terms} ways to bend."
    return message


def _about_point(r: Judged) -> Iterator[str]:
    """Whether curves miss the point, which makes everything else doubtful, too."""
    distances, stds = r.misses.T / r.radius
    stds = np.maximum(stds, LEAST_SCATTER * r.noise)
    stds = np.hypot(stds, r.point_std) if r.point_std < 1.0 else stds
    apart = distances > np.maximum(DOUBTFUL_MISS, SIGNIFICANT * stds)
    if apart.any():
        worst = np.argmax(np.where(apart, distances, 0.0))
        # If the point is one of its contacts, the fit to these is off.
        if r.contours[worst].distance_to(r.point) <= OWN_POINT * r.radius:
            yield (
                f"Curve {worst + 1} bends so sharply at the point that its fit is "
                f"{100.0 * distances[worst]:.2g} % of the radius off there: move the point away from edges, "
                "or make the facets finer."
            )
            return
        yield (
            f"Curve {worst + 1} passes the reference point at {r.radius * distances[worst]:.3g}"
            ", more than its scatter explains: set the point where the curves meet."
        )


def _about_data(r: Judged) -> Iterator[str]:
    """Whether measured normals or half of the contacts are off what was found."""
    deviations, angle = r.contradiction
    if deviations > SIGNIFICANT and angle > CONTRADICTED:
        yield (
            f"The measured normals contradict the contacts by {math.degrees(angle):.1f} degrees on "
            "average, more than their deviation explains: check the frame they were measured in, or "
            "leave them out."
        )
    deviations, angle = r.normal_scatter
    if deviations > SCATTERED_DEVIATIONS and angle > SCATTERED:
        yield (
            f"The measured normals are off the curves by {math.degrees(angle):.0f} degrees, which is "
            f"{deviations:.0f} times their deviation: check which contact each belongs to, give their "
            "deviation, or leave them out."
        )
    missed = r.typical_miss / r.radius
    if missed > DOUBTFUL_FIT + r.noise:
        yield (
            f"Half of the contacts are off the patch by more than {100.0 * missed:.1f} % of the radius, "
            "which their noise does not explain: use a shorter extent or give their noise."
        )


def _about_heights(r: Judged) -> Iterator[str]:
    """Whether heights are uncertain."""
    share = r.mean_height_std / r.radius
    if share > DOUBTFUL_STD:
        yield (f"Heights are accurate to {100.0 * share:.1f} % of the radius on average: {_denser(r)}.")


def _about_frame(r: Judged) -> Iterator[str]:
    """Whether principal directions or curvatures are uncertain."""
    turn = r.posterior.turn(LIKELY if r.posterior.amplitude else CONFIDENCE)
    if turn > DOUBTFUL_TURN and not r.posterior.is_round:
        yield f"The principal directions may be {math.degrees(turn):.0f} degrees off: {_more_bend(r)}."
    std = r.posterior.curvature_std()
    if std > DOUBTFUL_CURVATURE:
        yield (
            f"Curvatures are accurate to only {100.0 * std:.2g} % of 1 / radius in the least known "
            f"direction: {_more_bend(r)}."
        )


def _stops(r: Judged) -> set[str]:
    """Why half curves end."""
    return {stop for contour in r.contours for stop in contour.stops or ()}


def _more_bend(r: Judged) -> str:
    """What shows more of the curvatures: curves that surface or fit have ended do not become longer."""
    stops = _stops(r)
    if stops.intersection(SURFACE_ENDS):
        return "use a shorter extent, move the point away from the edge, or add sampling planes"
    return "add sampling planes" if UNEXPLAINED in stops else "use a longer extent or add sampling planes"


def _about_curves(r: Judged) -> Iterator[str]:
    """Whether a curve contradicts the others, or the surface waves along curves."""
    deviations, off = r.curve_contradiction
    if deviations > CONTRADICTING_CURVE:
        yield (
            f"A curve is {100.0 * off:.2g} % of the radius off what the others show, {deviations:.0f} times "
            "the deviation, as if it were flipped or its plane were another: check each curve."
        )
    waves = r.waves / r.radius
    if waves > DOUBTFUL_WAVES and not len(r.strokes):
        yield (
            f"Waves of {100.0 * waves:.1f} % of the radius run along the curves, which do not show where "
            f"they go on between them: {_denser(r)}."
        )


def _about_bends(r: Judged) -> Iterator[str]:
    """Whether the curvature is that of few bends: of folds, of facets, or of what is next to a flat face."""
    bent = r.radius * max(abs(r.k1), abs(r.k2))
    if bent > max(BENT, BENT_DEVIATIONS * r.posterior.curvature_std()) and _flat_share(r) > FLAT:
        advice = "move the point away from them"
        yield (
            "The point is on a flat face, and the curvature is that of the bends next to it: "
            f"{advice if _has_tried_shorter(r) else 'use a shorter extent or ' + advice}."
        )
    if r.bends.folded > DOUBTFUL_FOLD:
        advice = "move the point away from folds" if _has_tried_shorter(r) else "use a shorter extent"
        yield (
            "The surface turns at only one or two places along a curve, as at folds or facets, and the "
            f"curvature is that of these: {advice}, or make the facets finer."
        )


def _about_curvatures(r: Judged) -> Iterator[str]:
    """Whether the contacts near the point contradict the curvatures."""
    if r.curvature_contradiction > SIGNIFICANT:
        advice = "move the point away from it" if _has_tried_shorter(r) else "use a shorter extent"
        yield (
            "The contacts near the point bend otherwise than the patch, as beside a tip or a fold within it: "
            f"{advice}."
        )


def _flat_share(r: Judged) -> float:
    """The share of contacts with the normal at the point, on each half curve up to the first other one."""
    flat = number = 0
    for contour in r.contours:
        if contour.normals is None:
            continue
        at = int(np.argmin(np.linalg.norm(contour.points - r.frame.origin, axis=1)))
        normals = unit_normals(contour.normals)
        turns = np.abs(normals @ normals[at]) < FLAT_COSINE
        for half in (turns[:at][::-1], turns[at + 1 :]):
            flat += int(np.argmax(np.append(half, True)))
            number += len(half)
    return flat / max(number, 1)
