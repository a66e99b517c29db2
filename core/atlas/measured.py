# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An atlas of contacts that were measured before, such as a robot's rasters, where no more can be felt."""

from collections.abc import Generator, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import SMALLEST, Array, list_of, number, unit_vector, unit_vectors
from ..bayes.joint_fit import MISFIT
from ..contours.contour import Contour
from ..patch.monge import QUADRIC
from ..reconstruction.explained import FEW, are_few, too_far
from ..reconstruction.from_contours import reconstruct_many
from ..reconstruction.result import Reconstruction
from ..reconstruction.start import TOUCH_ROUNDING, too_coarse
from ..steps import chunked, part_of, result_of
from ..triangles import row_dot
from ..verdict import Doubt, beyond
from .charts import AZIMUTHS, PLACES_AT_ONCE, Charts
from .connectivity import Indices, graph_of, pieces_of
from .field import AGREE, INSIDE, sheet_facing
from .finger import FACING
from .join import stacked, tabulate
from .meshing import BETWEEN, MeasuredContacts
from .object_atlas import Atlas, joined_surface
from .orientation import THROUGH, doubts_of, oriented, place_text, planes_of, sharpened
from .unfelt import place_at, uncovered_places

# python -m benchmarks.robot judges these.
FEWEST = 40  # The smallest patch has this many contacts.
SOME_PLACES = 24  # The number of places at which patches show the noise.
WIDENING, RADII = 1.4, 10  # Patches have one of this number of radii, each larger by the factor.
# A patch is looked for at contacts that are farther than this share of its radius from the middles of others,
# or not on these. Where there is none, none is looked for as near as that: otherwise a patch bulges to a
PATCHES_APART = 0.6  # single contact that is off (test_measured).
# A patch goes on to an edge where a contact is within this share of its neighbors' reach: with 0.3 an L whose
# contacts end half a spacing before its edges is in doubt (test_measured), with 0.5 a pear of 400 even
AT_EDGE = 0.45  # contacts has a spike of a twentieth of its size.
RAY_PLACES, RAY_ROUNDS = 16, 2  # The places on each ray at which a patch may end, and the rounds of these.
ABREAST = 8  # Of this many neighbors the normals are to face the same way, or one is taken that does.
OPPOSITE = 0.05  # Normals are refused if more than this share of neighbors face opposite ways in one place.
# A ball is too large if neighbors below its centers lie the other way by more than this share of their
# distance, for more than this share of links, at more than this share of centers; edges have up to a ninth.
TURNED = 0.25
GROWN = 0.012  # Without a tolerance, patches grow up to this mean deviation, as a share of the radius.
COARSEST = 0.1  # The tolerance is at most this share of the size: larger patches do not show the object.
# Contacts and surface are off each other by at most this share of the size. No evenly spread contacts are
# "ok" and off by more (python -m benchmarks.measured --even --first 3); without it some were, by up to 14 %.
MOST_OFF = 0.02
# Planes of contacts meet where they differ by this sine at least, and each passes by within this share of
# MOST_OFF: otherwise those of the two walls of a thin bowl would meet between these.
MEETING, MISSED = 0.15, 0.5
# A plane that another contact is in front of by more than this share, and not the other way around, encloses
# nothing: without normals, those of an L's edge are of both its walls (seed 87 of --full 100).
CONTRADICTED = 0.25


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
    felt, noise = _felt(contours_or_strokes, noise, largest)
    contacts, doubts = _contacts(*felt, outward, noise)
    tree = cKDTree(contacts.points)
    some = np.linspace(0, len(contacts.points) - 1, SOME_PLACES).astype(np.intp)
    # The smallest patches have FEWEST contacts, and more where these lie in lines.
    fewest = np.median(tree.query(contacts.points[some], FEWEST)[0][:, -1])
    radius = max(float(fewest), float(np.median(contacts.reach)))
    gap = float(np.spacing(np.abs(contacts.points).max()))
    if gap > TOUCH_ROUNDING * radius:
        raise too_coarse(gap, radius)
    cloud = _Cloud(contacts, tree, graph_of(contacts.links), noise, largest)
    yield 0.0
    fit_noise = cloud.fit_noise(some.tolist(), radius)
    cloud = cloud._replace(noise=noise or fit_noise)
    patches, charts = yield from _patches(cloud, radius)
    reference = yield from part_of(joined_surface(patches, charts, largest, contacts.off), 1.0, 1.0)
    uncovered = uncovered_places(reference, charts)
    atlas = Atlas(tuple(patches), charts, reference, largest, uncovered, contacts=contacts)
    return (yield from _judged(atlas, cloud, doubts, 0.0 if noise else fit_noise, radius))


