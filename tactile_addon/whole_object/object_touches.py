# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touches that grow over an object, step by step, with nothing changed in the scene."""

from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import suppress
from copy import copy
from typing import Any

import bpy
import numpy as np

from ... import core
from ...core.arguments import many
from ..touch.detached_mesh import DetachedMesh
from ..touch.touch_object import AWAY, nearest_point
from ..touch.touch_report import verdict_report
from ..touch.types import Array, Object
from ..touch.units import length, say_of
from .both_ways import BothWays, narrowest, why_far
from .object_report import OFF_TOLERANCES, WITHIN_SHARE, within
from .whole_surface import WholeSurface

# These lengths are shares of the object's size.
TOLERANCE_SHARES = {"quick": 1.0 / 200.0, "normal": 1.0 / 500.0, "fine": 1.0 / 1250.0}
LARGEST_TOLERANCE, LARGEST_EDGE = 0.1, 0.5  # With more, neither patches nor triangles would fit.
STARTS = 20  # The number of places to begin that are tried, besides the one that is given.
ROOM = 0.05  # Places with this share of the size of room are tried first.
PLACES, SEED = 1000, 0  # The progress is the share of this many places on the mesh that patches cover.
TOUCHED, JOINED = 0.5, 0.8  # Of all that is to be done, touching and joining are done at these shares.


