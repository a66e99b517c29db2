# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where fits start: contacts in the frames of the paper (III), or in those that strokes show."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..bayes.joint_fit import MISFIT
from ..contours.common_point import MAX_OFFSET
from ..contours.contour import SURFACE_ENDS, Contour
from ..contours.curves import (
    LEAST_CONTACTS,
    Curves,
    curves_through,
    distances_from_point,
    misses,
    stacked,
)
from ..contours.local_geometry import (
    DegenerateCurvesError,
    darboux_frames,
    degeneracy,
    surface_normals,
)
from ..contours.thinning import thinned
from ..patch.domain import AT_POINT, Domain, closed_spline_domain
from .options import FitOptions
from .strokes import STRIPS, FirstFrame, first_frame, means, toward_farthest

TOUCH_ROUNDING = 1e-3  # Far from the origin rounding may take this share of a touch; MISFIT has room for it.


class TouchContacts(NamedTuple):
    """The contacts of one touch: contours, and strokes (n, 3) as `gathered` has them."""

    contours: list[Contour]
    strokes: Array
    when: NDArray[np.intp]
    noise: float

    @property
    def strokes_only(self) -> bool:
        """Whether there are strokes only."""
        return len(self.strokes) > 0 and not self.contours

    @property
    def size(self) -> int:
        """The number of places that its contacts take in a stack."""
        longest = max((len(contour.points) for contour in self.contours), default=0)
        return len(self.contours) * longest + min(len(self.strokes), STRIPS**2)


class Start(NamedTuple):
    """b touches as the joint fit takes them, in axes near to the Darboux frames."""

    points: Array  # (b, 3), in the world
    axes: Array
    kappas: Array  # k1 and k2, (b, 2)
    radii: Array
    curves: Curves  # relative to the points, in the world
    strokes: list[Array]  # (m, 3) each, in the axes and in unit radius
    stds: Array  # (b,)
    stds_are_known: NDArray[np.bool_]  # (b,), whether stds are all of the noise; that of means is more
    point_stds: Array  # (b,), of the points along the normal; infinite where only contacts show the surface

    @property
    def strokes_only(self) -> bool:
        """Whether there are strokes only."""
        return not self.curves.present.any()

    @property
    def tangents(self) -> Array:
        """The tangents (b, 3), in the world, which d1 is to follow."""
        return self.axes[:, :, 0] if self.strokes_only else self.curves.tangents[:, 0]

    def contacts(self) -> tuple[Array, NDArray[np.bool_]]:
        """Contacts (b, n, 3) of curves, then strokes, in the axes and in unit radius; a mask (b, n)."""
        b, most = len(self.points), max(map(len, self.strokes))
        local = (self.curves.points @ self.axes[:, None] / self.radii[:, None, None, None]).reshape(b, -1, 3)
        strokes, is_stroke = np.zeros((b, most, 3)), np.zeros((b, most), dtype=bool)
        for i, stroke in enumerate(self.strokes):
            strokes[i, : len(stroke)], is_stroke[i, : len(stroke)] = stroke, True
        present = self.curves.present.reshape(b, -1)
        return np.concatenate([local, strokes], axis=1), np.concatenate([present, is_stroke], axis=1)

    def ranks(self, i: int) -> NDArray[np.intp]:
        """How many of touch i are farther out on the same half curve, or before it in the strokes, (n,)."""
        along, last = self.curves.along[i], self.curves.present[i].sum(axis=1)[:, None] - 1
        index = np.arange(along.shape[1])
        of_curves = np.where(along < 0.0, index, last - index).ravel()
        return np.append(of_curves, np.arange(max(map(len, self.strokes))))


Started = tuple[Start | None, list[list[Contour]], list[DegenerateCurvesError | None]]


def curves_start(
    points: Array, touches: Sequence[TouchContacts], outward: Array, options: FitOptions
) -> Started:
    """The start of fits to contours, with or without strokes; the thinned contours; and errors."""
    thin = [[thinned(c, point) for c in touch.contours] for point, touch in zip(points, touches, strict=True)]
    contours = [[contour for contour, _ in of_touch] for of_touch in thin]
    curves = curves_through(*stacked(points, contours))
    normals = surface_normals(curves.tangents, outward)
    errors = _errors(points, contours, curves, normals)
    good = [i for i, error in enumerate(errors) if error is None]
    if not good:
        return None, contours, errors
    chosen = [touches[i] for i in good], [thin[i] for i in good], curves.at(good), normals[good]
    return _start(points[good], *chosen, options), contours, errors


