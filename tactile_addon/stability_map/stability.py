# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touches all over an object for a stability map, step by step; nothing in the scene changes."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import copy
from functools import partial
from statistics import median
from time import perf_counter
from typing import Any

import bpy
import numpy as np

from ... import core
from ...core.steps import chunked
from ...core.triangles import cut_to_edges, triangle_cross
from ..scene.mesh_data import MEASURES
from ..touch.detached_mesh import DetachedMesh
from ..touch.evaluated_mesh import evaluated_object, size_of
from ..touch.touch_object import FARTHEST_SHARE, LEAST_STEPS, require_fine, require_lengths
from ..touch.types import Array, Object, Point, Triple
from ..touch.units import length

EXTENT_SHARE = 1.0 / 8.0  # This share of the object's size stands for an extent that touches choose.
SPACING_SHARE = 1.0 / 2.0  # The default spacing, as a share of the extent.
MOST_TOUCHES = 1_000_000  # They take hours, and the places among which they are chosen 2 GB.
TRIED_SPACING = 1.0 / 4.0  # Touches that are timed are so far apart, as a share of the object's size.
BATCH = 20  # The number of touches that are fitted at once, in some hundredths of a second.
GROWING_BATCH = 4  # Touches that choose their extent are fewer, because their fits have more contacts.
NEAREST_AT_ONCE = 10_000  # The number of triangles or vertices that get their nearest touch at once.
NOTHING = -1.0  # Each quantity has this value where there is no patch.
# The values of the attribute `reason`: key, name, and the stop of a curve that it follows from.
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


