# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Outward normals of contacts without normals: planes of neighbors, whose sides follow from each other.

Hoppe et al. 1992: a minimal spanning tree of neighbors carries the outer side from one contact to the next.
Of two contacts on an arc one normal is the mirror image of the other in the plane between them (Koenig and
Gumhold 2009), also across a sharp edge, a wall or a gap.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..triangles import normalized, row_dot
from ..verdict import Doubt
from .connectivity import Indices, connected_pieces
from .field import AGREE

# python -m benchmarks.measured --orientation judges these.
FEWEST, MOST, MORE = 8, 600, 1.5  # The numbers of a plane's neighbors, and their growth until it is certain:
ACROSS = 0.15  # they do not lie in a line if this share of the larger variance is across,
FLAT = 0.05  # and lie in a plane if at most this share of the smaller one is off it,
NOISES = 8.0  # and they reach this many deviations of a contact far.
FLATTER, THROUGH = 0.5, 2.0  # A neighbor's plane is flatter by this factor, at most this many deviations off,
SHARPENINGS = 3  # and is passed on from neighbor to neighbor this often.
LINKS = 12  # A contact is linked with this many of its neighbors.
AT_ONCE = 20_000  # This many contacts are taken at once.
BEND = 0.1  # Links along which the surface goes on come before those around edges and across gaps.
SAME_PLACE = 2.0  # Neighbors share a place if the chord's share is up to this many times the usual one.
DOUBTED = 0.02  # At most this share of neighbors may face opposite ways in one place (tests: test_measured).
CLOSED = 0.15  # Contacts show their outer side if the mean of their winding numbers is more.
DECISIVE = 0.3  # Against winding numbers a hint decides if its mean cosine to the normals is more.
SMALL = 0.1  # Together at least this share of the contacts is turned,
CLEAR = 0.5  # by which the square by which winding numbers are off a half falls so much for each of them.
PROBES = 300  # Winding numbers are computed at this many contacts.


class Planes(NamedTuple):
    """Planes through the neighbors of n contacts.

    normals : (n, 3), unit vectors to either side
    reach : (n,), how far these neighbors reach
    areas : (n,), the area of each contact
    rms : (n,), how far neighbors are off the plane, at least the noise
    links : (n, LINKS), some of them
    """

    normals: Array
    reach: Array
    areas: Array
    rms: Array
    links: Indices


