# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An atlas of contacts that were measured before, such as a robot's rasters, where no more can be felt."""

from collections.abc import Generator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import SMALLEST, Array, list_of, number, unit_vector, unit_vectors
from ..contours.contour import Contour, equal_points
from ..reconstruction.from_contours import reconstruct_many
from ..reconstruction.result import Reconstruction
from ..reconstruction.start import TOUCH_ROUNDING, too_coarse
from ..steps import part_of, result_of
from ..triangles import row_dot
from .charts import AZIMUTHS, Charts
from .connectivity import connected_pieces
from .finger import FACING
from .join import stacked, tabulate
from .meshing import BETWEEN, MeasuredContacts
from .object_atlas import Atlas, joined_surface
from .orientation import doubt_of, oriented, place_text, planes_of, sharpened
from .unfelt import uncovered_places

# python -m benchmarks.robot judges these.
FEWEST = 40  # The smallest patch has this many contacts.
SOME_PLACES = 24  # The number of places at which it is tried how large a patch has to be.
WIDENING, WIDENINGS = 1.4, 10  # Patches grow by this factor, at most this often.
MISSED = 3.0  # Contacts are off a patch, in the median, by at most this multiple of what is expected.
# Patches are at least the first share of their radius, and the second of the smallest one, from each other,
# but for contacts that are farther out than the third, up to which a patch reaches.
PATCHES_APART, MISSING, COVERED = 0.6, 0.6, 1.0
RAY_PLACES = 24  # Where a patch ends is looked for at this many places on each ray.
CHECKED = 1000  # The number of contacts that check the surface:
OFF_STDS, OFF_CELLS = 5.0, 0.5  # they are off it by more than this many deviations and cells,
OFF = 0.03  # and not more than this share may be off or face the other way.
ABREAST = 8  # The number of neighbors of each contact that are to face the same way.
SAME_PLACE = 2.0  # Neighbors share a place if the chord's share is up to this many times the usual one.
OPPOSITE = 0.05  # At most this share of neighbors may face opposite ways in one place (tests: test_measured).
# A ball is too large if neighbors below its centers lie the other way by more than this share of their
# distance, for more than this share of links, at more than this share of centers; edges have up to a ninth.
TURNED = 0.25
GROWN = 0.012  # Without a tolerance, patches grow up to this mean deviation, as a share of the radius.


def atlas_of(
    contours_or_strokes: Sequence[ArrayLike | Contour],
    *,
    outward: ArrayLike | None = None,
    tolerance: float | None = None,
    noise: float | None = None,
) -> Atlas:
    """The atlas (paper, VI) of measured contacts: contours, with normals or without, and strokes (n, 3).

    Contours of the centers of a ball count as the contacts below them, along their normals.

    outward : (3,), a hint, a direction to the outer side on average; required where contacts without normals
        do not close around the object, because these do not show their outer side
    tolerance : mean deviation of the height up to which patches grow; None for 1.2 % of their radius
    noise : standard deviation of a contact; None for the contours' own

    Patches lie where contacts are, as large as these allow. It is "uncertain" where the object may go on
    unfelt, and where normals or contacts contradict each other. Raises ValueError for bad arguments, for
    measured normals many of which face opposite ways in one place, and if no contacts carry a patch.
    """
    return result_of(cover_contacts(contours_or_strokes, outward=outward, tolerance=tolerance, noise=noise))


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

    largest = None if tolerance is None else number("tolerance", tolerance, above=0.0)
    noise = None if noise is None else number("noise", noise, least=0.0)
    contacts, noise, doubt = _contacts(contours_or_strokes, outward, noise)
    yield 0.0
    found, charts = yield from _patches(_Cloud(contacts, cKDTree(contacts.points), noise, largest))
    reference = yield from part_of(joined_surface(found, charts, largest, contacts), 1.0, 1.0)
    places = uncovered_places(reference, charts)
    atlas = Atlas(tuple(found), charts, reference, largest, places, contacts=contacts)
    return replace(atlas, doubt=doubt or _off_contacts(atlas, contacts, noise))