def _judged(
    atlas: Atlas, cloud: "_Cloud", doubts: list[Doubt], fit_noise: float, radius: float
) -> Generator[float, None, Atlas]:
    """The atlas with its doubts: these, and those of how contacts and surface are off each other; yields 1.

    fit_noise : that of the fit, or 0 if one was given
    radius : the smallest one of a patch
    """
    contacts, mesh, most = cloud.contacts, atlas.reference.mesh, atlas.tolerance or GROWN * radius
    off_surface = partial(_off_surface, atlas, cloud.noise, most)
    distances, far, is_turned = yield from chunked(off_surface, PLACES_AT_ONCE, 1.0, *contacts[:2])
    limit = MOST_OFF * float(np.ptp(contacts.points, axis=0).max())
    off_enclosed = partial(_off_enclosed, atlas, cloud, limit)
    between, spots, alike = yield from chunked(off_enclosed, PLACES_AT_ONCE, 1.0, mesh.vertices, mesh.normals)
    worst, widest = _largest_cluster(far, distances, cloud.graph), np.argsort(-between, kind="stable")
    surface = list(beyond("noise", fit_noise, most))
    if not atlas.uncovered and atlas.reference.indicator.values[0, 0, 0] > 0.0:  # It is inside there.
        surface.append(Doubt("cavity"))
    off, agreement = _agreement(contacts, distances, far, worst, is_turned, limit, fit_noise)
    gaps = widest[:0] if atlas.uncovered else widest[between[widest] > limit]
    sparse = [Doubt("sparse", between[i], limit, (place_text(spots[[i]]),)) for i in gaps[:1]]
    # A finger may miss the first of these, so others follow.
    places = [(contacts.points[i], contacts.normals[i]) for i in worst[: len(off)]] + [
        (spots[i], contacts.normals[alike[i]]) for i in gaps
    ]
    return replace(
        atlas,
        contradictions=(*doubts, *surface, *off, *sparse),
        agreement=agreement,
        unexplained=tuple(place_at(*place, radius) for place in places),
    )


def _felt(
    given: Sequence[ArrayLike | Contour], noise: float | None, tolerance: float | None
) -> tuple[tuple[Array, Array, Array], float]:
    """The arguments of `_contacts`, all contacts, each once; and their noise.

    Raises ValueError for contacts that are too few, and for a noise or a tolerance that is large.
    """
    curves = [
        curve if isinstance(curve, Contour) else Contour(curve)  # type: ignore[arg-type]
        for curve in list_of("contours_or_strokes", given, object)  # type: ignore[arg-type]
    ]
    points = np.vstack([np.empty((0, 3)), *(curve.points for curve in curves)])
    once = np.sort(np.unique(points, axis=0, return_index=True)[1])
    points = points[once]
    if len(points) < FEWEST:
        raise ValueError(
            f"contacts: expected {FEWEST} or more at different places, got {len(points)}: feel more of the "
            "object, or reconstruct a single patch from curves through a point"
        )
    size = float(np.ptp(points, axis=0).max())
    if size < FEWEST * SMALLEST:
        raise ValueError(
            f"contacts: expected them at least {SMALLEST:g} apart, got nearer ones: use another unit of "
            "length"
        )
    noise = max(curve.noise or 0.0 for curve in curves) if noise is None else noise
    if noise > size:
        raise ValueError(f"noise: expected less than the size of what was felt, {size:.3g}, got {noise:.3g}")
    if tolerance is not None and tolerance > COARSEST * size:
        raise ValueError(
            f"tolerance: expected at most {COARSEST * size:.3g}, a tenth of the size, got {tolerance:.3g}"
        )
    balls = np.repeat([curve.ball or 0.0 for curve in curves], [len(curve.points) for curve in curves])
    normals = [0.0 * c.points + np.nan if c.normals is None else c.normals for c in curves]
    return (points, np.vstack(normals)[once], balls[once]), noise


