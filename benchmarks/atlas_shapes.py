# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole objects as people make them: creases, thin walls, gaps and cavities, each from several starts.

`python -m benchmarks.atlas --shapes [--only NAME] [--finest T] [--coarsest T] [--starts N] [--first START]
[--places N]`, from the root of a checkout, prints one Markdown table and, as each run ends, a line about it
on standard error. Objects have the size 1, and contacts a noise of .0005. A run begins in the middle of a
face that is chosen by area; the number of the start seeds that and the touches. A run is right if its mesh
has no open edge, no edge of three triangles, and the Euler number and pieces of the object. The hollow ball
is touched at places of both of its shells, because no finger gets from one to the other; nothing searches
there for what was not felt, or checks the surface.

Distances are of ten thousand points of the object from the mesh (there), and of as many of the mesh from the
object (back), in tolerances: 99 % of them are within the first, and all within the farthest. Of places in the
box around the object, which is wider by a tenth of the size on each side, those with a finite deviation are
judged: a sign is wrong where it counts if the object is farther from the place than five deviations. A run is
a wrong ok if its status is "ok" and its mesh is not right. Screened Poisson has the contacts on the curves of
the same touches.
"""

import sys
from typing import NamedTuple

import numpy as np

import core
from core.triangles import triangle_cross
from tests import solids

from . import machine, scan_files, table, timed
from .real import Scan
from .whole import (
    EDGE,
    NOISE,
    Rays,
    away,
    contacts_of,
    poisson,
    put_together,
    spread,
    touched_all_over,
    tree_of,
)

TOLERANCES = (0.002, 0.008)
THINNEST = 10.0  # Objects are touched with a tolerance if no wall is thinner than this many of it.
GAP = 10.0  # Two balls are this many tolerances from each other.
SECTIONS = 128  # Round objects have this many facets around their axis.
# Balls have more: 128 facets are off a ball by the deviation of a patch, and finer than its knots.
BALL_SECTIONS = 256
FILLET = 12  # A fillet has this many facets across.
SHELLS = 160  # The hollow ball is touched at this many places.
SAMPLES = 10_000  # Distances are of this many points.
SURE = 5.0  # A wrong sign counts if the object is farther away than this many deviations.
OFF_STDS, OFF = 8.0, 0.005  # Distances are off if they are by more deviations and by more of the size.
DEPTH, WEIGHT = 8, 4.0  # The settings of screened Poisson.
# Rays along these ways count the walls around a place; no face of an object is along them.
WAYS = ((0.36, 0.48, 0.8), (-0.64, 0.6, -0.48), (0.28, -0.96, 0.02))


class Made(Rays):
    """A mesh of size 1."""

    def __init__(self, name, vertices, triangles):
        vertices = np.asarray(vertices, dtype=float)
        self.name, self.triangles = name, np.asarray(triangles)
        self.vertices = vertices / np.ptp(vertices, axis=0).max()
        self.topology = solids.topology(self.triangles)
        super().__init__(self.vertices, self.triangles)

    def start(self, number):
        """The middle of a random face and the normal there, (3,) each."""
        corners = self.vertices[self.triangles]
        across = triangle_cross(corners)
        areas = np.linalg.norm(across, axis=1)
        face = np.random.default_rng(100 + number).choice(len(areas), p=areas / areas.sum())
        return corners[face].mean(axis=0), across[face] / areas[face]

    def points(self, count, seed):
        """Random points (count, 3) by area, and the normals (count, 3) there."""
        return core.scattered(self.vertices, self.triangles, count, np.random.default_rng(seed))

    def distances(self, places):
        """Distances (n,) of places (n, 3), which are negative inside."""
        return away(self.tree, places) * np.where(self.is_inside(places), -1.0, 1.0)

    def is_inside(self, points):
        """Whether points (n, 3) are inside: so say two of three rays, by the walls that they cross."""
        return np.array([sum(self._crossed(p, way) % 2 for way in WAYS) > 1 for p in points], dtype=bool)

    def _crossed(self, point, way):
        """How many walls a ray crosses."""
        count, at, way = 0, np.array(point), np.array(way) / np.linalg.norm(way)
        while (hit := self.tree.ray_cast(at, way)[0]) is not None:
            count, at = count + 1, np.array(hit) + 1e-6 * way
        return count


def things(makers, only):
    """Yields the objects of functions by name, those with `only` in their names."""
    yield from (Made(name, *make()) for name, make in makers.items() if only in name)


# Objects ---------------------------------------------------------------------------------------------


def extruded(polygon, cap, depth):
    """Vertices and triangles of a polygon (n, 2), counterclockwise, that is pulled along z.

    cap : triangles (m, 3) of the polygon
    """
    flat, cap, n = np.array(polygon, dtype=float), np.array(cap), len(polygon)
    vertices = np.vstack([np.column_stack([flat, np.full(n, z)]) for z in (0.0, depth)])
    one, two = np.arange(n), np.roll(np.arange(n), -1)
    sides = np.vstack([np.column_stack([one, two, n + two]), np.column_stack([one, n + two, n + one])])
    return vertices, np.vstack([cap[:, ::-1], n + cap, sides])


def box(a, b, c):
    return extruded([(0, 0), (a, 0), (a, b), (0, b)], [(0, 1, 2), (0, 2, 3)], c)


def filleted(a, b, c, radius):
    """A box whose edges and corners are rounded: a ball of FILLET facets a quarter, pulled apart."""
    parts = FILLET + 1
    quarters = np.repeat(np.arange(4), parts)
    turns = 0.5 * np.pi * (quarters + np.tile(np.linspace(0.0, 1.0, parts), 4))
    up, along = turns[: 2 * parts, None], turns[None]
    ball = np.sin(up) * np.cos(along), np.sin(up) * np.sin(along), np.cos(up)
    sides = np.pi * (0.5 * quarters + 0.25)
    signs = np.cos(sides), np.sin(sides), np.cos(sides[: 2 * parts, None])
    half = np.array([a, b, c]) / 2.0 - radius
    parts_of = [np.sign(s) * h + radius * w for s, h, w in zip(signs, half, ball, strict=True)]
    points = np.stack(np.broadcast_arrays(*parts_of), axis=-1).reshape(-1, 3)
    index = np.arange(len(points)).reshape(2 * parts, 4 * parts)
    low, high = index[:-1], index[1:]
    low_next, high_next = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    halves = (low, high, high_next), (low, high_next, low_next)
    walls = [np.stack(each, axis=-1).reshape(-1, 3) for each in halves]
    (n, e, s, w), bottom = index[0, ::parts], index[-1, ::parts]
    caps = [(n, e, s), (n, s, w), bottom[[2, 1, 0]], bottom[[3, 2, 0]]]
    _, first, merged = np.unique(points.round(9), axis=0, return_index=True, return_inverse=True)
    triangles = merged.ravel()[np.vstack([*walls, caps])]
    real = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return points[first], triangles[real]


def angle(long, wide, depth):
    """An L."""
    polygon = [(0, 0), (long, 0), (long, wide), (wide, wide), (wide, long), (0, long)]
    return extruded(polygon, [(3, 4, 5), (3, 5, 0), (3, 0, 1), (3, 1, 2)], depth)


def tee(stem, long, width, high, depth):
    """A T: a bar of this width and height on a stem of this width and length."""
    s, w, top = 0.5 * stem, 0.5 * width, long + high
    polygon = [(-s, 0), (s, 0), (s, long), (w, long), (w, top), (-w, top), (-w, long), (-s, long)]
    cap = [(0, 1, 2), (0, 2, 7), (2, 3, 4), (2, 4, 5), (2, 5, 7), (7, 5, 6)]
    return extruded(polygon, cap, depth)


def revolved(profile, is_ring=False, sections=SECTIONS):
    """Vertices and triangles of a profile (n, 2) of radii and heights that turns around z.

    It goes up along the outside, from the axis to the axis; that of a ring ends where it began.
    """
    profile = np.array(profile, dtype=float)
    turns = 2.0 * np.pi * np.arange(sections) / sections
    radius, height = profile.T
    x, y = (np.outer(radius, function(turns)).ravel() for function in (np.cos, np.sin))
    vertices = np.column_stack([x, y, np.repeat(height, sections)])
    index = np.arange(len(vertices)).reshape(-1, sections)
    index[radius == 0.0] = index[radius == 0.0, :1]  # On the axis there is one vertex only.
    index = np.vstack([index, index[:1]]) if is_ring else index
    a, b = index[:-1], index[1:]
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    triangles = np.vstack([np.stack(each, axis=-1).reshape(-1, 3) for each in ((a, d, c), (a, c, b))])
    real = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    used, triangles = np.unique(triangles[real], return_inverse=True)
    return vertices[used], triangles.reshape(-1, 3)


def arc(radius, middle, low, high):
    """Radii and heights (n, 2) of an arc from one polar angle, against -z, to another."""
    turns = np.linspace(low, high, BALL_SECTIONS // 2)
    found = np.column_stack([radius * np.sin(turns), middle - radius * np.cos(turns)])
    found[np.isin(turns, (0.0, np.pi)), 0] = 0.0
    return found


def square_ring(inner, outer, high):
    return revolved([(inner, 0), (outer, 0), (outer, high), (inner, high)], is_ring=True)


def both(one, two):
    """The vertices and triangles of two meshes as one mesh."""
    return np.vstack([one[0], two[0]]), np.vstack([one[1], len(one[0]) + two[1]])


def ball(radius, middle=0.0):
    """A ball whose middle is at this height."""
    return revolved(arc(radius, middle, 0.0, np.pi), sections=BALL_SECTIONS)


def overlapping_balls(share):
    """Two balls of radius 1 that overlap by this share of their diameter."""
    half = 1.0 - share
    end = np.arccos(-half)
    profile = np.vstack([arc(1.0, -half, 0.0, end), arc(1.0, half, np.pi - end, np.pi)[1:]])
    return revolved(profile, sections=BALL_SECTIONS)


def apart_balls(gap):
    """Two balls with this gap between them, as a share of what both measure."""
    middle = 1.0 + 2.0 * gap / (1.0 - gap)
    return both(ball(1.0, -middle), ball(1.0, middle))


def hollow_ball(inner):
    """A ball of radius 1 with a cavity of radius `inner`."""
    vertices, triangles = ball(inner)
    return both(ball(1.0), (vertices, triangles[:, ::-1]))


def scanned(words):
    """A scan; its vertices are merged, because those of its file are up to 1e-8 apart."""
    scan = Scan(scan_files(words)[0])
    _, first, merged = np.unique(scan.points.round(6), axis=0, return_index=True, return_inverse=True)
    return scan.points[first], merged.ravel()[scan.faces]


HOLLOW = "hollow ball"


def objects(tolerance):
    """The thickness of the thinnest wall or gap of each object, as a share of the size, and what makes it."""
    return {
        "box": (0.6, lambda: box(1, 0.8, 0.6)),
        "fillet .05": (0.6, lambda: filleted(1, 0.8, 0.6, 0.05)),
        "fillet .01": (0.6, lambda: filleted(1, 0.8, 0.6, 0.01)),
        "prism 6": (0.8, lambda: revolved([(0, 0), (0.5, 0), (0.5, 0.8), (0, 0.8)], sections=6)),
        "prism 8": (0.8, lambda: revolved([(0, 0), (0.5, 0), (0.5, 0.8), (0, 0.8)], sections=8)),
        "plate": (0.04, lambda: box(1, 0.7, 0.04)),
        "cylinder": (0.8, lambda: revolved([(0, 0), (0.4, 0), (0.4, 1), (0, 1)])),
        "cone": (0.8, lambda: revolved([(0, 0), (0.4, 0), (0, 1)])),
        "square ring": (0.25, lambda: square_ring(0.25, 0.5, 0.3)),
        "L": (0.35, lambda: angle(1, 0.35, 0.4)),
        "T": (0.3, lambda: tee(0.3, 0.7, 1, 0.3, 0.4)),
        "tube": (0.03, lambda: square_ring(0.27, 0.3, 1)),
        "fin on block": (0.02, lambda: tee(0.02, 0.3, 1, 0.4, 0.5)),
        "overlapping balls": (0.16, lambda: overlapping_balls(0.05)),
        "balls with a gap": (0.24, lambda: apart_balls(GAP * tolerance)),
        HOLLOW: (0.2, lambda: hollow_ball(0.6)),
        "cad_block": (0.02, lambda: scanned("cad_block")),
    }


def made(tolerance):
    """Functions that make objects with walls of ten tolerances or more, by name."""
    least = 0.999 * THINNEST * tolerance
    return {name: make for name, (wall, make) in objects(tolerance).items() if wall >= least}


# Runs ------------------------------------------------------------------------------------------------


class Run(NamedTuple):
    """What came of one start; distances are in tolerances."""

    number: int
    topology: solids.Topology
    is_right: bool
    is_ok: bool
    near: tuple[float, float]  # The 99 % distances from the object to the mesh, and back,
    far: float  # and the farthest of both.
    done: int
    patches: int
    seconds: float
    signs: int
    felt: float
    within: float
    off: float
    poisson: solids.Topology
    poisson_near: float
    message: str


def touched(thing, tolerance, number):
    """(atlas, explorations, number of touches made) of a start."""
    if thing.name == HOLLOW:
        tried = thing.points(20 * SHELLS, number)
        some = spread(tried[0], SHELLS)
        wanted = {"farthest": 0.3, "largest_std": tolerance, "noise": NOISE, "rng": number}
        found = core.explore_many(thing, *(values[some] for values in tried), **wanted)
        found = [e for e in found if not isinstance(e, ValueError)]
        return put_together(found, tolerance), found, SHELLS
    return touched_all_over(thing, thing.start(number), tolerance, rng=number)


def apart(thing, vertices, triangles):
    """Distances of points of an object from a mesh, and of points of the mesh from the object."""
    back = core.scattered(vertices, triangles, SAMPLES, np.random.default_rng(0))[0]
    return away(tree_of(vertices, triangles), thing.points(SAMPLES, 0)[0]), away(thing.tree, back)


def run(thing, tolerance, number, around, truth):
    """The Run of a start; `truth` are the signed distances of the places `around`."""
    touching, (atlas, found, done) = timed(touched, thing, tolerance, number)
    meshing, mesh = timed(atlas.mesh, EDGE)
    shape = solids.topology(mesh.triangles)
    there, back = (d / tolerance for d in apart(thing, mesh.vertices, mesh.triangles))
    distance, std = atlas.distance(around)
    felt = np.isfinite(std)
    off, std, true = np.abs(distance - truth)[felt], std[felt], truth[felt]
    signs = (np.signbit(distance[felt]) != np.signbit(true)) & (np.abs(true) > SURE * std)
    other = poisson(*contacts_of(found, atlas.taps), DEPTH, WEIGHT)
    other_off = apart(thing, *other)
    return Run(
        number,
        shape,
        shape == thing.topology,
        atlas.status == "ok",
        (float(np.percentile(there, 99)), float(np.percentile(back, 99))),
        max(there.max(), back.max()),
        done,
        len(atlas.patches),
        touching + meshing,
        int(signs.sum()),
        felt.mean(),
        np.mean(off <= 1.645 * std) if len(std) else np.nan,
        np.mean((off > OFF_STDS * std) & (off > OFF)) if len(std) else np.nan,
        solids.topology(other[1]),
        max(np.percentile(d, 99) for d in other_off) / tolerance,
        atlas.message,
    )


def line(one):
    """A run in a line."""
    shape = one.topology
    return (
        f"  start {one.number}: {'right' if one.is_right else 'WRONG'}, {'ok' if one.is_ok else 'in doubt'}; "
        f"open {shape.open}, tangled {shape.tangled}, Euler {shape.euler}, pieces {shape.pieces}; "
        f"99 % {one.near[0]:.2f} / {one.near[1]:.2f}, farthest {one.far:.1f}; {one.done} touches, "
        f"{one.patches} patches, {one.seconds:.1f} s; signs {one.signs}, within {one.within:.3f}, "
        f"off {100 * one.off:.3f} %; {one.message}"
    )


def row(thing, tolerance, runs, failed):
    """A row of the table; of several runs it has the worst, or the range."""

    def worst(shapes):
        """Open edges, Euler number and pieces that are farthest from those of the object."""
        best = thing.topology
        return [
            f"{max((getattr(s, name) for s in shapes), key=lambda v: abs(v - getattr(best, name)))}"
            for name in ("open", "euler", "pieces")
        ]

    def span(values, digits):
        low, high = (f"{value:.{digits}f}" for value in (min(values), max(values)))
        return low if low == high else f"{low}-{high}"

    cells = [thing.name, f"{100 * tolerance:g} %", f"{sum(r.is_right for r in runs)} of {len(runs) + failed}"]
    if not runs:
        return cells + ["-"] * (len(HEAD) - len(cells))
    return [
        *cells,
        " / ".join(worst([r.topology for r in runs])),
        " / ".join(f"{max(r.near[way] for r in runs):.2f}" for way in (0, 1)),
        f"{max(r.far for r in runs):.1f}",
        f"{sum(r.is_ok and not r.is_right for r in runs)} / {sum(r.is_right and not r.is_ok for r in runs)}",
        span([r.done for r in runs], 0),
        span([r.patches for r in runs], 0),
        span([r.seconds for r in runs], 1),
        str(max(r.signs for r in runs)),
        f"{100 * min(r.felt for r in runs):.1f}",
        f"{min(r.within for r in runs):.3f}",
        f"{100 * max(r.off for r in runs):.3f}",
        " / ".join(worst([r.poisson for r in runs])),
        f"{max(r.poisson_near for r in runs):.2f}",
    ]


HEAD = [
    *("object", "tolerance", "closed and right", "open / Euler / pieces", "99 % there / back", "farthest"),
    *("wrong ok / right in doubt", "touches", "patches", "s", "wrong signs", "% finite", "within 90 %"),
    *("% far off", "Poisson: open / Euler / pieces", "99 %"),
]


def print_shapes(only, tolerances, starts, places):
    """Prints the table of objects with `only` in their names, and tolerances in this range.

    starts : numbers of the starts
    places : how many places around each object are judged
    """
    rows = []
    for tolerance in (t for t in TOLERANCES if tolerances[0] <= t <= tolerances[1]):
        for thing in things(made(tolerance), only):
            print(f"{thing.name}, tolerance {tolerance:g}, {thing.topology}", file=sys.stderr, flush=True)
            low, high = thing.vertices.min(axis=0) - 0.1, thing.vertices.max(axis=0) + 0.1
            around = np.random.default_rng(0).uniform(low, high, (places, 3))
            truth = thing.distances(around)
            runs = []
            for number in starts:
                try:
                    runs.append(run(thing, tolerance, number, around, truth))
                except Exception as error:  # A run that fails is a result, too.
                    print(f"  start {number}: {type(error).__name__}: {error}", file=sys.stderr, flush=True)
                    continue
                print(line(runs[-1]), file=sys.stderr, flush=True)
            rows.append(row(thing, tolerance, runs, len(starts) - len(runs)))
    table(HEAD, rows, left=2)
    print("Distances are in tolerances, times in CPU seconds; of several runs it has the worst or the range.")
    print(f"{machine('bpy', 'numpy', 'scipy')}.")
