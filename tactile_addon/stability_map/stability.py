# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touches all over an object, step by step, with nothing changed in the scene: what a stability map shows."""

from collections import Counter
from statistics import median

import numpy as np

from ... import core
from ..touch.detached_mesh import DetachedMesh
from ..touch.evaluated_mesh import evaluated_object, size_of
from ..touch.touch_object import LEAST_STEPS, require_fine, require_lengths
from ..touch.units import length

EXTENT_SHARE = 1.0 / 8.0  # Share of the object's size, where no extent is given.
SPACING_SHARE = 1.0 / 4.0  # Share of the extent, where no spacing is given.
BATCH = 20  # touches that are fitted at once: in a hundredth of a second
NEAREST_AT_ONCE = 10_000  # vertices that are given their nearest touch at once
NOTHING = -1.0  # where there is no patch, in the place of each quantity
# What the attribute `reason` counts: key, name, and the stop of a curve that it follows from.
REASONS = [
    ("patch", "Patch", None),
    ("doubt", "In Doubt", None),
    ("crease", "Crease", core.CREASE),
    ("edge", "Edge", core.NO_CONTACT),
    ("steep", "Too Steep", core.NOT_MONGE),
    ("nothing", "No Area", None),
]
REASON_KEYS = [key for key, _, _ in REASONS]
STOP_CODES = {stop: code for code, (_, _, stop) in enumerate(REASONS) if stop}
MEASURES = ("error", "height_std", "condition_number", "blind_share")


def expected_count(obj, depsgraph, extent, spacing):
    """How many points of an object are touched, about; inputs are 0 as in StabilityMap.

    Raises ValueError, with a sentence, for what cannot be touched.
    """
    evaluated, linear, _ = evaluated_object(obj, depsgraph)
    extent = extent or EXTENT_SHARE * size_of(evaluated, linear)
    areas = np.empty(len(evaluated.data.polygons), dtype=np.float32)
    evaluated.data.polygons.foreach_get("area", areas)
    area = float(areas.sum()) * abs(np.linalg.det(linear)) ** (2.0 / 3.0)
    return min(len(evaluated.data.vertices), core.spaced_count(area, spacing or SPACING_SHARE * extent))