def _contacts(
    given: Sequence[ArrayLike | Contour], outward: ArrayLike | None, noise: float | None
) -> tuple[MeasuredContacts, float, tuple[str, str] | None]:
    """Contacts with outward normals, the noise, and why the normals are in doubt, if they are."""
    strokes, points, noise = _strokes(given, noise)
    up = None if outward is None else unit_vector("outward", outward)
    own = [np.zeros(stroke.points.shape) if stroke.normals is None else stroke.normals for stroke in strokes]
    known = np.repeat([stroke.normals is not None for stroke in strokes], [len(some) for some in own])
    normals, planes = np.vstack(own), planes_of(points, noise)
    normals[known] = unit_vectors("normals", normals[known])
    if not known.all():
        found = oriented([stroke.points for stroke in strokes], planes, normals, up)
        normals[~known] = found[~known]
    else:
        _require_one_side(points, normals)
    doubt = doubt_of(points, normals, planes)
    normals[~known] = sharpened(points, normals, planes)[~known]
    balls = np.repeat([stroke.ball or 0.0 for stroke in strokes], [len(some) for some in own])
    if balls.any():
        centers, points = points, points - balls[:, None] * normals
        doubt = doubt or _beyond_bend(centers, points, planes.links)
        planes = planes_of(points, noise)
    return MeasuredContacts(points, normals, planes.reach, planes.links), noise, doubt


def _strokes(given: Sequence[ArrayLike | Contour], noise: float | None) -> tuple[list[Contour], Array, float]:
    """The strokes, all their contacts (n, 3) and the noise, checked."""
    strokes = [
        stroke if isinstance(stroke, Contour) else Contour(stroke)  # type: ignore[arg-type]
        for stroke in list_of("contours_or_strokes", given, object)  # type: ignore[arg-type]
    ]
    strokes, points = _each_once(strokes)
    if len(points) < FEWEST:
        raise ValueError(f"contours_or_strokes: expected {FEWEST} contacts or more, got {len(points)}")
    size = float(np.ptp(points, axis=0).max())
    if 0.0 < size < SMALLEST:
        raise _too_near()
    if noise is None:
        noise = max(stroke.noise or 0.0 for stroke in strokes)
    if noise > size:
        raise ValueError(f"noise: expected less than the size of what was felt, {size:.3g}, got {noise:.3g}")
    return strokes, points, noise


def _each_once(strokes: list[Contour]) -> tuple[list[Contour], Array]:
    """The strokes without contacts that earlier ones have, too, which add nothing; all contacts (n, 3)."""
    points = np.vstack([np.empty((0, 3)), *(stroke.points for stroke in strokes)])
    order, starts = equal_points(points)
    is_first = np.bincount(order[starts], minlength=len(points)) > 0
    found, ends = [], np.cumsum([len(stroke.points) for stroke in strokes])
    for stroke, end in zip(strokes, ends.tolist(), strict=True):
        which = is_first[end - len(stroke.points) : end]
        normals = None if stroke.normals is None else stroke.normals[which]
        found.append(stroke if which.all() else replace(stroke, points=stroke.points[which], normals=normals))
    return found, points[is_first]


def _require_one_side(points: Array, normals: Array) -> None:
    """Raises ValueError if many measured normals (n, 3) of neighboring points (n, 3) face opposite ways.

    For points p1 and p2 of a sphere with normals n1 and n2, (n1 + n2) . (p2 - p1) = 0, and nearly so on any
    smooth surface. If n2 has the wrong sign, (n1 - n2) . (p2 - p1) is as small. For the two sides of a wall,
    which rightly face opposite ways, it is twice the thickness.
    """
    from scipy.spatial import cKDTree

    near = cKDTree(points).query(points, min(ABREAST + 1, len(points)))[1][:, 1:]
    chords, others = points[near] - points[:, None], normals[near]
    facing = np.einsum("nki,ni->nk", others, normals)
    sums = normals[:, None] + np.copysign(1.0, facing)[..., None] * others
    apart = np.abs(row_dot(chords, sums))
    usual = np.median(apart[facing > FACING]) if (facing > FACING).any() else 0.0
    wrong = (facing < -FACING) & (apart <= SAME_PLACE * usual)
    if wrong.mean() > OPPOSITE:
        raise ValueError(
            "normals: expected those of neighboring contacts on one side, got opposite ones at "
            f"{np.count_nonzero(wrong.any(axis=1))} of {len(wrong)} contacts: turn all outward"
        )