def _contacts(
    points: Array, normals: Array, balls: Array, outward: ArrayLike | None, noise: float
) -> tuple[MeasuredContacts, list[Doubt]]:
    """Contacts with outward normals, and why these are in doubt, if they are.

    points, normals : (n, 3); normals as they were measured, or NaN
    balls : (n,), the radius of the ball whose center it is, or 0
    """
    up = None if outward is None else unit_vector("outward", outward)
    known, planes = np.isfinite(normals[:, 0]), planes_of(points, noise)
    normals[known] = unit_vectors("normals", normals[known])
    if not known.all():
        normals[~known] = oriented(points, planes, np.where(known[:, None], normals, 0.0), up)[~known]
    doubts = list(doubts_of(points, normals, planes.links))
    if known.all() and doubts and doubts[0].value > OPPOSITE:
        raise ValueError(
            "normals: expected those of neighboring contacts on one side, got opposite ones around "
            f"{doubts[0].words[0]}: turn all outward"
        )
    normals[~known] = sharpened(points, normals, planes)[~known]
    if balls.any():
        centers, points = points, points - balls[:, None] * normals
        doubts += _beyond_bend(centers, points, planes.links)
        planes = planes_of(points, noise)
    return MeasuredContacts(points, normals, planes.reach, planes.links), doubts


def _beyond_bend(centers: Array, contacts: Array, links: Indices) -> Iterator[Doubt]:
    """Whether a ball is larger than the bends of its centers (n, 3) at many of them.

    There kappa_center < -1 / r, and contacts (n, 3) lie the other way around than their centers.
    """
    ways, below = (points[links] - points[:, None] for points in (centers, contacts))
    beyond = (row_dot(ways, below) < -TURNED * row_dot(ways, ways)).mean(axis=1) > TURNED
    if beyond.mean() > TURNED:
        yield Doubt("ball", float(beyond.mean()), TURNED, (place_text(centers[beyond]),))


def _off_surface(
    atlas: Atlas, noise: float, most: float, points: Array, normals: Array
) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """Distances (n,) of contacts (n, 3) from the surface, which do not agree, and which face the other way.

    Deviations count up to `most`, that of patches, for where there is none they would explain anything.
    """
    distances, stds = atlas.distance(points)
    faces = atlas.reference.normals[atlas.reference.feet(points)[1]]
    far = too_far(distances, np.hypot(np.minimum(stds, most), noise))
    is_turned = row_dot(faces, normals) < -AGREE
    return np.abs(distances), far | is_turned, is_turned


def _off_enclosed(
    atlas: Atlas, cloud: "_Cloud", most: float, points: Array, normals: Array
) -> tuple[Array, Array, Indices]:
    """How far places (n, 3) of the surface are off what nearest contacts enclose, where, and the first, (n,).

    Between contacts the surface may be anywhere up to the plane of the nearest that faces alike, if any does:
    an edge that no contact is near is cut off by half of their distance. Where planes meet, the object may
    reach up to their corner, and a tip that is cut off is farther from the surface than the surface is from
    any plane. A corner counts if it is enclosed, too, so no other contact is in front of it.

    most : corners that are as near as this length do not count, and a place within it of a patch is on it
    """
    sheet = sheet_facing(atlas.charts, points, normals, most)
    sheets = np.where((sheet.rho < INSIDE)[:, None], sheet.normal, 0.0)
    planes, above, off, nearest = cloud.enclosing(points, normals, most, sheets)
    across = np.swapaxes(planes, 1, 2)
    inverses = np.linalg.pinv(across @ planes, rcond=MEETING**2, hermitian=True)
    moves = -np.einsum("nij,njk,nk->ni", inverses, across, above)
    missed = np.abs(above + row_dot(planes, moves[:, None])).max(axis=1)
    some = np.flatnonzero((row_dot(moves, moves) > most**2) & (missed < MISSED * most))
    corners, away = points + moves, np.zeros(len(points))
    _, _, corner_off, _ = cloud.enclosing(corners[some], normals[some], most, 0.0 * corners[some])
    some = some[corner_off < MISSED * most]
    away[some] = np.linalg.norm(atlas.reference.feet(corners[some])[0] - corners[some], axis=1)
    where = np.where((away > np.abs(off))[:, None], corners, points)
    return np.maximum(away, np.abs(off)), where, nearest


