# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The verdict on a touch or a whole object: what is in doubt, by how much, and what helps.

`REASONS` has every reason by its code, with its sentence and its advice. tools/messages.py makes the table of
docs/messages.md of them.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

# What is off by more standard deviations is looked at more closely. With SIGNIFICANT in its place, 4 of 24
# curves that are turned or shifted are missed, and .7 % of curvatures of exact surfaces are far off
# (benchmarks.curvatures).
NOTICED = 3.0
SIGNIFICANT = 5.0  # Noise does not explain what is off by more standard deviations (benchmarks.stability).
OK, UNCERTAIN, NOT_CONVERGED = "ok", "uncertain", "not_converged"  # Each status.

SHORTER, LONGER, PLANES = "use a shorter extent", "use a longer extent", "add sampling planes"
CONTRARY = {SHORTER: LONGER, LONGER: SHORTER}
FROM_EDGE = "move the point away from the edge"
FINER_FACETS = "make the facets finer"
SUBDIVIDE = "add a Subdivision modifier if the shape is smooth"
FINER, COARSER = "use a smaller tolerance", "use a larger tolerance"
SHORTER_EDGES, TOUCHES = "use a shorter edge length", "allow more touches"


class Reason(NamedTuple):
    """Why a result may be in doubt.

    sentence : without its advice; see Doubt.sentence for what stands in braces
    advice : what may help, the best first
    """

    sentence: str
    advice: tuple[str, ...]


