# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a reconstruction can be trusted: what gives reason to doubt it, and what to do about that."""

import math
from typing import NamedTuple, Protocol

import numpy as np

from ..arguments import Array
from ..bayes.posterior import Posterior, terms_to
from ..patch.monge import MongePatch
from ..patch.residual import Residual

# Chosen with benchmarks.stability, but for what benchmarks.real says of rough surfaces.
DOUBTFUL_STD = 0.02  # Share of the radius that the height may deviate on average over the domain.
DOUBTFUL_CONDITION = 1e3  # Plain least squares makes noise this many times larger.
DOUBTFUL_TURN = math.radians(10.0)  # Angle that the frame may be off.
LIKELY = 0.5  # Probability of that on a rough surface, whose directions are others at each scale.
DOUBTFUL_CURVATURE = 0.1  # Deviation in units of 1 / radius: what a curve tells that ends at a quarter of it.
DOUBTFUL_MISS = 0.005  # Share of the radius by which a curve may miss the point,
SIGNIFICANT = 5.0  # and standard deviations of it.
LEAST_SCATTER = 0.3  # Share of a contact's noise: few contacts may happen to scatter less.
CONTRADICTED = 0.01  # Radians by which normals may contradict the contacts, beside SIGNIFICANT deviations.
DOUBTFUL_FIT = 0.01  # Share of the radius by which half of the contacts may be missed, beside the noise.
CONTRADICTING = 3.0  # A surface that is off by more than so many deviations on average contradicts the patch.
DOUBTFUL_GAP = 0.1  # Share of the taps between the curves that feel no surface.


class Taps(NamedTuple):
    """What a finger that tapped between the curves found, so many times.

    missed : taps that met no surface within the radius
    off : how far the surface is off the patch at most, in units of L, where taps contradict it; or 0
    """

    number: int
    missed: int = 0
    off: float = 0.0


class _Judged(Protocol):
    """What a status follows from; see Reconstruction."""

    @property
    def method(self) -> str:
        """The method of the fit."""

    @property
    def converged(self) -> bool:
        """Whether the solver of the fit converged."""

    @property
    def radius(self) -> float:
        """The radius L."""

    @property
    def noise(self) -> float:
        """The least standard deviation of a contact, in units of L."""

    @property
    def misses(self) -> Array:
        """The distances at which the curves pass the point, and their deviations, (c, 2)."""

    @property
    def residual(self) -> Residual | None:
        """What the surface is beside its polynomial, if anything."""

    @property
    def posterior(self) -> Posterior:
        """What the contacts leave open."""

    @property
    def condition_number(self) -> float:
        """The condition number of the least-squares system."""

    @property
    def mean_height_std(self) -> float:
        """The mean deviation of the height over the domain."""

    @property
    def typical_miss(self) -> float:
        """The median of |dz| over the contacts."""

    @property
    def patch(self) -> MongePatch:
        """Equation (1), of the degree asked for."""

    @property
    def blind(self) -> int:
        """Directions among its coefficients that the contacts do not show."""

    @property
    def contradiction(self) -> tuple[float, float]:
        """The deviations, and the angle, by which normals contradict contacts."""

    @property
    def taps(self) -> Taps | None:
        """What was felt between the curves, if a finger tapped there."""


def doubt(r: _Judged) -> tuple[str, str] | None:
    """Status and a sentence of advice; None where there is no doubt."""
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
    return _about_data(r) or _about_heights(r) or _about_frame(r)


def contradicted(taps: Taps | None) -> tuple[str, str] | None:
    """Status and a sentence of advice where taps contradict a fit; None where they do not."""
    if taps is None:
        return None
    if taps.off:
        return "uncertain", (
            f"Between the curves the surface is up to {100.0 * taps.off:.2g} % of the radius off the "
            "patch, perhaps at an edge or a pocket that no curve crosses: use a shorter extent or add "
            "sampling planes."
        )
    if taps.missed > DOUBTFUL_GAP * taps.number:
        return "uncertain", (
            "Between the curves the surface ends, or has a hole that no curve crosses: use a shorter "
            "extent or add sampling planes."
        )
    return None


def notes(r: _Judged) -> str:
    """What else is to be said, whatever the status: sentences, each after a space."""
    message = ""
    if r.taps is not None and r.taps.missed:
        message += f" {r.taps.missed} of {r.taps.number} taps between the curves feel no surface."
    if r.posterior.is_round:
        message += " The curvatures are alike, so there are no principal directions."
    if r.blind:
        verb, terms = "is" if r.blind == 1 else "are", terms_to(r.patch.degree)
        message += f" {r.blind} of {terms} coefficients {verb} invisible to these planes."
    return message


def _about_data(r: _Judged) -> tuple[str, str] | None:
    deviations, angle = r.contradiction
    if deviations > SIGNIFICANT and angle > CONTRADICTED:
        return "uncertain", (
            f"The measured normals contradict the contacts by {math.degrees(angle):.1f} degrees on "
            "average, more than their deviation explains: check the frame they were measured in, or "
            "leave them out."
        )
    missed = r.typical_miss / r.radius
    if missed > DOUBTFUL_FIT + r.noise:
        return "uncertain", (
            f"Half of the contacts are off the patch by more than {100.0 * missed:.1f} % of the radius, "
            "which their noise does not explain: use a shorter extent or give their noise."
        )
    return None


def _about_heights(r: _Judged) -> tuple[str, str] | None:
    share = r.mean_height_std / r.radius
    if share > DOUBTFUL_STD:
        return "uncertain", (
            f"Heights are accurate to {100.0 * share:.1f} % of the radius on average: use a shorter "
            "extent or add sampling planes."
        )
    return None


def _about_frame(r: _Judged) -> tuple[str, str] | None:
    distances, stds = r.misses.T / r.radius
    stds = np.maximum(stds, LEAST_SCATTER * r.noise)
    apart = np.flatnonzero(distances > np.maximum(DOUBTFUL_MISS, SIGNIFICANT * stds))
    if len(apart):
        return "uncertain", (
            f"Curve {apart[0] + 1} passes the reference point at {r.radius * distances[apart[0]]:.3g}"
            ", more than its scatter explains: set the point where the curves meet."
        )
    turn = r.posterior.turn() if r.residual is None else r.posterior.turn(LIKELY)
    if turn > DOUBTFUL_TURN and not r.posterior.is_round:
        return "uncertain", (
            f"The principal directions may be {math.degrees(turn):.0f} degrees off: use a longer "
            "extent or add sampling planes."
        )
    std = r.posterior.curvature_std()
    if std > DOUBTFUL_CURVATURE:
        return "uncertain", (
            f"Curvatures are accurate to only {std / r.radius:.2g} in the least known direction: "
            "use a longer extent or add sampling planes."
        )
    return None