def _largest_cluster(far: NDArray[np.bool_], distances: Array, graph: Any) -> Indices:
    """The indices (k,) of most of those contacts (n,) that are side by side and off, the farthest first."""
    off = np.flatnonzero(far)
    pieces = pieces_of(graph, off)
    cluster = off[pieces == np.bincount(pieces, minlength=1).argmax()]
    return cluster[np.argsort(-distances[cluster], kind="stable")]


def _agreement(
    contacts: MeasuredContacts,
    distances: Array,
    far: NDArray[np.bool_],
    worst: Indices,
    is_turned: NDArray[np.bool_],
    limit: float,
    noise: float,
) -> tuple[list[Doubt], str]:
    """Whether more than a few contacts (n,) are far off the surface, given the worst cluster of them (k,).

    Few may be off up to the limit, as at sharp edges. But more side by side than a quadric has coefficients
    show a shape. Also how contacts agree if there is no doubt.

    noise : that of the fit, or 0 if one was given
    """
    message = "The surface is closed, and all contacts agree with it."
    if far.any():
        place = place_text(contacts.points[worst[:1]])
        count, most = np.count_nonzero(far), float(distances[far].max())
        if far.mean() > FEW or len(worst) > len(QUADRIC) or most > limit:
            code = "confused" if is_turned[worst].any() else "off_surface"
            return [Doubt(code, most, words=(f"{count} of {len(far)} contacts", place))], ""
        message = (
            f"The surface is closed. All but {count} of {len(far)} contacts agree with it, which are off by "
            f"up to {most:.2g}, most together around {place}."
        )
    if noise:
        message += f" No noise was given; that of the fit is {noise:.2g}."
    return [], message