REASONS = {
    # A touch, the gravest first.
    "at_edge": Reason("The point is {0}, so half curves end there at once", (FROM_EDGE, FINER_FACETS)),
    "facets": Reason(
        "The facets here make ± {percent:.0f} % of the curvature, which is that of the facets, not of the "
        "shape",
        (SUBDIVIDE,),
    ),
    "taps": Reason(
        "Between the curves the surface is up to {percent:.2g} % of the radius off the patch, perhaps at an "
        "edge or a pocket that no curve crosses",
        (SHORTER, PLANES),
    ),
    "near_edge": Reason(
        "The point is so near an edge that taps beside it feel no surface",
        (FROM_EDGE,),
    ),
    "gap": Reason(
        "At {percent:.0f} % of the patch there is no surface, which ends or has a hole between the curves",
        (SHORTER, PLANES),
    ),
    "steps": Reason(
        "The minimization stopped at its step limit, and the patch is the best so far",
        ("use the fast solver or a smaller weight",),
    ),
    "condition": Reason(
        "The contacts alone do not determine the surface between the curves (condition number {value:.1e})",
        ("use another method", PLANES),
    ),
    "kink": Reason(
        "Curve {0} bends so sharply at the point that its fit is {percent:.2g} % of the radius off there",
        ("move the point away from edges", FINER_FACETS),
    ),
    "point": Reason(
        "Curve {0} passes the reference point at {value:.3g}, more than its scatter explains",
        ("set the point where the curves meet",),
    ),
    "normals": Reason(
        "The measured normals contradict the contacts by {degrees:.1f} degrees on average, more than their "
        "deviation explains",
        ("check the frame they were measured in", "leave them out"),
    ),
    "scattered_normals": Reason(
        "The measured normals are off the curves by {degrees:.0f} degrees, and their deviation explains "
        "{degrees_limit:.0f}",
        ("check which contact each belongs to", "give their deviation", "leave them out"),
    ),
    "contacts": Reason(
        "Half of the contacts are off the patch by more than {percent:.1f} % of the radius, which their "
        "noise does not explain",
        (SHORTER, "give their noise"),
    ),
    "heights": Reason(
        "Heights are accurate to {percent:.1f} % of the radius on average",
        (SUBDIVIDE, SHORTER, PLANES),
    ),
    "directions": Reason(
        "The principal directions may be {degrees:.0f} degrees off",
        (SUBDIVIDE, SHORTER, LONGER, FROM_EDGE, PLANES),
    ),
    "curvatures": Reason(
        "Curvatures are accurate to only {percent:.2g} % of 1 / radius in the least known direction",
        (SUBDIVIDE, SHORTER, LONGER, FROM_EDGE, PLANES),
    ),
    "curve": Reason(
        "A curve is {percent:.2g} % of the radius off what the others show, whose deviations explain "
        "{percent_limit:.2g} %, as if it were flipped or its plane were another",
        ("check each curve",),
    ),
    "waves": Reason(
        "Waves of {percent:.1f} % of the radius run along the curves, which do not show where they go on "
        "between them",
        (SUBDIVIDE, SHORTER, PLANES),
    ),
    "flat_face": Reason(
        "The point is on a flat face, and the curvature is that of the bends next to it",
        (SHORTER, "move the point away from them"),
    ),
    "folds": Reason(
        "The surface turns at three places or fewer along a curve, as at folds or facets, and the curvature "
        "is that of these",
        (SHORTER, "move the point away from folds", FINER_FACETS),
    ),
    "bend": Reason(
        "The contacts near the point bend otherwise than the patch, as beside a tip or a fold within it",
        (SHORTER, "move the point away from it"),
    ),
    # Measured contacts all around an object, and its surface.
    "opposed": Reason(
        "Normals contradict each other around {0}: strokes are too far apart there, or normals are wrong",
        ("make strokes nearer to each other there", "leave the normals out"),
    ),
    "ball": Reason(
        "Centers around {0} bend more than a ball of this radius can",
        ("give the radius of the ball", "use a smaller one"),
    ),
    "noise": Reason(
        "Contacts scatter by {value:.2g} about the smallest patches, and no noise was given",
        ("give it", "check whether files or strokes are off each other", "make strokes nearer to each other"),
    ),
    "cavity": Reason(
        "Normals point inward all around, so the contacts surround a cavity",
        ("turn the normals if they are those of a solid",),
    ),
    "off_surface": Reason(
        "{0} are off the surface or face the other way, by up to {value:.2g}, most together around {1}",
        ("feel more there", "give their noise", "leave out wrong ones"),
    ),
    "confused": Reason(
        "{0} are off the surface or face the other way, by up to {value:.2g}, most together around {1}, "
        "where strokes are farther apart than half of the wall or gap",
        ("make strokes nearer to each other", "measure normals"),
    ),
    "sparse": Reason(
        "Contacts around {0} are so far apart that the surface between them may be off by {value:.2g}",
        ("feel more there",),
    ),
    "unfelt": Reason("Nothing was felt beyond {0} where the object may go on", ("touch there",)),
    # A whole object that was touched.
    "stopped": Reason(
        "Touching ended when {0} of the object was felt, and the rest is up to {1} away",
        ("continue with more touches",),
    ),
    "out_of_reach": Reason(
        "{0} of the object was felt, and touches found no patch beyond, up to {1} away",
        ("continue with a smaller tolerance",),
    ),
    "cut_short": Reason("The patches end at {0} where the object goes on", (TOUCHES, COARSER)),
    "goes_on": Reason(
        "The patches end at {0} where the object goes on, and touches found no patch there", (FINER,)
    ),
    "thin": Reason(
        "Walls or gaps of {percent:.2g} % of the size were felt, and what is thinner than "
        "{percent_limit:.2g} % may be bridged or pierced",
        ("touch such parts as objects of their own",),
    ),
    "rough": Reason(
        "The standard deviation is above the tolerance on {percent:.0f} % of the surface",
        ("touch there again", COARSER),
    ),
    "rays": Reason(
        "{value:.0f} of {0} rays from outside met something else than the surface", (TOUCHES, FINER)
    ),
    "holes": Reason("Triangles of this edge length leave holes", (SHORTER_EDGES,)),
    "open_edges": Reason(
        "The surface is up to {0} off the object beside an open edge of its mesh, as around a hole",
        ("close the hole", FINER),
    ),
    "narrow": Reason(
        "The surface is up to {0} off the object where a wall or gap is {1} wide",
        ("touch such parts as objects of their own", "fill the gap"),
    ),
    "hidden": Reason(
        "The surface is up to {0} off the object where its own parts nearly hide it",
        ("delete what is inside", "touch that part as an object of its own"),
    ),
    "single_facets": Reason(
        "The surface is up to {0} off the object where touches follow single facets",
        ("add a Subdivision modifier", FINER),
    ),
    "off_mesh": Reason(
        "The surface is up to {0} off the object, which the tolerance does not explain",
        (SHORTER_EDGES, FINER),
    ),
    "share": Reason("Only {0} of surface and object agree to the tolerance", (SHORTER_EDGES, FINER)),
    "mean_height": Reason(
        "Heights are accurate to {0} on average, and the tolerance is {1}",
        (COARSER,),
    ),
}


