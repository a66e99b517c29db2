# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An atlas of contacts that were measured before, such as a robot's rasters, where no more can be felt."""

from collections.abc import Generator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import SMALLEST, Array, list_of, number, unit_vector, unit_vectors
from ..contours.contour import Contour
from ..reconstruction.from_contours import reconstruct_many
from ..reconstruction.result import Reconstruction
from ..reconstruction.start import TOUCH_ROUNDING, too_coarse
from ..steps import result_of
from .finger import FACING
from .join import charts_of
from .object_atlas import Atlas, surfaced

# python -m benchmarks.robot judges these.
FEWEST = 40  # The smallest patch has so many contacts.
SOME_PLACES = 24  # At so many places it is tried how large a patch has to be.
WIDENING, WIDENINGS = 1.4, 10  # Patches grow by this factor, at most so often.
MISSED = 3.0  # Contacts are off a patch, in the median, by at most so many times what is expected.
PATCHES_APART = 0.6  # Patches are so many radii from each other.
NEIGHBORS = 16  # The plane of so many neighbors gives the normal of a contact where none was measured.
ABREAST = 8  # So many neighbors of each contact are to face the same way.
ALIKE = 2.0  # Neighbors share a place if they are apart by up to so many times the median of all.
OPPOSITE = 0.05  # At most this share of neighbors may face opposite ways in one place (tests: test_measured).
GROWN = 0.012  # Without a tolerance, patches grow up to this mean deviation, as a share of the radius.


def atlas_of(
    contours_or_strokes: Sequence[ArrayLike | Contour],
    *,
    outward: ArrayLike | None = None,
    tolerance: float | None = None,
    noise: float | None = None,
) -> Atlas:
    """The atlas (paper, VI) of measured contacts: contours, with normals or without, and strokes (n, 3).

    outward : (3,), a direction to the outer side of all contacts without normals; required if there are such
    tolerance : mean deviation of the height up to which patches grow; None for 1.2 % of their radius
    noise : standard deviation of a contact; None for the contours' own

    Patches lie where contacts are, as large as these allow. Raises ValueError for bad arguments, for normals
    that contradict each other, and if no contacts carry a patch.
    """
    steps = cover_contacts(contours_or_strokes, outward=outward, tolerance=tolerance, noise=noise)
    atlas: Atlas = result_of(steps)
    return atlas


def cover_contacts(
    contours_or_strokes: Sequence[ArrayLike | Contour],
    *,
    outward: ArrayLike | None = None,
    tolerance: float | None = None,
    noise: float | None = None,
) -> Generator[float, None, Atlas]:
    """What `atlas_of` does, in steps: yields the share of the contacts that is covered, returns the Atlas.

    Arguments and errors are those of `atlas_of`; the errors come with the first steps.
    """
    from scipy.spatial import cKDTree

    points, normals, own = _contacts(contours_or_strokes, outward)
    largest = None if tolerance is None else number("tolerance", tolerance, above=0.0)
    noise = own if noise is None else number("noise", noise, least=0.0)
    size = float(np.ptp(points, axis=0).max())
    if noise > size:
        raise ValueError(f"noise: expected less than the size of what was felt, {size:.3g}, got {noise:.3g}")
    cloud = _Cloud(points, normals, cKDTree(points), noise, largest)
    if outward is None:
        cloud.require_one_side()
    yield 0.0
    found = yield from _patches(cloud)
    charts = charts_of(found)
    steps = surfaced(found, charts, largest)
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return Atlas(tuple(found), charts, end.value, largest)
        yield 1.0


def _contacts(given: Sequence[ArrayLike | Contour], outward: ArrayLike | None) -> tuple[Array, Array, float]:
    """Contacts and outward normals, (n, 3) each, and the largest noise that any contour states."""
    strokes = [
        stroke if isinstance(stroke, Contour) else Contour(stroke)  # type: ignore[arg-type]
        for stroke in list_of("contours_or_strokes", given, object)  # type: ignore[arg-type]
    ]
    up = None if outward is None else unit_vector("outward", outward)
    if up is None and any(stroke.normals is None for stroke in strokes):
        raise ValueError("outward: expected a direction where contacts have no normals, got none")
    points = np.vstack([np.empty((0, 3)), *(stroke.points for stroke in strokes)])
    if len(points) < FEWEST:
        raise ValueError(f"contours_or_strokes: expected {FEWEST} contacts or more, got {len(points)}")
    own = [np.zeros(stroke.points.shape) if stroke.normals is None else stroke.normals for stroke in strokes]
    missing = np.repeat([stroke.normals is None for stroke in strokes], [len(normals) for normals in own])
    normals = np.vstack(own)
    if up is not None and missing.any():
        normals[missing] = _normals(points, up)[missing]
    normals = unit_vectors("normals", normals)
    return points, normals, max(stroke.noise or 0.0 for stroke in strokes)