def _start(
    points: Array,
    touches: Sequence[TouchContacts],
    thin: Sequence[Sequence[tuple[Contour, int]]],
    curves: Curves,
    normals: Array,
    options: FitOptions,
) -> Start:
    """The start of b fits to curves with surface normals (b, 3).

    thin : the thinned contours of each, and the number of contacts in each mean
    """
    axes, kappas, radii = darboux_frames(curves, normals)
    strokes, stds, known, point_stds = [], [], [], []
    for i, (point, touch, thin_curves) in enumerate(zip(points, touches, thin, strict=True)):
        contours = [contour for contour, _ in thin_curves]
        contacts, size = _stroke_means(curves.at(i), contours, axes[i], radii[i], point, touch)
        noises = [*(c.noise or 0.0 for c in contours), touch.noise / math.sqrt(size)]
        strokes.append(contacts)
        stds.append(_std(options.noise, max(size, min(number for _, number in thin_curves)), noises))
        has_noise = options.noise is not None or None not in [c.noise for c in contours]
        known.append(not len(contacts) and has_noise)
        point_stds.append(_point_std(point, touch.contours, options, radii[i]))
    return Start(
        points, axes, kappas, radii, curves, strokes, np.array(stds), np.array(known), np.array(point_stds)
    )


def _errors(
    points: Array, contours: list[list[Contour]], curves: Curves, normals: Array
) -> list[DegenerateCurvesError | None]:
    """Why each touch with these curves and normals (b, 3) carries no frame, or None."""
    touches = zip(contours, curves.present, curves.tangents, normals, strict=True)
    apart, reach = np.spacing(np.abs(points)).max(axis=1), np.abs(curves.points).max(axis=(1, 2, 3))
    errors = [
        degeneracy(*touch) or (too_coarse(gap, size) if gap > TOUCH_ROUNDING * size else None)
        for touch, gap, size in zip(touches, apart, reach, strict=True)
    ]
    return [
        error and (away_from(point, of_touch) or error)
        for error, point, of_touch in zip(errors, points, contours, strict=True)
    ]


def away_from(point: Array, contours: Sequence[Contour]) -> DegenerateCurvesError | None:
    """The error that names the curve which passes the point farthest off, if it is by MAX_OFFSET; else None.

    Both its nearest contact and its line there are, because at a corner only the line is. Too few curves or
    contacts have other errors.
    """
    if len(contours) < 3 or min(len(contour.points) for contour in contours) <= LEAST_CONTACTS:
        return None
    distances = misses(curves_through(*stacked(point[None], [contours])))[0, :, 0]
    away = [
        miss if min(contour.distance_to(point), miss) > MAX_OFFSET * contour.size else 0.0
        for miss, contour in zip(distances, contours, strict=True)
    ]
    worst = int(np.argmax(away))
    if not away[worst]:
        return None
    return DegenerateCurvesError(
        f"curve {worst + 1} passes the reference point at {away[worst]:.3g}, more than a tenth of its size: "
        "set the point where the curves meet"
    )


def _point_std(point: Array, contours: Sequence[Contour], options: FitOptions, radius: float) -> float:
    """The prior standard deviation of a reference point along the normal, a length.

    A point that is a contact of a curve was touched, and has its noise. Any other was computed from the
    contacts, or set elsewhere: only contacts show where the surface is.
    """
    if options.point_std is not None:
        return options.point_std
    if all(distances_from_point(contour.points - point)[1].all() for contour in contours):
        return math.inf
    noises = [options.noise] if options.noise is not None else [contour.noise for contour in contours]
    return max((MISFIT * radius if noise is None else noise) for noise in noises)


def _std(noise: float | None, size: int, known: list[float]) -> float:
    """The least deviation of contacts, each a mean of `size` with this noise, or the largest of `known`."""
    return max(known) if noise is None else noise / math.sqrt(size)