def _beyond_bend(centers: Array, contacts: Array, links: NDArray[np.intp]) -> tuple[str, str] | None:
    """The status and a sentence, if a ball is larger than the bends of its centers (n, 3) at many of them.

    There kappa_center < -1 / r, and contacts (n, 3) lie the other way around than their centers.
    """
    ways, below = (points[links] - points[:, None] for points in (centers, contacts))
    turned = row_dot(ways, below) < -TURNED * row_dot(ways, ways)
    beyond = turned.mean(axis=1) > TURNED
    if beyond.mean() <= TURNED:
        return None
    return "uncertain", (
        f"Centers around {place_text(centers[beyond])} bend more than a ball of this radius can: give the "
        "radius of the ball, or use a smaller one."
    )


def _off_contacts(atlas: Atlas, contacts: MeasuredContacts, noise: float) -> tuple[str, str] | None:
    """The status and a sentence, if many contacts are off the surface or face the other way."""
    some = np.unique(np.linspace(0, len(contacts.points) - 1, CHECKED).astype(np.intp))
    points, normals = contacts.points[some], contacts.normals[some]
    distance, std = atlas.distance(points)
    _, triangle, *_ = atlas.reference.feet(points)
    explained = OFF_STDS * np.hypot(np.where(np.isfinite(std), std, 0.0), noise)
    off = np.abs(distance) > np.maximum(explained, OFF_CELLS * atlas.reference.indicator.cell)
    off |= row_dot(atlas.reference.normals[triangle], normals) < 0.0
    if off.mean() <= OFF:
        return None
    return "uncertain", (
        f"{100.0 * off.mean():.0f} % of the contacts are off the surface or face the other way, as around "
        f"{place_text(points[off])}: their normals contradict each other, or they are too far apart there."
    )