class StabilityMap:
    """Touches of an evaluated mesh at places that are spaced evenly, however large its faces are.

    They are in the middle of triangles, which are cut until none is longer than the spacing: at vertices a
    coarse mesh has creases, and most clicks are elsewhere.

    places : n arrays (3,), the places to touch as the surface has them, in random order
    done : how many of these have been touched; few_facets : how many patches follow facets
    measures, reason : (n,), what was found by each touch; the fields of `measures` are MEASURES
    points, triangles, owners : (k, 3), (m, 3) and (m,), the mesh that is painted, and its triangles' faces
    areas : those of the triangles
    touch_in, touch_of : the indices of the touches nearest to the middle of each triangle and to each vertex,
        once the steps are done
    """

    def __init__(
        self,
        obj: Object,
        depsgraph: bpy.types.Depsgraph,
        planes: Sequence[core.SamplingPlane],
        *,
        spacing: float,
        extent: float,
        step: float,
        noise: float,
        seed: int,
        **fit: Any,
    ) -> None:
        """If `spacing`, `extent` or `step` is 0, the touches choose it; `fit` is that of touch().

        Raises ValueError, with a sentence, if the object cannot be touched, or no touch could succeed.
        """
        import scipy.spatial  # noqa: F401  # The import takes half a second, too long between redraws.

        self.surface = DetachedMesh(obj, depsgraph)
        # A probe has only the bounding box, and must find there what the map shows.
        evaluated, linear, _ = evaluated_object(obj, depsgraph)
        self._farthest = FARTHEST_SHARE * size_of(evaluated, linear)
        if not spacing >= 0.0:  # NaN fails every comparison, so it is refused, too.
            raise ValueError(f"The spacing is a length of 0 or more, got {length(spacing)}")
        usual = extent or EXTENT_SHARE * self.surface.size
        # Touches of one extent have one step.
        self.extent, self.step = extent, step or extent / LEAST_STEPS
        self._glance: dict[str, Any] = {"extent": usual, "step": step or usual / LEAST_STEPS}
        require_lengths(obj.name, self.surface.size, **self._glance, noise=noise)
        self.spacing = spacing or SPACING_SHARE * usual
        require_fine(self.surface.spacing, self._glance["step"])
        self.planes, self.noise, self.seed, self.fit = planes, noise, seed, fit
        self._rng = np.random.default_rng(seed)
        _rehearse(planes, fit, **self._glance)
        if self.expected_count() > MOST_TOUCHES:
            raise ValueError(
                f'The spacing {length(self.spacing)} takes over {MOST_TOUCHES:,} touches of "{obj.name}": '
                "use a larger one"
            )
        self.places: list[Array] = []
        self.done = self.few_facets = 0

    def expected_count(self) -> int:
        """About how many points are touched."""
        corners = self.surface.points[self.surface.triangles]
        areas = 0.5 * np.linalg.norm(triangle_cross(corners), axis=1)
        return core.spaced_count(float(areas.sum()), self.spacing)

    def seconds_each(self) -> float:
        """About how many seconds a touch takes, by one batch of touches far apart."""
        tried = copy(self)
        tried.spacing, tried.places = TRIED_SPACING * self.surface.size, []
        for _ in tried.steps():
            if tried.done:
                return (perf_counter() - tried.began) / tried.done
        return 0.0

    def steps(self) -> Iterator[None]:
        """Does everything, as a generator that yields every few hundredths of a second."""
        self.points, self.triangles, whole = cut_to_edges(
            self.surface.points, self.surface.triangles, self.spacing
        )
        self.owners = self.surface.owners[whole]
        corners = self.points[self.triangles]
        self._middles = corners.mean(axis=1)
        self.areas = 0.5 * np.linalg.norm(triangle_cross(corners), axis=1)
        yield
        for index in core.spaced(self._middles, self.spacing, self._rng):
            if index is not None:
                self.places.append(self._middles[index])
            yield
        count = len(self.places)
        self.measures = np.full(count, NOTHING, dtype=[(name, float) for name in MEASURES])
        self.reason = np.full(count, REASON_KEYS.index("nothing"), dtype=np.int32)
        size = 1 if self.fit["method"] != "bayes" else BATCH if self.extent else GROWING_BATCH
        self.began = perf_counter()
        for start in range(0, count, size):
            end = min(start + size, count)
            yield from self._touch(range(start, end))
            self.done = end
        yield from self.spread()

    def spread(self) -> Iterator[Any]:
        """Finds the touch for each face and vertex among those that are done, as a generator like `steps`."""
        from scipy.spatial import cKDTree

        tree = cKDTree(self.places[: self.done])
        nearest = partial(chunked, lambda some: (tree.query(some)[1],), NEAREST_AT_ONCE, 1.0)
        (self.touch_in,) = yield from nearest(self._middles)
        (self.touch_of,) = yield from nearest(self.points)

    def _touch(self, numbers: Sequence[int]) -> Iterator[None]:
        """Makes the touches with these numbers, as a generator like `steps`."""
        options = core.ExplorationOptions(
            self.planes,
            farthest=self._farthest,
            extent=self.extent or None,
            step=self.step or None,
            noise=self.noise,
            rng=self._rng,
            **self.fit,
        )
        feet: dict[int, tuple[Triple, Triple]] = {}
        for number in numbers:
            try:
                feet[number] = self.surface.project(self.places[number].tolist())[:2]
            except ValueError:  # The face has no area, which is the reason until there is another.
                continue
        points, normals = np.reshape([*feet.values()], (-1, 2, 3)).swapaxes(0, 1)
        found = yield from core.exploring_many(self.surface, points, normals, options)
        for (number, foot), touch in zip(feet.items(), found, strict=True):
            if isinstance(touch, ValueError):
                self.reason[number] = self._why_none(*foot)
            elif ended := core.stops_at(touch.contours, foot[0]):
                self.reason[number] = _reason_of(ended)
            else:
                self._note(number, touch)
            yield

    def _why_none(self, point: Point, normal: Point) -> int:
        """The code of the reason why there is no touch at a point."""
        try:
            contours = core.track(self.surface, point, normal, self.planes, **self._glance)
        except ValueError:  # The settings are valid, so a face there has no area.
            return REASON_KEYS.index("nothing")
        shortest = min(contours, key=lambda contour: len(contour.points))
        return _reason_of(core.stops_at(contours, point) or shortest.stops)

    def _note(self, number: int, touch: core.Exploration) -> None:
        result = touch.result
        is_sure = result.gravest is None
        self.few_facets += not is_sure and len(result.shape_curvatures) > 0
        self.reason[number] = REASON_KEYS.index("patch" if is_sure else "doubt")
        self.measures[number] = (
            NOTHING if result.taps.height is None else result.taps.height,
            result.mean_height_std,
            touch.reach,
            result.condition_number,
            result.null_space_share,
        )

    def report(self) -> dict[str, Any]:
        """What was found and with which settings, as a dict of plain values; angles are in degrees.

        `patches` are all, also those in doubt; `refused` counts the touches without one by reason. Medians
        are over the patches that have the value. `extent` and `step` are 0 where touches chose them.
        """
        reasons = Counter(self.reason[: self.done].tolist())
        counts = {key: reasons[code] for code, key in enumerate(REASON_KEYS)}
        report = {
            "points": len(self.places),
            "touched": self.done,
            "patches": counts.pop("patch") + counts["doubt"],
            "in_doubt": counts.pop("doubt"),
            "few_facets": self.few_facets,
            "refused": counts,
            "object_size": self.surface.size,
        }
        for name in MEASURES:
            values = self.measures[name][: self.done]
            known = values[values != NOTHING].tolist()
            if known:
                report[f"{name}_median"] = median(known)
        return report | {
            **{name: getattr(self, name) for name in ("spacing", "extent", "step", "noise", "seed")},
            **self.fit,
            "planes": np.degrees([(plane.azimuth, plane.tilt) for plane in self.planes]).tolist(),
        }


def _reason_of(stops: Iterable[str]) -> int:
    """The code of the most frequent stop. Curves that go on, but have no tangent plane, are on a crease."""
    counts = Counter(stop for stop in stops if stop in STOP_CODES)
    return STOP_CODES[counts.most_common(1)[0][0] if counts else core.CREASE]


def _rehearse(
    planes: Sequence[core.SamplingPlane], fit: Mapping[str, Any], extent: float, step: float
) -> None:
    """Raises ValueError for settings that cannot even rebuild a plane: all touches would be refused."""
    up, steps = (0.0, 0.0, 1.0), np.arange(-(extent // step), extent // step + 1)
    axes = [plane.axes(up) for plane in planes]
    contours = [core.Contour(np.outer(step * steps, a[:, 0]), plane_normal=a[:, 2]) for a in axes]
    core.reconstruct(np.zeros(3), contours, outward=up, **fit)