@dataclass(frozen=True)
class Doubt:
    """A reason to doubt a result.

    code : of REASONS
    value, limit : the value in doubt, and the one up to which there is no doubt: shares, angles in radians,
        numbers, or lengths in the caller's unit
    words : what else its sentence has: a place, a count, a length in its unit
    useless : advice of its reason that does not apply, as what the touch has tried already
    """

    code: str
    value: float = 1.0
    limit: float = 0.0
    words: tuple[str, ...] = ()
    useless: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """What is in doubt and by how much, without a full stop."""
        return REASONS[self.code].sentence.format(
            *self.words,
            value=self.value,
            percent=100.0 * self.value,
            percent_limit=100.0 * self.limit,
            degrees=math.degrees(self.value),
            degrees_limit=math.degrees(self.limit),
        )

    @property
    def helpful(self) -> list[str]:
        """What helps, the best first."""
        return [one for one in REASONS[self.code].advice if one not in self.useless]

    @property
    def advice(self) -> str:
        """What helps, as words that follow a colon."""
        return joined(self.helpful)

    def __str__(self) -> str:
        return f"{self.sentence}: {self.advice}."

    def to_dict(self) -> dict[str, Any]:
        """The doubt as JSON has it, with its sentence and its advice."""
        return {
            "code": self.code,
            "value": float(self.value),
            "limit": float(self.limit),
            "sentence": self.sentence,
            "advice": self.advice,
        }


def beyond(code: str, value: float, limit: float, useless: tuple[str, ...] = ()) -> Iterator[Doubt]:
    """The doubt of this code, if the value is beyond the limit."""
    if value > limit:
        yield Doubt(code, value, limit, useless=useless)


def joined(advice: Sequence[str]) -> str:
    """Advice in a row, such as "add sampling planes or use a shorter extent"."""
    *first, last = advice
    if len(first) < 2:
        return " or ".join(advice)
    return f"{', '.join(first)}, or {last}"


def status_of(gravest: Doubt | None) -> str:
    """The status of a result with this gravest doubt, or none."""
    if gravest is None:
        return OK
    return NOT_CONVERGED if gravest.code == "steps" else UNCERTAIN


class Judged(ABC):
    """A result that may be in doubt."""

    @abstractmethod
    def _doubting(self) -> Iterator[Doubt]:
        """Reasons to doubt it, the gravest first."""

    @cached_property
    def doubts(self) -> tuple[Doubt, ...]:
        """All reasons to doubt it, the gravest first; none advises the opposite of a graver one."""
        found: list[Doubt] = []
        for doubt in self._doubting():
            opposed = [CONTRARY[one] for graver in found for one in graver.helpful if one in CONTRARY]
            found.append(replace(doubt, useless=(*doubt.useless, *opposed)))
        return tuple(found)

    @cached_property
    def gravest(self) -> Doubt | None:
        """The gravest doubt, or None; the others are not computed, which would take longer."""
        return next(self._doubting(), None)

    @property
    def status(self) -> str:
        """ "ok", "uncertain" or "not_converged"."""
        return status_of(self.gravest)