class _Cloud(NamedTuple):
    """Contacts, a KD-tree, the noise, and the deviation up to which patches grow."""

    contacts: MeasuredContacts
    tree: Any
    noise: float
    largest: float | None

    def same_sheet(self, i: int, radius: float) -> NDArray[np.intp]:
        """Those contacts around contact i that face the same way and are linked with it, so of its wall."""
        near = np.array(self.tree.query_ball_point(self.contacts.points[i], radius))
        near = near[self.contacts.normals[near] @ self.contacts.normals[i] > FACING]
        links, order = self.contacts.links[near], np.argsort(near)
        at = order[np.minimum(np.searchsorted(near, links, sorter=order), len(near) - 1)]
        linked = near[at] == links
        _, piece = connected_pieces(np.nonzero(linked)[0], at[linked], len(near))
        return near[piece == piece[np.flatnonzero(near == i)]]

    def patches(self, places: Sequence[int], radius: float) -> list[Reconstruction | None]:
        """The patch of those contacts around each place that are of its wall; None where they carry none."""
        points, normals = self.contacts.points[places], self.contacts.normals[places]
        strokes = [[self.contacts.points[self.same_sheet(i, radius)]] for i in places]
        none: list[list[Contour]] = [[] for _ in places]
        found = reconstruct_many(points, none, outward=normals, strokes_list=strokes, noise=self.noise)
        return [r if isinstance(r, Reconstruction) else None for r in found]

    def rim(self, i: int, r: Reconstruction) -> Array:
        """The radii (AZIMUTHS,) of a patch, in unit radius, to where it has no contacts near it.

        Its domain is a hull of contacts, which may span what was not felt, such as a notch or a hole, and
        where its heights may run away from the surface.
        """
        from scipy.spatial import cKDTree

        domain = r.domain.radii(AZIMUTHS) / r.radius
        near = self.same_sheet(i, 2.0 * r.radius)
        shares = np.arange(1, RAY_PLACES + 1) / RAY_PLACES
        turns = 2.0 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
        ways = np.stack([np.cos(turns), np.sin(turns)], axis=1)
        x, y = r.radius * (shares[:, None, None] * domain[:, None] * ways).reshape(-1, 2).T
        places = r.frame.origin + np.stack([x, y, r.height(x, y)], axis=1) @ r.frame.axes.T
        away, nearest = cKDTree(self.contacts.points[near]).query(places)
        empty = (away > BETWEEN * self.contacts.reach[near[nearest]]).reshape(RAY_PLACES, AZIMUTHS)
        ended = np.where(empty.any(axis=0), empty.argmax(axis=0), RAY_PLACES)
        return domain * np.maximum(ended, 1) / RAY_PLACES

    def certain_patch(self, i: int, radius: float) -> Reconstruction | None:
        """The patch around contact i, or None if there is none, or it is uncertain or off its contacts."""
        (r,) = self.patches([i], radius)
        if r is None:
            return None
        most = self.largest or GROWN * r.radius
        off = r.typical_miss > MISSED * max(self.noise, most)
        return None if off or r.mean_height_std > most else r

    def largest_patch(self, i: int, radii: list[float], last: int) -> tuple[Reconstruction | None, int]:
        """The largest certain patch around contact i, or the smallest one, or None; which radius it has.

        last : which of them the last patch had, for those of neighbors are of about one size
        """
        (smallest,) = self.patches([i], radii[0])
        if smallest is None:
            return None, last
        found = self.certain_patch(i, radii[last])
        if found is None:
            smaller = ((self.certain_patch(i, radii[k]), k) for k in range(last - 1, 0, -1))
            return next(((r, k) for r, k in smaller if r is not None), (smallest, 0))
        for k in range(last + 1, len(radii)):
            larger = self.certain_patch(i, radii[k])
            if larger is None:
                break
            found, last = larger, k
        return found, last

    def least_radius(self) -> Generator[float, None, float]:
        """The least radius at which patches exist at half of some places, for contacts may lie in lines.

        Raises ValueError if there is none, or numbers do not hold such patches. Yields 0 after each trial.
        """
        points = self.contacts.points
        some = np.linspace(0, len(points) - 1, SOME_PLACES).astype(np.intp)
        radius = float(np.median(self.tree.query(points[some], FEWEST)[0][:, -1]))
        self._require_fine(radius)
        for _ in range(WIDENINGS):
            if sum(r is not None for r in self.patches(some.tolist(), radius)) * 2 >= SOME_PLACES:
                return radius
            radius *= WIDENING
            yield 0.0
        raise ValueError(
            "contours_or_strokes: expected contacts all around at least one of them, got "
            f"{len(points)} without"
        )

    def _require_fine(self, radius: float) -> None:
        """Raises ValueError if patches of this radius are too small for double precision."""
        if 0.0 < radius < SMALLEST:
            raise _too_near()
        gap = float(np.spacing(np.abs(self.contacts.points).max()))
        if gap > TOUCH_ROUNDING * radius > 0.0:
            raise too_coarse(gap, radius)


def _too_near() -> ValueError:
    return ValueError(
        f"contours_or_strokes: expected contacts at least {SMALLEST:g} apart, got nearer ones: use another "
        "unit of length"
    )


def _patches(cloud: _Cloud) -> Generator[float, None, tuple[list[Reconstruction], Charts]]:
    """Patches and their tables, as large as they may be, at contacts that no earlier one covers.

    Yields the share that is covered.
    """
    radius = yield from cloud.least_radius()
    points, radii, last = cloud.contacts.points, [radius * WIDENING**k for k in range(WIDENINGS)], 0
    left, found, tables = np.ones(len(points), dtype=bool), [], []
    for i in range(len(left)):
        if not left[i]:
            continue
        r, last = cloud.largest_patch(i, radii, last)
        left[cloud.same_sheet(i, MISSING * radius)] = False
        if r is not None:
            found.append(r)
            tables.append(tabulate(r, cloud.rim(i, r), deviations=True))
            chart, some = stacked([r], tables[-1:]), cloud.same_sheet(i, PATCHES_APART * r.radius)
            x, y, _ = chart.local(points[some], np.arange(len(some)), np.zeros(len(some), dtype=np.intp))
            left[some] &= chart.shares(x, y, np.zeros(len(some), dtype=np.intp)) > COVERED
        left[i] = False
        yield 1.0 - float(left.mean())
    return found, stacked(found, tables)
