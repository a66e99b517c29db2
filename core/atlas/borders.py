# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Borders of open sheets: where a finger feels the surface end, the mesh ends, too.

Not in the paper. A mesh without the triangles that no patch covers ends in a zigzag, some edges away from the
border of the surface. Corners of a border are where its lines meet, as in extended marching cubes (Kobbelt et
al. 2001) in the plane.
"""

from collections.abc import Callable, Generator
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..contours.contour import vector_of
from ..contours.finger import Contact
from ..triangles import LEAST_DIVISOR, SAME, normalized, row_dot, triangle_cross
from .charts import PLACES_AT_ONCE
from .connectivity import Indices, connected_pieces
from .curvature import SHARP
from .finger import Finger
from .meshing import Mesh

# python -m benchmarks.atlas judges these.
REACH, STEP = 6.0, 0.5  # A border is looked for within this many edges of the mesh's, in such steps,
HALVINGS = 8  # and then by this many halvings.
STRAIGHT = 0.1  # A border has a SHARP corner if it is straight on both sides to this share of an edge.
INWARD = 0.1  # Corners are felt this share of the way from there to the middle of the chord across them.
SMOOTHINGS = 3  # This often directions of a border become the means of their neighbors'.
UNFOLDINGS = 8  # Triangles that turn over are mended this often; nearly all are after one (test_borders).
NEAREST = 12  # The nearest segment is one of this many whose middles are nearest.
# Sides of the border below this share of an edge are one place. With 1e-6 the triangle of one turns over at a
SHORT = 0.01  # notch of an open sheet, with the kernels that OpenBLAS has for SkylakeX (test_borders).

# How far a surface is above points near some places, found in steps.
Offsets = Callable[[Array, Indices], Generator[float, None, Array]]


class Border(NamedTuple):
    """Where a surface ends: segments (k, 2, 3), directions out of it there (k, 3), corners (n, 3).

    The directions, called ways, lie in the surface, across its border, and are of any length.

    edge : that of the mesh from which a finger went on to it; patches end as far from it with any edge
    """

    segments: Array
    ways: Array
    corners: Array
    edge: float


def felt_border(finger: Finger, near: float, mesh: Mesh) -> Generator[float, None, Border]:
    """The border of the surface next to that of a mesh; yields 0 between its steps.

    near : the finger feels the surface at a place if it is within this length of that, along the normal
    """
    if mesh.is_closed:
        return Border(np.zeros((0, 2, 3)), np.zeros((0, 3)), np.zeros((0, 3)), 0.0)
    yield 0.0
    at, before, after, ways, normals = _border_frames(mesh)
    yield 0.0
    places = mesh.vertices[at]
    off = partial(_above, partial(finger.near, length=near), normals)
    lengths, ended = yield from _lengths(off, places, ways, STEP * mesh.edge)
    places = places + lengths[:, None] * ways
    places += np.nan_to_num((yield from off(places, np.arange(len(at)))))[:, None] * normals
    ahead = partial(finger.ahead, radius=2.0 * STEP * mesh.edge, s=STEP * mesh.edge)
    beyond = yield from _contacts(ahead, places, normals, ways)
    ended &= [contact is None for contact in beyond]  # With a contact ahead the surface only bends away.
    before, after = (side[ended[before] & ended[after]] for side in (before, after))
    corners, sharp = _corners(places, before, after, mesh.edge)
    a, b = places[before], places[after]
    middles = 0.5 * (a + b)
    above = yield from off(corners + INWARD * (middles - corners), before)
    above_middle = yield from off(middles, before)
    # At a corner that juts out the finger feels the surface at both places, at one that goes in, at neither.
    # Where the mesh has the corner already, both are on the border, and it may feel any.
    away = np.linalg.norm(corners[:, None] - np.stack([a, b], axis=1), axis=2).min(axis=1)
    sharp &= (np.isnan(above) == np.isnan(above_middle)) | (away < STRAIGHT * mesh.edge)
    corners += np.nan_to_num(above)[:, None] * normals[before]
    yield 0.0
    c, one, two = corners[sharp], ways[before], ways[after]
    starts, ends = np.concatenate([a[~sharp], a[sharp], c]), np.concatenate([b[~sharp], c, b[sharp]])
    outward = np.concatenate([(one + two)[~sharp], one[sharp], two[sharp]])
    return Border(np.stack([starts, ends], axis=1), outward, c, mesh.edge)


def _above(
    near: Callable[..., Contact | None], normals: Array, points: Array, which: Indices
) -> Generator[float, None, Array]:
    """How far the surface is above points (k, 3) next to places, (k,); NaN where it is not.

    normals : (n, 3), the normals at the places
    which : (k,), the place next to each point
    """
    contacts = yield from _contacts(near, points, normals[which])
    feet = np.array([np.full(3, np.nan) if contact is None else contact[0] for contact in contacts])
    return row_dot(feet.reshape(-1, 3) - points, normals[which])


def _contacts(
    touch: Callable[..., Contact | None], *vectors: Array
) -> Generator[float, None, list[Contact | None]]:
    """The contact of each touch, which takes a row of all the vectors (k, 3); yields 0 between its steps."""
    contacts = []
    for i, rows in enumerate(zip(*vectors, strict=True)):
        contacts.append(touch(*map(vector_of, rows)))
        if i % PLACES_AT_ONCE == PLACES_AT_ONCE - 1:
            yield 0.0
    return contacts


def _border_frames(mesh: Mesh) -> tuple[Indices, Indices, Indices, Array, Array]:
    """The vertices (n,) of a mesh's border, and the places (k,) among these of both ends of each side.

    Also the ways beyond the border and the normals there, (n, 3) each.
    """
    at, index = np.unique(mesh.border, return_inverse=True)
    before, after = index.reshape(-1, 2).T
    places = mesh.vertices[at]
    along = np.zeros_like(places)
    np.add.at(along, np.stack([before, after], axis=1), (places[after] - places[before])[:, None])
    for _ in range(SMOOTHINGS):
        total = along.copy()
        np.add.at(total, before, along[after])
        np.add.at(total, after, along[before])
        along = normalized(total)
    normals = mesh.normals[at]
    return at, before, after, np.cross(along, normals), normals


def _lengths(
    off: Offsets, places: Array, ways: Array, step: float
) -> Generator[float, None, tuple[Array, NDArray[np.bool_]]]:
    """Lengths (n,) along ways (n, 3) from places (n, 3) to the nearest end of a surface; whether it ends."""
    every, steps = np.arange(len(places)), step * np.arange(-REACH / STEP, REACH / STEP + 1.0)
    trials = places[:, None] + steps[:, None] * ways[:, None]
    above = yield from off(trials.reshape(-1, 3), every.repeat(len(steps)))
    is_met = ~np.isnan(above).reshape(len(places), -1)
    is_end = is_met[:, :-1] & ~is_met[:, 1:]
    low = steps[np.where(is_end, np.abs(steps[:-1] + 0.5 * step), np.inf).argmin(axis=1)]
    high = low + step
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        met = ~np.isnan((yield from off(places + middle[:, None] * ways, every)))
        low, high = np.where(met, middle, low), np.where(met, high, middle)
    return low, is_end.any(axis=1)


def _corners(places: Array, before: Indices, after: Indices, edge: float) -> tuple[Array, NDArray[np.bool_]]:
    """Where the lines of a border on both sides of its segments meet, (k, 3), and whether they do, (k,)."""
    previous, following = (np.arange(len(places)) for _ in range(2))
    previous[after], following[before] = before, after
    meet, sides = np.ones(len(before), dtype=bool), []
    # The ends of a segment may be off the lines that meet at a corner, so lines are those of the two segments
    # beyond. Where the border ends before, there are none.
    for end, neighbor in ((before, previous), (after, following)):
        start = places[neighbor[end]]
        along = normalized(start - places[neighbor[neighbor[end]]])
        foot = start + row_dot(places[end] - start, along)[:, None] * along
        meet &= np.linalg.norm(places[end] - foot, axis=1) < STRAIGHT * edge
        sides += [foot, along]
    a, u, b, v = sides
    cosine, along_u, along_v = row_dot(u, v), row_dot(b - a, u), row_dot(b - a, v)
    squared_sine = np.maximum(1.0 - cosine**2, LEAST_DIVISOR)
    s, t = (along_u - cosine * along_v) / squared_sine, (cosine * along_u - along_v) / squared_sine
    meet &= (np.abs(cosine) < SHARP) & u.any(axis=1) & v.any(axis=1)
    meet &= (np.minimum(s, t) > -STRAIGHT * edge) & (np.maximum(s, t) < REACH * edge)
    corners = 0.5 * (a + s[:, None] * u + b + t[:, None] * v)
    return np.where(meet[:, None], corners, places[before]), meet


def snapped_to_border(mesh: Mesh, border: Border) -> Mesh:
    """The mesh with the vertices of its border on that of the surface.

    Triangles whose middles are beyond that are left out first, and those that jut out. Without all that have
    a vertex beyond it the tip of a narrow corner would hang by a single vertex, and its corner would be lost.
    """
    if not len(border.segments):
        return mesh
    reach = REACH * max(mesh.edge, border.edge)
    middles = mesh.vertices[mesh.triangles].mean(axis=1)
    feet, ways = _feet(border, middles)
    off = middles - feet
    out = (row_dot(off, ways) > 0.0) & (np.linalg.norm(off, axis=1) < reach)
    mesh = mesh.chosen(~out)
    while (ears := mesh.sides_on_border > 1).any():
        mesh = mesh.chosen(~ears)
    if not len(mesh.border):  # Nothing is left of a small mesh.
        return mesh
    at, _, _, toward, _ = _border_frames(mesh)
    vertices = mesh.vertices.copy()
    feet, ways = _feet(border, vertices[at])
    # Where the mesh ends though the surface goes on, the way beyond is another; in front of a corner it is
    # between those of both sides, and that of a zigzag is to one side of it.
    on = (np.linalg.norm(feet - vertices[at], axis=1) < reach) & (row_dot(toward, ways) > 0.0)
    vertices[at[on]] = feet[on]
    snapped, fixed = _cornered(mesh._replace(vertices=vertices), border.corners, reach)
    return _welded(_unfolded(snapped, mesh, fixed))


def _unfolded(mesh: Mesh, before: Mesh, fixed: Indices) -> Mesh:
    """The mesh without triangles that turned over when vertices of its border moved.

    Of such a triangle the ends of a side on the border meet in its middle, or where one of them is fixed, and
    the inner vertices move to the means of their neighbors.

    before : the same triangles before that
    fixed : (n,), the vertices at corners, without which the border would not go there
    """
    across, vertices = triangle_cross(before.vertices[mesh.triangles]), mesh.vertices.copy()
    sides = mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    inner = np.ones(len(vertices), dtype=bool)
    inner[mesh.border] = False
    on_border = ~inner[sides].any(axis=1) & np.isin(sides @ (len(inner), 1), mesh.border @ (len(inner), 1))
    for _ in range(UNFOLDINGS):
        over = row_dot(triangle_cross(vertices[mesh.triangles]), across) < 0.0
        meeting = sides[on_border & over.repeat(3)]
        ends, stay = vertices[meeting], np.isin(meeting, fixed)[..., None]
        places = np.where(stay[:, ::-1], ends[:, ::-1], ends.mean(axis=1, keepdims=True))
        vertices[meeting] = np.where(stay, ends, places)
        some = np.unique(mesh.triangles[over])
        some = some[inner[some]]
        if not len(some):
            break
        one, other = np.concatenate([sides, sides[:, ::-1]])[np.isin(np.append(*sides.T), some)].T
        sums = [np.bincount(one, column, len(inner)) for column in vertices[other].T]
        vertices[some] = np.stack(sums, axis=1)[some] / np.bincount(one)[some, None]
    return mesh._replace(vertices=vertices)


def _welded(mesh: Mesh) -> Mesh:
    """The mesh without sides of its border that are SHORT, as where some vertices move into a corner.

    Of what is one place the first vertex stays. Triangles that would lie back to back are left out.
    """
    a, b = mesh.border.T
    same = np.linalg.norm(mesh.vertices[a] - mesh.vertices[b], axis=1) < SHORT * mesh.edge
    _, place = connected_pieces(a[same], b[same], len(mesh.vertices))
    triangles = np.unique(place, return_index=True)[1][place][mesh.triangles]
    _, index, counts = np.unique(np.sort(triangles, axis=1), axis=0, return_inverse=True, return_counts=True)
    # A vertex with three neighbors, of which two are welded, leaves two triangles back to back.
    some = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1) & (counts[index.ravel()] == 1)
    return mesh._replace(triangles=triangles).chosen(some)


def _cornered(mesh: Mesh, corners: Array, reach: float) -> tuple[Mesh, Indices]:
    """The mesh whose border has a vertex at corners (n, 3) within reach, and these vertices (k,).

    It is the nearer end of the side that passes a corner by.
    """
    sides, vertices, row = mesh.border, mesh.vertices.copy(), np.arange(len(corners))
    ends = vertices[sides]
    away = np.linalg.norm(corners[:, None, None] - ends, axis=3)
    best = np.argmin(away.sum(axis=2) - np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), axis=1)
    away, moved = away[row, best].min(axis=1), sides[best, away[row, best].argmin(axis=1)]
    is_near = away < reach
    vertices[moved[is_near]] = corners[is_near]
    return mesh._replace(vertices=vertices), moved[is_near]


def _feet(border: Border, points: Array) -> tuple[Array, Array]:
    """The places of a border nearest to points (n, 3), and the ways beyond it there, (n, 3) each."""
    from scipy.spatial import cKDTree

    segments = border.segments
    count = min(NEAREST, len(segments))
    near = cKDTree(segments.mean(axis=1)).query(points, count)[1].reshape(len(points), count)
    a, along = segments[near, 0], segments[near, 1] - segments[near, 0]
    shares = row_dot(points[:, None] - a, along) / np.maximum(row_dot(along, along), LEAST_DIVISOR)
    feet = a + np.clip(shares, 0.0, 1.0)[..., None] * along
    away = np.linalg.norm(points[:, None] - feet, axis=2)
    best = np.argmin(away, axis=1)
    # At a corner the ways beyond both of its segments count.
    as_near = away <= (1.0 + SAME) * away.min(axis=1, keepdims=True)
    ways = np.where(as_near[..., None], border.ways[near], 0.0).sum(axis=1)
    return feet[np.arange(len(points)), best], normalized(ways)
