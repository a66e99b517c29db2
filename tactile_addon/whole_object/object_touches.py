# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touches that grow over an object, step by step, with nothing changed in the scene."""

from contextlib import suppress

import numpy as np

from ... import core
from ..touch.detached_mesh import DetachedMesh
from ..touch.touch_object import AWAY, nearest_point
from ..touch.units import length
from ..touch.wording import many
from .whole_surface import WholeSurface

TOLERANCE_SHARE = 1.0 / 500.0  # of the object's size, where no tolerance is given
LARGEST_TOLERANCE, LARGEST_EDGE = 0.1, 0.5  # of the size: beyond, no patch and no triangle fits
SHORTEST_EDGE = 1e-3  # of the size: some millions of triangles
STARTS = 20  # places that are tried where no place to begin is given
TARGET_WITHIN = 0.05  # of the object's size, that the target is looked for along the normal
COMPARED_AT_ONCE = 2000  # vertices whose deviation from the target is measured in a step


class ObjectTouches:
    """Touches of an evaluated mesh that begin at one place; all is in the directions of the world.

    surface : the mesh as it was, from its object's origin
    found : core.Reconstructions of the touches so far
    done, uncovered : how many touches that took, some of which gave no patch; places known to be uncovered
    words, share : what is going on, and the share of it that is done, None where nobody knows
    whole : the WholeSurface, once the steps are done
    """

    def __init__(self, obj, depsgraph, *, location, tolerance, noise, seed, most, edge):
        """`location` is None, and lengths 0, for a choice by the object.

        Raises ValueError, with a sentence, for what cannot be touched.
        """
        import scipy.interpolate  # half a second with all that it brings: not between two redraws
        import scipy.ndimage  # noqa: F401

        for name, value in (("tolerance", tolerance), ("noise", noise), ("edge", edge)):
            if not value >= 0.0:  # NaN is none
                raise ValueError(f"The {name} is a length of 0 or more, got {length(value)}")
        self.surface = DetachedMesh(obj, depsgraph)
        self.tolerance = tolerance or max(TOLERANCE_SHARE * self.surface.size, noise)
        self._require_lengths(noise, edge)
        self.noise, self.seed, self.most, self.edge = noise, seed, most, edge
        self.found, self.done, self.uncovered = [], 0, 0
        self.words, self.share = "Looking for a place to begin", None
        self.is_stopped = False
        self._start = None
        if location is not None:
            at = np.subtract(location, self.surface.origin)
            self._start = nearest_point(obj.name, self.surface, at, AWAY * self.surface.size)

    def _require_lengths(self, noise, edge):
        """Raises ValueError, with a sentence, for lengths that nothing on this object can have."""
        name, size, tolerance = self.surface.name, self.surface.size, self.tolerance
        if tolerance < noise:
            raise ValueError(
                f"The tolerance {length(tolerance)} is below the noise {length(noise)}: use a larger one"
            )
        for what, value, most in (
            ("noise", noise, LARGEST_TOLERANCE),
            ("tolerance", tolerance, LARGEST_TOLERANCE),
            ("edge length", edge, LARGEST_EDGE),
        ):
            if value > most * size:
                raise ValueError(
                    f'The {what} {length(value)} is larger than {length(most * size)}, {most:g} of "{name}": '
                    "use a smaller one"
                )
        if tolerance < self.surface.spacing:
            raise ValueError(
                f'The tolerance {length(tolerance)} is finer than the coordinates of "{name}", which are '
                f"{length(self.surface.spacing)} apart in single precision: use a larger one"
            )
        if 0.0 < edge < SHORTEST_EDGE * size:
            raise ValueError(
                f"The edge length {length(edge)} is smaller than {length(SHORTEST_EDGE * size)}, "
                f'{SHORTEST_EDGE:g} of "{name}": use a larger one'
            )

    def steps(self):
        """Does all of it; a generator, which yields each few hundredths of a second."""
        steps, state = self._started()
        while True:
            self._note(state)
            yield
            try:
                state = steps.send(False if self.is_stopped else None)
            except StopIteration as end:
                self.whole = WholeSurface(end.value, self.surface.origin)
                break
        yield from self._shown()

    def _started(self):
        """The steps of core and what the first of them said; raises ValueError where none can begin."""
        why = "no face has an area"
        for point, outward in self._places():
            steps = core.touch_all_over(
                self.surface,
                point,
                outward,
                tolerance=self.tolerance,
                noise=self.noise,
                most=self.most,
                rng=self.seed,
            )
            try:
                return steps, next(steps)
            except ValueError as error:
                why = error
        raise ValueError(f"Touching could not begin: choose another location or tolerance ({why})")

    def _places(self):
        """Where the touches may begin, and the normal there."""
        if self._start is not None:
            yield self._start
            return
        faces = np.random.default_rng(self.seed).permutation(self.surface.faces)[:STARTS]
        for middle in self.surface.points[faces].mean(axis=1):  # beside all creases between faces
            with suppress(ValueError):  # a face of no area
                yield self.surface.project(middle)[:2]

    def _note(self, state):
        self.found += [exploration.result for exploration in state.found]
        self.done, self.uncovered = state.done, state.uncovered
        touches, places = many(state.done, "touch", "touches"), many(state.uncovered, "place", "places")
        self.words, self.share = f"{touches}, {places} to go on from", None
        if state.joining is not None:
            self.words = f"Joining {many(len(self.found), 'patch', 'patches')}"
            self.share = 0.5 * state.joining

    def _shown(self):
        self.words, self.is_stopped = "Meshing", True
        for share in self.whole.steps(self.edge):
            self.share = 0.5 + 0.4 * share
            yield
        mesh, deviation = self.whole.mesh, self.whole.deviation
        normals = mesh.normals
        yield
        for start in range(0, len(deviation), COMPARED_AT_ONCE):
            some = slice(start, start + COMPARED_AT_ONCE)
            deviation[some] = self.surface.deviations(
                mesh.vertices[some], normals[some], TARGET_WITHIN * self.surface.size
            )
            self.share = 0.9 + 0.1 * start / len(deviation)
            yield

    def stop(self):
        """Has the steps touch no more, and join what there is."""
        self.is_stopped = True

    def report(self):
        """What there is to say, a dict of plain values."""
        off = np.abs(self.whole.deviation)
        return {
            "touches": self.done,
            "uncovered": len(self.whole.atlas.uncovered),
            **self.whole.report(),
            "deviation_mean": float(off.mean()),
            "deviation_max": float(off.max()),
            "size": self.surface.size,
            "tolerance": self.tolerance,
            "noise": self.noise,
            "seed": self.seed,
            "most": self.most,
        }