class _Cloud(NamedTuple):
    """Contacts, their KD-tree and graph of links, the noise, and the deviation up to which patches grow."""

    contacts: MeasuredContacts
    tree: Any
    graph: Any
    noise: float
    largest: float | None

    def enclosing(
        self, points: Array, normals: Array, most: float, sheets: Array
    ) -> tuple[Array, Array, Array, Indices]:
        """The planes by which contacts near places (n, 3) with normals (n, 3) enclose the object there.

        Around a convex edge a place is behind the planes of the nearest contacts, and around a concave edge
        before one of them. So the foot of an edge that is cut off is on its wall, and a fin along one wall is
        off the other. Contacts agree with a patch that faces as they do.

        Returns the normals (n, k, 3) of those contacts whose planes enclose, and how far above these planes
        the places are, (n, k), 0 for other contacts; how far above what is enclosed they are, (n,); and the
        first contact of each place, (n,), which faces alike if any does.

        most : planes that a contact is in front of by more than CONTRADICTED of this length enclose nothing
        sheets : (n, 3), normals of the patches that the places are on, or 0
        """
        near, contacts = self.tree.query(points, ABREAST)[1], self.contacts
        is_alike = np.einsum("nki,ni->nk", contacts.normals[near], normals) > AGREE
        near = np.take_along_axis(near, np.argsort(~is_alike, axis=1, kind="stable"), axis=1)
        places, ups = contacts.points[near], contacts.normals[near]
        above = row_dot(ups, points[:, None] - places)
        # Walls meet convexly if contacts of both are behind the other's plane, concavely if in front of it.
        fronts = row_dot(ups[:, :, None], places[:, None] - places[:, :, None])
        is_front = fronts > THROUGH * self.noise
        is_wrong = ((fronts > CONTRADICTED * most) & ~np.swapaxes(is_front, 1, 2)).any(axis=2)
        is_wrong[:, 0] = False
        is_convex = ~(is_front[:, 0] | is_front[:, :, 0] | is_wrong)
        is_concave = is_front[:, 0] & is_front[:, :, 0]
        off = np.where(np.einsum("nki,ni->nk", ups, sheets) > AGREE, 0.0, above)
        front = np.where(is_convex, off, -np.inf).max(axis=1)
        off = np.minimum(front, np.where(is_concave, off, np.inf).min(axis=1))
        return np.where(is_convex[..., None], ups, 0.0), np.where(is_convex, above, 0.0), off, near[:, 0]

    def same_sheet(self, i: int, radius: float) -> Indices:
        """Those contacts around contact i that face the same way and are linked with it, so of its wall."""
        near = np.array(self.tree.query_ball_point(self.contacts.points[i], radius))
        near = near[self.contacts.normals[near] @ self.contacts.normals[i] > FACING]
        pieces = pieces_of(self.graph, near)
        return near[pieces == pieces[near == i]]

    def middle(self, i: int, radius: float) -> int:
        """The contact nearest to the mean of those around contact i that are of its wall.

        Next to an edge no patch has contacts all around, but one farther in reaches the edge, too.
        """
        near = self.same_sheet(i, radius)
        off = self.contacts.points[near] - self.contacts.points[near].mean(axis=0)
        return int(near[np.argmin(row_dot(off, off))])

    def patches(self, places: Sequence[int], radius: float) -> list[Reconstruction | None]:
        """The patch of those contacts around each place that are of its wall; None where they carry none."""
        points, normals = self.contacts.points[places], self.contacts.normals[places]
        strokes = [[self.contacts.points[self.same_sheet(i, radius)]] for i in places]
        none: list[list[Contour]] = [[] for _ in places]
        results = reconstruct_many(points, none, outward=normals, strokes_list=strokes, noise=self.noise)
        return [r if isinstance(r, Reconstruction) else None for r in results]

    def rim(self, i: int, r: Reconstruction) -> Array:
        """The radii (AZIMUTHS,) of a patch, in unit radius, to where its wall meets another or was not felt.

        Its domain is a hull of contacts, which ends at the last one before an edge, and may span what was not
        felt, such as a notch or a hole. Beyond an edge it is on the other side of the plane of the nearest
        contact of a wall across it than its own nearest one, which may be nearer: otherwise a fin goes on
        along the wall. The patch goes on beyond its domain only to an edge that is near a contact.
        """
        from scipy.spatial import cKDTree

        points, own, every = self.contacts.points, self.same_sheet(i, 2.0 * r.radius), np.arange(AZIMUTHS)
        # Contact i stands for those of other walls where there are none.
        others = np.append(np.setdiff1d(self.tree.query_ball_point(points[i], 2.0 * r.radius), own), i)
        own_tree, other_tree = (cKDTree(points[some]) for some in (own, others))
        domain, turns = r.domain.radii(AZIMUTHS) / r.radius, 2.0 * np.pi * every / AZIMUTHS
        low, high = np.zeros(AZIMUTHS), domain + BETWEEN * self.contacts.reach[i] / r.radius
        for _ in range(RAY_ROUNDS):
            rays = np.linspace(low, high, RAY_PLACES + 1)[1:]
            x, y = r.radius * (rays * np.stack([np.cos(turns), np.sin(turns)])[:, None]).reshape(2, -1)
            places = r.frame.to_world(np.stack([x, y, r.height(x, y)], axis=1))
            (away, mine), (to_other, other) = own_tree.query(places), other_tree.query(places)
            mine, other = own[mine], others[other]
            normals = self.contacts.normals[other]
            above, own_above = (row_dot(normals, some - points[other]) for some in (places, points[mine]))
            is_other = np.abs(row_dot(normals, self.contacts.normals[mine])) < AGREE
            is_beyond = (is_other & (above * own_above < 0.0)).reshape(rays.shape)
            is_end = is_beyond | (away > BETWEEN * self.contacts.reach[mine]).reshape(rays.shape)
            is_end[-1] = True
            end = is_end.argmax(axis=0)
            low, high = np.vstack([low, rays])[end, every], rays[end, every]
        is_near = (
            np.minimum(away / self.contacts.reach[mine], to_other / self.contacts.reach[other]) < AT_EDGE
        )
        is_edge = is_beyond & is_near.reshape(rays.shape)
        rim = np.where(is_edge[end, every], low, np.minimum(low, domain))
        return np.maximum(rim, float(RAY_PLACES) ** -RAY_ROUNDS)  # Rays do not show less, and none is 0.

    def longest_sure(self, i: int, radii: list[float], last: int) -> tuple[Reconstruction | None, int]:
        """The largest sure patch around contact i, or None; which radius it has.

        Radii are tried from long to short, but only one longer than that of the last patch, for those of
        neighbors are of about one size. The smallest patch may be less certain than others.

        last : which of the radii the last patch had
        """
        for k in range(min(last + 1, len(radii) - 1), -1, -1):
            (r,) = self.patches([i], radii[k])
            is_certain = r is not None and (not k or r.mean_height_std <= (self.largest or GROWN * r.radius))
            if r is not None and is_certain and self.explains(r, self.same_sheet(i, radii[k])):
                return r, k
        return None, 0

    def explains(self, r: Reconstruction, some: Indices) -> bool:
        """Whether a patch explains some of the contacts, to which it was fitted, within their noise.

        What noise hides at each contact, such as a low step, the mean of neighbors shows. Contacts that are
        too far off do not count in it, for otherwise a single one hides the step; nor do their neighbors,
        for such a contact pulls the patch.
        """
        links, off = self.graph[some][:, some], self.distances(r, some)
        far = too_far(off, self.noise)
        next_is_far = links @ far
        near = np.where(far | next_is_far, 0.0, off)
        sums, counts = near + links @ near, 1 + links.sum(axis=1)
        return are_few(far, next_is_far) and not too_far(sums, self.noise * np.sqrt(counts)).any()

    def distances(self, r: Reconstruction, some: Indices) -> Array:
        """Distances (n,) of some of the contacts from a patch, measured from its tangent planes."""
        x, y, z = r.frame.to_local(self.contacts.points[some]).T
        surface = r.geometry.derivatives(x, y)
        return np.asarray(surface.normal[:, 2] * (z - surface.z))

    def fit_noise(self, some: list[int], radius: float) -> float:
        """The robust standard deviation of contacts from patches of this radius, at least MISFIT of that.

        some : the contacts (indices) at which patches are tried. Raises ValueError if none has one.
        """
        patches = [(i, r) for i, r in zip(some, self.patches(some, radius), strict=True) if r is not None]
        if not patches:
            raise ValueError(
                "contacts: expected others all around at least one of them, got "
                f"{len(some)} that were tried without: make strokes nearer to each other"
            )
        off = np.concatenate([self.distances(r, self.same_sheet(i, radius)) for i, r in patches])
        return max(1.4826 * float(np.median(np.abs(off))), MISFIT * radius)