class ObjectTouches:
    """Touches of an evaluated mesh that begin at one place, in the directions of the world.

    surface : the mesh as it was, relative to its object's origin
    explored : core.Explorations of the touches so far
    rims : how far the finger feels each of their patches all round, (AZIMUTHS,), lengths
    done : the number of touches so far, including those that gave no patch
    words, share : what is going on, and the share of all that is done
    is_stopped : if it is set, the steps touch no more, and join the patches so far
    whole, compared : the WholeSurface, and its BothWays from the mesh, once the steps are done
    """

    def __init__(
        self,
        obj: Object,
        depsgraph: bpy.types.Depsgraph,
        *,
        location: Sequence[float] | None,
        tolerance: float,
        accuracy: str,
        noise: float,
        seed: Any,
        most: int,
        edge: float,
    ) -> None:
        """The object chooses the `location` if it is None, and lengths if they are 0.

        accuracy : one of TOLERANCE_SHARES, for a tolerance of 0

        Raises ValueError, with a sentence, for an object that cannot be touched and for bad settings.
        """
        import scipy.interpolate  # The import takes half a second, too long between redraws.
        import scipy.ndimage  # noqa: F401

        self.surface = DetachedMesh(obj, depsgraph)
        self.tolerance = tolerance or tolerance_of(self.surface.size, accuracy, noise)
        self._require_lengths(noise, edge)
        self.noise, self.seed, self.most, self.edge = noise, seed, most, edge
        self.done = 0
        self._begin(())
        self._start = None
        if location is not None:
            at = np.subtract(location, self.surface.origin)
            self._start = nearest_point(self.surface, at, AWAY * self.surface.size)

    def _begin(self, earlier: Sequence[core.Exploration]) -> None:
        """Prepares the `steps` of touches that go on from earlier ones."""
        self._earlier, self._in_vain = earlier, self.done - len(earlier) if earlier else 0
        self.explored: list[core.Exploration] = []
        self.rims: list[Array] = []
        self.done = 0
        self.words, self.share = "Looking for a place to begin", 0.0
        self.is_stopped = False
        # How often it has begun to join or to touch again, and the number of touches before.
        self._phases, self._before, self._is_joining = 0, 0, False
        self._area = self._faceted = 0.0

    def _require_lengths(self, noise: float, edge: float) -> None:
        """Raises ValueError, with a sentence, for lengths that are too large or too small for this object."""
        name, size, tolerance = self.surface.name, self.surface.size, self.tolerance
        for what, value, most in (
            ("noise", noise, LARGEST_TOLERANCE),
            ("tolerance", tolerance, LARGEST_TOLERANCE),
            ("edge length", edge, LARGEST_EDGE),
        ):
            if not value >= 0.0:  # NaN fails every comparison, so it is refused, too.
                raise ValueError(f"The {what} is a length of 0 or more, got {length(value)}")
            if value > most * size:
                raise ValueError(
                    f'The {what} {length(value)} is larger than {length(most * size)}, {most:g} of "{name}": '
                    "use a smaller one"
                )
        if tolerance < noise:
            raise ValueError(
                f"The tolerance {length(tolerance)} is below the noise {length(noise)}: use a larger one"
            )
        if tolerance < self.surface.spacing:
            raise ValueError(
                f'The tolerance {length(tolerance)} is finer than the coordinates of "{name}", which are '
                f"{length(self.surface.spacing)} apart in single precision: use a larger one"
            )
        least = core.shortest_edge(self.surface.points, self.surface.triangles)
        if 0.0 < edge < least:
            raise ValueError(
                f"The edge length {length(edge)} is smaller than {length(least)}, for which the surface of "
                f'"{name}" takes 2 GB of memory: use a larger one'
            )

    def steps(self) -> Iterator[None]:
        """Does everything, as a generator that yields every few hundredths of a second."""
        steps, state = self._started()
        rng = np.random.default_rng(SEED)
        self._left = core.scattered(self.surface.points, self.surface.triangles, PLACES, rng)[0]
        while True:
            self._note(state)
            yield
            try:
                state = steps.send(False if self.is_stopped else None)
            except StopIteration as end:
                self.whole = WholeSurface(end.value, self.surface.origin)
                break
        yield from self.meshing(JOINED)

    def _started(self) -> tuple[Generator[core.Progress, object, core.Atlas], core.Progress]:
        """The steps of core, and the Progress of the first. Raises ValueError if touches cannot begin."""
        why: Exception | str = "no face has an area"
        for point, outward in self._places():
            steps = core.touch_all_over(
                self.surface,
                point,
                outward,
                tolerance=self.tolerance,
                noise=self.noise,
                most=self.most - self._in_vain,
                rng=self.seed,
                earlier=self._earlier,
            )
            try:
                return steps, next(steps)
            except ValueError as error:
                why = error
        raise ValueError(f"Touching could not begin: choose another location or tolerance ({why})")

    def _places(self) -> list[tuple[Any, Any]]:
        """Places where the touches may begin, with their normals, those in slits and on ridges last."""
        found = [] if self._start is None else [self._start]
        faces = np.random.default_rng(self.seed).permutation(self.surface.faces)[:STARTS]
        for middle in self.surface.points[faces].mean(axis=1):  # It is off all edges.
            with suppress(ValueError):  # The face has no area.
                found.append(self.surface.project(middle)[:2])
        most = ROOM * self.surface.size
        return sorted(found, key=lambda place: -min(narrowest(self.surface, *map(np.array, place)), most))

    def _note(self, state: core.Progress) -> None:
        for exploration, rim in zip(state.found, state.rims, strict=True):
            r = exploration.result
            self.explored.append(exploration)
            self.rims.append(rim)
            self._area += r.domain.area
            self._faceted += r.domain.area * self.surface.is_of_facets(r)
            self._left = self._left[~core.covered_by(r, rim, self._left, self.tolerance)]
        self.done = self._in_vain + state.done
        touches, places = many(self.done, "touch", "touches"), many(state.uncovered, "place", "places")
        patches = many(len(self.explored), "patch", "patches")
        is_joining = state.joining is not None
        if is_joining is not self._is_joining:
            self._phases, self._before, self._is_joining = self._phases + 1, state.done, is_joining
        if state.joining == 1.0:
            self.words = f"Checking the surface of {patches}"
        elif is_joining or self.is_stopped:  # The last touches may still end when it is stopped.
            self.words = f"Joining {patches}"
        else:
            self.words = f"{touches}, {places} left" if state.uncovered else touches
        self.share = max(self.share, self._share(state))

    def _share(self, state: core.Progress) -> float:
        """About which share of all is done in a state of the touches."""
        felt = 1.0 - len(self._left) / PLACES
        if not self._phases:
            return TOUCHED * felt
        # How often it touches and joins again is not known before. Each phase has half of what is left.
        done = 1.0 - self._before / state.done if state.joining is None else state.joining
        return felt * (TOUCHED + (JOINED - TOUCHED) * (1.0 - (2.0 - done) * 0.5**self._phases))

    def meshing(self, start: float = 0.0) -> Iterator[None]:
        """Makes the mesh and compares it in steps, from the share `start` of all on."""
        self.words, self.is_stopped = "Meshing", True
        for share in self.whole.steps(self.edge):
            self.share = start + (1.0 - start) * 0.6 * share
            yield
        self.words = "Comparing"
        self.compared = BothWays(self.surface, self.whole.mesh, self.tolerance)
        for share in self.compared.steps():
            self.share = start + (1.0 - start) * (0.6 + 0.4 * share)
            yield
        self.whole.deviation = self.compared.deviation

    def again(self, edge: float) -> "ObjectTouches":
        """These touches, whose `meshing` makes the surface with edges of another length, or 0.

        Raises ValueError, with a sentence, for a length that does not suit the object.
        """
        self._require_lengths(self.noise, edge)
        again = copy(self)
        again.edge, again.share, again.whole = edge, 0.0, WholeSurface(self.whole.atlas, self.surface.origin)
        return again

    def continued(self, tolerance: float, more: int) -> "ObjectTouches":
        """These touches, whose `steps` go on from where they ended, to a tolerance and by `more` at most.

        Raises ValueError, with a sentence, for a tolerance that does not suit the object.
        """
        again = copy(self)
        again.tolerance, again.most = tolerance, self.done + more
        again._require_lengths(self.noise, self.edge)
        again._begin(self.explored)
        return again

    def report(self) -> dict[str, Any]:
        """What was found, as a dict of plain values."""
        found = {
            "touches": self.done,
            "uncovered": len(self.whole.atlas.uncovered),
            "felt": self.compared.felt,
            **self.whole.report(),
            "faceted": self._faceted / self._area,
            "within": self.compared.within,
            "deviation_mean": self.compared.mean,
            "deviation_max": self.compared.largest,
            "deviation_place": (self.surface.origin + self.compared.place).tolist(),
            "origin": self.surface.origin.tolist(),
            "size": self.surface.size,
            "tolerance": self.tolerance,
            "noise": self.noise,
            "seed": self.seed,
            "most": self.most,
        }
        return found | verdict_report(self._doubts(found), found["message"])

    def _doubts(self, found: Mapping[str, Any]) -> list[core.Doubt]:
        """The doubts of its atlas, and what the mesh adds to these, the gravest first."""
        doubts = self.whole.doubts()
        off, farthest = self.compared.largest, OFF_TOLERANCES * self.tolerance
        if count := found["uncovered"]:
            words = within(found["felt"], False), say_of(found, off)
            code = "stopped" if self.whole.atlas.is_cut_short else "out_of_reach"
            others = (doubt for doubt in doubts if doubt.code not in ("cut_short", "goes_on"))
            return [core.Doubt(code, count, words=words), *others]
        useless = (core.FINER,) if self.edge else (core.SHORTER_EDGES,)
        if off > farthest:
            if not (self.edge and not doubts) and (why := self._why_far(found)):
                return [why, *doubts]
            return [*doubts, core.Doubt("off_mesh", off, farthest, (say_of(found, off),), useless)]
        if self.compared.within < WITHIN_SHARE:
            share = (within(self.compared.within, False),)
            doubts.append(core.Doubt("share", self.compared.within, WITHIN_SHARE, share, useless))
        if found["height_std"] > self.tolerance:
            lengths = say_of(found, found["height_std"]), say_of(found, self.tolerance)
            doubts.append(core.Doubt("mean_height", found["height_std"], self.tolerance, lengths))
        return doubts

    def _why_far(self, found: Mapping[str, Any]) -> core.Doubt | None:
        """The doubt about the place where surface and mesh are farthest apart, as `why_far` has it."""
        place, mesh = self.compared.place, self.whole.mesh
        nearest = int(mesh.patch[np.argmin(((mesh.vertices - place) ** 2).sum(axis=1))])
        patch = self.explored[nearest].result if nearest >= 0 else None
        return why_far(self.surface, place, self.compared.largest, patch, found)


def tolerance_of(size: float, accuracy: str, noise: float) -> float:
    """The tolerance for an object of this size; it is not below the noise."""
    return max(TOLERANCE_SHARES[accuracy] * size, noise)