def _stroke_means(
    curves: Curves,
    contours: Sequence[Contour],
    axes: Array,
    radius: float,
    point: Array,
    touch: TouchContacts,
) -> tuple[Array, int]:
    """Strokes (n, 3) over the domain of curves as means, in unit radius; the least number in a mean.

    None are over curves that bound no domain.
    """
    if not len(touch.strokes):
        return touch.strokes, 1
    local = (touch.strokes - point) @ axes / radius
    local_curves = curves._replace(points=curves.points @ axes / radius, tangents=curves.tangents @ axes)
    try:
        domain = domain_of(local_curves, contours)
    except ValueError:
        return local[:0], 1
    over = domain.contains(local[:, 0], local[:, 1]) & (np.abs(local[:, 2]) <= 1.0)
    return _means(local[over], touch.when[over])


def _means(contacts: Array, when: NDArray[np.intp]) -> tuple[Array, int]:
    """The means of contacts (n, 3) of strokes, and the least number in a mean; see `means`."""
    return means(contacts, toward_farthest(contacts[:, :2]), when) if len(contacts) else (contacts, 1)


def strokes_start(
    points: Array,
    touches: Sequence[TouchContacts],
    outward: Array,
    noise: float | None,
    radius: float | None,
) -> Started:
    """What `curves_start` gives, for touches of strokes without contours."""
    frames = [
        first_frame(touch.strokes - point, up, radius)
        for point, touch, up in zip(points, touches, outward, strict=True)
    ]
    for i, gap in enumerate(np.spacing(np.abs(points)).max(axis=1)):
        first = frames[i]
        if isinstance(first, FirstFrame) and gap > TOUCH_ROUNDING * first.radius:
            frames[i] = too_coarse(gap, first.radius)
    errors = [None if isinstance(first, FirstFrame) else first for first in frames]
    firsts = {i: first for i, first in enumerate(frames) if isinstance(first, FirstFrame)}
    none: list[list[Contour]] = [[] for _ in touches]
    if not firsts:
        return None, none, errors
    good = list(firsts)
    thin = [_means(first.contacts, touches[i].when[first.used]) for i, first in firsts.items()]
    sizes = zip(good, (size for _, size in thin), strict=True)
    start = Start(
        points=points[good],
        axes=np.array([first.axes for first in firsts.values()]),
        kappas=np.array([(first.k1, first.k2) for first in firsts.values()]),
        radii=np.array([first.radius for first in firsts.values()]),
        curves=curves_through(*stacked(points[good], [[]] * len(good))),
        strokes=[contacts for contacts, _ in thin],
        stds=np.array([_std(noise, size, [touches[i].noise / math.sqrt(size)]) for i, size in sizes]),
        stds_are_known=np.zeros(len(good), dtype=bool),
        point_stds=np.full(len(good), np.inf),
    )
    return start, none, errors


def domain_of(curves: Curves, contours: Sequence[Contour]) -> Domain:
    """The domain through the ends of the curves of a touch, which are in its frame and in unit radius.

    Where the surface ends at less than AT_POINT on a side, the domain ends at AT_POINT there. Raises
    ValueError if the ends bound none.
    """
    last = np.maximum(curves.present.sum(axis=1) - 1, 0)
    rows, ahead = np.arange(len(last)), curves.tangents[:, :2]
    present = curves.present[:, 0]
    sides = np.array([present & (curves.along[:, 0] < 0.0), present & (curves.along[rows, last] > 0.0)])
    ends = np.array([curves.points[rows, 0, :2], curves.points[rows, last, :2]])
    open_ends = np.zeros_like(sides)
    for i, contour in enumerate(contours):
        open_ends[:, i] = [stop in SURFACE_ENDS for stop in contour.stops or ("", "")]
    if open_ends.any():
        at_point = open_ends & (np.linalg.norm(ends, axis=2) * sides < AT_POINT)
        ends[at_point] = (np.array([-AT_POINT, AT_POINT])[:, None, None] * ahead)[at_point]
        sides |= at_point
    return closed_spline_domain(ends[sides], 1.0, open_ends[sides])


def too_coarse(gap: float, size: float) -> DegenerateCurvesError:
    """The error for a touch of this size where neighboring coordinates are a length apart."""
    return DegenerateCurvesError(
        f"neighboring coordinates at the point are {gap:.2g} apart in double precision, too coarse "
        "for curves of "
        f"{size:.2g}: move the origin nearer to the point"
    )