def planes_of(points: Array, noise: float) -> Planes:
    """The planes of the fewest neighbors of contacts (n, 3) that show one, not a line or several walls."""
    from scipy.spatial import cKDTree

    tree, n = cKDTree(points), len(points)
    normals, (reach, areas, rms), best = np.zeros((n, 3)), np.zeros((3, n)), np.full(n, np.inf)
    links = np.zeros((n, LINKS), dtype=np.intp)
    left, count = np.arange(n), min(FEWEST, n)
    while len(left):
        for some in np.array_split(left, len(left) * count // (AT_ONCE * FEWEST) + 1):
            away, near = tree.query(points[some], count)
            off = points[near] - points[near].mean(axis=1, keepdims=True)
            values, vectors = np.linalg.eigh(np.swapaxes(off, 1, 2) @ off)
            bulk = np.maximum(values[:, 1], np.finfo(float).tiny)
            # Where nothing shows a plane it is the flattest one, or at least across a line.
            off_plane = np.where(bulk > ACROSS * values[:, 2], values[:, 0] / bulk, 1e3 - count)
            better = off_plane < best[some]
            which = some[better]
            best[which], normals[which] = off_plane[better], vectors[better][..., 0]
            reach[which] = away[better, -1]
            areas[which] = np.pi * reach[which] ** 2 / count
            rms[which] = np.sqrt(np.maximum(values[better, 0], 0.0) / count)
            links[which] = near[better][:, np.linspace(1, count - 1, LINKS).astype(np.intp)]
        left = (
            left[(best[left] > FLAT) | (reach[left] < NOISES * noise)] if count < min(n, MOST) else left[:0]
        )
        count = min(int(MORE * count), n)
    return Planes(normals, reach, areas, np.maximum(rms, noise), links)


def sharpened(points: Array, normals: Array, planes: Planes) -> Array:
    """Outward normals (n, 3) of the planes of contacts or, near an edge, of a neighbor's plane.

    Near an edge the neighbors of a contact are on two walls, and their plane is on neither. A contact farther
    from the edge has all its neighbors on one wall, in a plane that passes through the former contact, too.

    normals : (n, 3), outward: measured ones, or those of the contacts' own planes
    """
    links, rms, every = planes.links, planes.rms, np.arange(len(points))
    for _ in range(SHARPENINGS):
        off = np.abs(row_dot(normals[links], points[:, None] - points[links]))
        is_unfit = (rms[links] > FLATTER * rms[:, None]) | (off > THROUGH * rms[links])
        off = np.where(is_unfit, np.inf, np.hypot(off, rms[links]))
        best = links[every, np.argmin(off, axis=1)]
        is_fit = np.isfinite(off.min(axis=1))
        others = normals[best] * np.copysign(1.0, row_dot(normals[best], normals))[:, None]
        normals, rms = np.where(is_fit[:, None], others, normals), np.where(is_fit, rms[best], rms)
    return normals


def reflection_agreement(points: Array, normals: Array, i: Indices, j: Indices) -> tuple[Array, Array]:
    """Cosines (m,) between normals j and normals i mirrored in the plane between both contacts.

    Also the larger absolute cosine between a normal and the way from one contact to the other, (m,).
    """
    way = normalized(points[j] - points[i])
    a, b = (row_dot(normals[k], way) for k in (i, j))
    return row_dot(normals[i], normals[j]) - 2.0 * a * b, np.maximum(np.abs(a), np.abs(b))


def oriented(points: Array, planes: Planes, known: Array | None = None, up: Array | None = None) -> Array:
    """Outward unit normals (n, 3) of points (n, 3) with planes.

    known : (n, 3), measured unit normals; 0 where there are none
    up : (3,), a hint, a direction to the outer side

    Raises ValueError if nothing tells the outer side.
    """
    i, j = np.repeat(np.arange(len(points)), LINKS), planes.links.ravel()
    # Winding numbers choose between the signs of pieces, so any link between these will do.
    roots = np.unique(connected_pieces(i, j, len(points))[1], return_index=True)[1]
    i, j = np.append(i, np.zeros_like(roots[1:])), np.append(j, roots[1:])
    sides, order, ends = _propagated_signs(points, planes.normals, i, j)
    normals = sides[:, None] * planes.normals
    is_root = np.isin(order, roots)
    turns, number = _winding_signs(points[order], normals[order], planes.areas[order], ends, is_root)
    normals[order] *= turns[:, None]
    return normals * _global_sign(normals, known, up, number)


def _propagated_signs(
    points: Array, normals: Array, i: Indices, j: Indices
) -> tuple[Array, Indices, Indices]:
    """The sides (n,), 1 or -1, of normals (n, 3) that follow from the first along the minimal tree of links.

    Also the contacts (n,) in an order in which all that follow from one come after it, and where these end,
    (n,).
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import depth_first_order, minimum_spanning_tree

    n, (cosine, bend) = len(points), reflection_agreement(points, normals, i, j)
    weights = 1e-6 + 1.0 - np.abs(cosine) + BEND * bend**2
    # Neighbors that have each other as a neighbor count twice, so they are more likely of one wall.
    votes = coo_matrix((cosine / weights, (np.minimum(i, j), np.maximum(i, j))), (n, n)).tocsr()
    votes.sum_duplicates()
    votes.data = -1.0 - np.abs(votes.data)  # The largest come first; none is 0, which would be no link.
    order, before = depth_first_order(minimum_spanning_tree(votes), 0, directed=False)
    cosine, _ = reflection_agreement(points, normals, before[order[1:]], order[1:])
    links = list(zip(order[1:].tolist(), before[order[1:]].tolist(), cosine.tolist(), strict=True))
    sides, counts = [1.0] * n, [1] * n
    for at, past, same in links:
        sides[at] = sides[past] if same > 0.0 else -sides[past]
    for at, past, _ in reversed(links):
        counts[past] += counts[at]
    return np.array(sides), order, np.arange(n) + np.array(counts)[order]


def _winding_signs(
    points: Array, normals: Array, areas: Array, ends: Indices, is_root: NDArray[np.bool_]
) -> tuple[Array, float]:
    """The signs (n,) of contacts that bring winding numbers at contacts nearest to a half; their mean.

    On a closed surface the winding number is 1 inside, 0 outside and a half on it (Barill et al. 2018). One
    link of the tree after another turns all that follows from it, or all else, as long as the mean square by
    which winding numbers are off a half falls by CLEAR for each contact that is turned.

    points, normals : (n, 3), in the order of the tree
    ends : (n,), where what follows from each contact ends
    is_root : (n,), which contacts a piece follows from
    """
    n = len(points)
    counts = ends - np.arange(n)
    starts = np.flatnonzero((counts >= SMALL * n) & (counts <= (1.0 - SMALL) * n) | is_root)
    ends, counts = ends[starts], counts[starts]
    probes = np.random.default_rng(0).permutation(n)[:PROBES]
    cuts = np.union1d(starts, ends)
    first, last = np.searchsorted(cuts, starts), np.searchsorted(cuts, ends)
    parts, signs = np.zeros((len(probes), len(cuts))), np.ones(n)
    for k, at in enumerate(probes):
        off = points - points[at]
        away = np.maximum(np.linalg.norm(off, axis=1), np.sqrt(areas[at]))
        solid_angles = areas / away**2 * row_dot(off, normals) / away
        parts[k, 1:] = np.add.reduceat(solid_angles, cuts[:-1]) / (4.0 * np.pi)
    least = np.maximum(CLEAR * np.minimum(counts, n - counts) / n, 1e-9)
    while True:
        sums = np.cumsum(parts, axis=1)
        total, numbers = sums[:, -1:], sums[:, last] - sums[:, first]
        falls = _off_half(total) - _off_half(total - 2.0 * numbers)
        best = np.argmax(np.where(falls < least, 0.0, falls))
        if falls[best] < least[best]:
            return signs * np.copysign(1.0, total.mean()), float(abs(total.mean()))
        signs[starts[best] : ends[best]] *= -1.0
        parts[:, first[best] + 1 : last[best] + 1] *= -1.0


def _off_half(numbers: Array) -> Array:
    """The mean squares by which columns of winding numbers (p, m) are off a half, or all off minus a half.

    They are less by a quarter, the square of a half.
    """
    return (numbers**2).mean(axis=0) - np.abs(numbers.mean(axis=0))


def _global_sign(normals: Array, known: Array | None, up: Array | None, winding: float) -> float:
    """1, or -1 if normals (n, 3) face inward, as measured normals or a hint `up` have it.

    Without measured normals they face outward already if the mean winding number shows a closed surface,
    unless the hint is DECISIVE; else any hint decides. Raises ValueError without one.
    """
    if known is not None and known.any():
        return float(np.copysign(1.0, row_dot(known, normals).sum()))
    mean = 0.0 if up is None else float((normals @ up).mean())
    if winding > CLOSED and abs(mean) < DECISIVE:
        return 1.0
    if up is None:
        raise ValueError(
            "outward: expected a direction where contacts have no normals and do not close around an object, "
            "got none"
        )
    return float(np.copysign(1.0, mean))


def doubts_of(points: Array, normals: Array, links: Indices) -> Iterator[Doubt]:
    """Whether outward normals (n, 3) of many linked contacts (n, k) face opposite ways in one place.

    For points p1 and p2 of a sphere with normals n1 and n2, (n1 + n2) . (p2 - p1) = 0, and nearly so on any
    smooth surface. If n2 has the wrong sign, (n1 - n2) . (p2 - p1) is as small. For the two sides of a wall,
    which rightly face opposite ways, it is twice the thickness.
    """
    chords, others = points[links] - points[:, None], normals[links]
    facing = row_dot(normals[:, None], others)
    apart = np.abs(row_dot(chords, normals[:, None] + np.copysign(1.0, facing)[..., None] * others))
    usual = np.median(np.append(apart[facing > AGREE], 0.0))
    wrong = (facing < -AGREE) & (apart <= SAME_PLACE * usual)
    if wrong.mean() > DOUBTED:
        yield Doubt("opposed", float(wrong.mean()), DOUBTED, (place_text(points[wrong.any(axis=1)]),))


def place_text(points: Array) -> str:
    """The one of points (n, 3) that is nearest to their median, as text in a sentence."""
    away = np.linalg.norm(points - np.median(points, axis=0), axis=1)
    return "(" + ", ".join(f"{x:.3g}" for x in points[np.argmin(away)]) + ")"