def _normals(points: Array, up: Array) -> Array:
    """Normals (n, 3) of the planes through the neighbors of each contact, on the side of `up`."""
    from scipy.spatial import cKDTree

    near = cKDTree(points).query(points, min(NEIGHBORS, len(points)))[1]
    off = points[near] - points[near].mean(axis=1, keepdims=True)
    normals: Array = np.linalg.eigh(np.swapaxes(off, 1, 2) @ off)[1][..., 0]
    return np.where((normals @ up < 0.0)[:, None], -normals, normals)


class _Cloud(NamedTuple):
    """Contacts and normals (n, 3), a KD-tree, the noise, and the deviation up to which patches grow."""

    points: Array
    normals: Array
    tree: Any
    noise: float
    largest: float | None

    def require_one_side(self) -> None:
        """Raises ValueError if many neighbors face opposite ways in one place.

        The normals of two places on a sphere have a sum across the chord between them, and so have nearly
        those of neighbors on any smooth surface; with the second normal reversed if one of them is wrong.
        On the two sides of a wall this leaves its thickness.
        """
        near = self.tree.query(self.points, min(ABREAST + 1, len(self.points)))[1][:, 1:]
        chords, others = self.points[near] - self.points[:, None], self.normals[near]
        facing = np.einsum("nki,ni->nk", others, self.normals)
        sums = self.normals[:, None] + np.copysign(1.0, facing)[..., None] * others
        apart = np.abs(np.einsum("nki,nki->nk", chords, sums))
        alike = np.median(apart[facing > FACING]) if (facing > FACING).any() else 0.0
        wrong = (facing < -FACING) & (apart <= ALIKE * alike)
        if wrong.mean() > OPPOSITE:
            raise ValueError(
                "normals: expected those of neighboring contacts on one side, got opposite ones at "
                f"{np.count_nonzero(wrong.any(axis=1))} of {len(wrong)} contacts: turn all outward"
            )

    def patch(self, i: int, radius: float) -> Reconstruction | None:
        """The patch of those contacts around contact i that face the same way, or None if they carry none."""
        near = np.array(self.tree.query_ball_point(self.points[i], radius))
        near = near[self.normals[near] @ self.normals[i] > FACING]
        strokes, place, outward = [[self.points[near]]], self.points[i][None], self.normals[i][None]
        (r,) = reconstruct_many(place, [()], outward=outward, strokes_list=strokes, noise=self.noise)
        return r if isinstance(r, Reconstruction) else None

    def largest_patch(self, i: int, radius: float) -> Reconstruction | None:
        """The largest patch around contact i that is certain enough, or the smallest, or None."""
        best = None
        for _ in range(WIDENINGS):
            r = self.patch(i, radius)
            if r is None:
                break
            most = self.largest or GROWN * r.radius
            off = r.typical_miss > MISSED * max(self.noise, most)
            if best is not None and (off or r.mean_height_std > most):
                break
            best, radius = r, WIDENING * radius
        return best

    def least_radius(self) -> Generator[float, None, float]:
        """The least radius at which patches exist at half of some places, for contacts may lie in lines.

        Raises ValueError if there is none, or numbers do not hold such patches. Yields 0 after each trial.
        """
        some = np.linspace(0, len(self.points) - 1, SOME_PLACES).astype(np.intp)
        radius = float(np.median(self.tree.query(self.points[some], FEWEST)[0][:, -1]))
        self._require_fine(radius)
        for _ in range(WIDENINGS):
            if sum(self.patch(i, radius) is not None for i in some.tolist()) * 2 >= SOME_PLACES:
                return radius
            radius *= WIDENING
            yield 0.0
        raise ValueError(
            "contours_or_strokes: expected contacts all around at least one of them, got "
            f"{len(self.points)} without"
        )

    def _require_fine(self, radius: float) -> None:
        """Raises ValueError if patches of this radius are too small for double precision."""
        size = float(np.ptp(self.points, axis=0).max())
        if any(0.0 < length < SMALLEST for length in (size, radius)):
            raise ValueError(
                f"contours_or_strokes: expected contacts at least {SMALLEST:g} apart, got nearer ones: use "
                "another unit of length"
            )
        gap = float(np.spacing(np.abs(self.points).max()))
        if gap > TOUCH_ROUNDING * radius > 0.0:
            raise too_coarse(gap, radius)


def _patches(cloud: _Cloud) -> Generator[float, None, list[Reconstruction]]:
    """Patches, as large as they may be, at contacts that no earlier one covers; yields the share covered."""
    radius = yield from cloud.least_radius()
    left, found = np.ones(len(cloud.points), dtype=bool), []
    for i in range(len(left)):
        if not left[i]:
            continue
        r = cloud.largest_patch(i, radius)
        room = PATCHES_APART * (radius if r is None else r.radius)
        near = cloud.tree.query_ball_point(cloud.points[i], room)
        left[near] &= cloud.normals[near] @ cloud.normals[i] < FACING
        if r is not None:
            found.append(r)
        yield 1.0 - float(left.mean())
    return found