def _patches(cloud: _Cloud, radius: float) -> Generator[float, None, tuple[list[Reconstruction], Charts]]:
    """Patches and their tables, as large as they may be, at contacts that no earlier one covers.

    radius : the smallest one of a patch

    Yields the share of the contacts that are done: covered, or without a sure patch.
    """
    points, radii, last = cloud.contacts.points, [radius * WIDENING**k for k in range(RADII)], RADII
    left, patches, tables = np.ones(len(points), dtype=bool), [], []
    for i in range(len(left)):
        if not left[i]:
            continue
        middle = cloud.middle(i, radius)
        r, last = cloud.longest_sure(middle, radii, last)
        left[cloud.same_sheet(i, PATCHES_APART * radius) if r is None else i] = False
        if r is not None:
            patches.append(r)
            tables.append(tabulate(r, cloud.rim(middle, r), deviations=True))
            chart, some = stacked([r], tables[-1:]), cloud.same_sheet(middle, PATCHES_APART * r.radius)
            x, y, _ = chart.local(points[some], np.arange(len(some)), np.zeros(len(some), dtype=np.intp))
            left[some] &= chart.shares(x, y, np.zeros(len(some), dtype=np.intp)) > INSIDE
        yield 1.0 - float(left.mean())
    if not patches:
        raise ValueError(
            f"noise: expected one that explains how contacts are off smooth patches, got {cloud.noise:.3g}: "
            "give a larger one, or leave it out"
        )
    return patches, stacked(patches, tables)