class StabilityMap:
    """Touches of an evaluated mesh at vertices thinned to an even spacing.

    chosen : indices of the vertices to touch, in random order; done : how many have been touched
    error, height_std, condition_number, blind_share, reason : (n,), of the touches
    nearest : (vertices,), the touch that is nearest to each, once the steps are done
    """

    def __init__(self, obj, depsgraph, planes, *, spacing, extent, step, noise, seed, **fit):
        """`spacing`, `extent` and `step` are 0 for a choice by the object's size; `fit` as in touch().

        Raises ValueError, with a sentence, for what cannot be touched, and for inputs no touch can do with.
        """
        import scipy.spatial  # noqa: F401  # takes half a second once: not between two redraws

        self.surface = DetachedMesh(obj, depsgraph)
        if not spacing >= 0.0:  # NaN is none
            raise ValueError(f"The spacing is a length of 0 or more, got {length(spacing)}")
        self.extent = extent or EXTENT_SHARE * self.surface.size
        self.step = step or self.extent / LEAST_STEPS
        require_lengths(obj.name, self.surface.size, self.extent, self.step, noise)
        self.spacing = spacing or SPACING_SHARE * self.extent
        require_fine(self.surface.spacing, self.step)
        self.planes, self.noise, self.seed, self.fit = planes, noise, seed, fit
        self._rng = np.random.default_rng(seed)
        _rehearse(planes, self.extent, self.step, fit)
        self.chosen, self.done = [], 0

    def steps(self):
        """Does all of it; a generator, which yields each few hundredths of a second."""
        surface = self.surface
        candidates = np.flatnonzero(surface.has_face)
        for index in core.spaced(surface.points[candidates], self.spacing, self._rng):
            if index is not None:
                self.chosen.append(int(candidates[index]))
            yield
        count = len(self.chosen)
        for name in MEASURES:
            setattr(self, name, np.full(count, NOTHING))
        self.reason = np.full(count, REASON_KEYS.index("nothing"), dtype=np.int32)
        size = BATCH if self.fit["method"] == "bayes" else 1
        for start in range(0, count, size):
            end = min(start + size, count)
            yield from self._touch(range(start, end))
            self.done = end
        yield from self.spread()

    def spread(self):
        """Finds for each vertex the nearest of the touches that are done; a generator as well."""
        from scipy.spatial import cKDTree

        points = self.surface.points
        tree = cKDTree(points[self.chosen[: self.done]])
        self.nearest = np.empty(len(points), dtype=np.intp)
        for start in range(0, len(points), NEAREST_AT_ONCE):
            self.nearest[start : start + NEAREST_AT_ONCE] = tree.query(
                points[start : start + NEAREST_AT_ONCE]
            )[1]
            yield

    def _touch(self, numbers):
        """The touches of these numbers."""
        touched = []
        for number in numbers:
            contours = self._track(self.chosen[number])
            ended = contours and _ended(contours, self.surface.points[self.chosen[number]])
            if ended:
                self.reason[number] = _reason_of(ended)
            elif contours:
                touched.append((number, contours))
            yield
        if not touched:
            return
        chosen = [self.chosen[number] for number, _ in touched]
        found = core.reconstruct_many(
            self.surface.points[chosen],
            [contours for _, contours in touched],
            outward=self.surface.normals[chosen],
            **self.fit,
        )
        patches = iter(core.with_height_stds([r for r in found if isinstance(r, core.Reconstruction)]))
        yield
        for (number, contours), result in zip(touched, found, strict=True):
            if isinstance(result, core.Reconstruction):
                self._note(number, next(patches))
            else:
                shortest = min(contours, key=lambda contour: len(contour.points))
                self.reason[number] = _reason_of(shortest.stops)
            yield

    def _track(self, vertex):
        surface = self.surface
        try:
            return core.track(
                surface,
                surface.points[vertex],
                surface.normals[vertex],
                self.planes,
                extent=self.extent,
                step=self.step,
                noise=self.noise,
                rng=self._rng,
            )
        except ValueError:  # the numbers are in order, so it is the surface: a face of no area
            return None

    def _note(self, number, result):
        self.reason[number] = REASON_KEYS.index("patch" if result.status == "ok" else "doubt")
        off = core.height_error(result, self.surface)
        self.error[number] = NOTHING if off is None else off
        self.height_std[number] = result.mean_height_std
        self.condition_number[number] = result.condition_number
        self.blind_share[number] = result.blind_share

    def report(self):
        """What there is to say, a dict of plain values; medians are of the patches."""
        reasons = Counter(self.reason[: self.done].tolist())
        counts = {key: reasons[code] for code, key in enumerate(REASON_KEYS)}
        report = {
            "points": len(self.chosen),
            "touched": self.done,
            "patches": counts.pop("patch") + counts["doubt"],
            "in_doubt": counts.pop("doubt"),
            "refused": counts,
        }
        for name in MEASURES:
            values = getattr(self, name)[: self.done]
            known = values[values != NOTHING].tolist()
            if known:
                report[f"{name}_median"] = median(known)
        names = ("spacing", "extent", "step", "noise", "seed")
        report |= {name: getattr(self, name) for name in names} | self.fit
        angles = [(plane.azimuth, plane.tilt) for plane in self.planes]
        return report | {"planes": np.degrees(angles).tolist()}


def _ended(contours, point):
    """Why curves do not go on to both sides of the point: it is on a crease or an edge."""
    return [
        stop
        for contour in contours
        for end, stop in zip((0, -1), contour.stops, strict=True)
        if stop != core.EXTENT and np.array_equal(contour.points[end], point)
    ]


def _reason_of(stops):
    """The code of the commonest of these; curves that go on, but have no tangent plane, are on a crease."""
    counts = Counter(stop for stop in stops if stop in STOP_CODES)
    return STOP_CODES[counts.most_common(1)[0][0] if counts else core.CREASE]


class _Plane:
    """An ideal surface."""

    def ray_cast(self, origin, direction, distance):
        """What core asks of a Surface."""
        if direction[2] == 0.0 or not 0.0 <= -origin[2] / direction[2] <= distance:
            return None
        gone = -origin[2] / direction[2]
        return tuple(a + gone * b for a, b in zip(origin, direction, strict=True)), (0.0, 0.0, 1.0)


def _rehearse(planes, extent, step, fit):
    """Raises ValueError for inputs that cannot even rebuild a plane: all touches would be refused."""
    origin, up = np.zeros(3), (0.0, 0.0, 1.0)
    core.reconstruct(
        origin, core.track(_Plane(), origin, up, planes, extent=extent, step=step), outward=up, **fit
    )
