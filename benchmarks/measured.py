# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured objects: whether `core.atlas_of` is honest beyond what was felt, and orients strokes by itself.

`python -m benchmarks.measured [--partial N] [--full N] [--first SEED] [--only NAME] [...]`, from the root of
a checkout, scans closed objects of size 1 with strokes that have a noise of .0005: curves in two families of
parallel planes, seeded. It prints Markdown tables:

(a) N partial scans, of which a half space, all but a cap, or all but three curves are missing, and N full
    ones: how many are "ok"; of places at most one size away from contacts, how many have a finite
    deviation, and how often the sign of these is wrong: at places spread evenly, at as many whose distance
    from contacts has a deviation of .2, and at those of both where the object is farther than five
    deviations; how many of those up to a tenth of the size above felt area are finite; and how often
    distances are within the 90 % interval. Every second scan has normals, the others have to be oriented;
(b) with `--orientation`, every object of benchmarks.atlas_shapes, with gaps between strokes below half its
    thinnest wall, and 1.8 times as long: the share of contacts whose normals face outward, and the doubt. Of
    longer gaps it is that of the whole object if many normals are wrong without one of their own;
(c) with `--features`, dents, bumps, grooves and steps of five heights from 10 to 100 noises on three objects,
    along the ways from their middles: the verdict, the share of the contacts in the feature that are off by
    more than five deviations and noises, their mean distance in noises, and that of the others;
(d) with `--even`, few contacts that are spread evenly on these, a rounded cube and closed scans, with normals
    and without, with a tolerance and without: the verdict, and how far the surface is off the object, and the
    object off the surface, in percent of the size.
"""

import sys
from functools import partial as bound
from itertools import product

import numpy as np

import core
from core.atlas.orientation import doubts_of, oriented, planes_of
from core.triangles import normalized, triangle_cross

from . import machine, parser_of, table, timed
from .accuracy import sampling
from .atlas_shapes import (
    angle,
    arc,
    away,
    box,
    filleted,
    hollow_ball,
    objects,
    overlapping_balls,
    revolved,
    scanned,
    square_ring,
    tee,
    things,
)
from .whole import spread

NOISE = 0.0005
PLACES = 1000  # This many places are judged around each scan, and as many above felt area.
ABOVE = 0.1  # The largest height of these above it.
SURE = 5.0
CLOSE, COARSE = 0.95, 1.8  # The distance between strokes, in halves of a wall.
# benchmarks.atlas touches it, too, where its thinnest walls are not resolved.
WALLS = {"cad_block": 0.0064}
RIGHT, FEWEST, MOST = 0.99, 100, 200_000  # With fewer right normals, of this many contacts, a doubt is due.
GAP = 0.01  # A tenth of the distance between two balls.
GAPS = (0.03, 0.06)  # The least and the largest distance between the strokes of a scan.
FINE = 0.5  # Contacts along a stroke are this share of the gap apart.
# The features: their half widths, which of them are judged, their heights in noises, and the share of the
# half width within which contacts are in them.
WIDTHS = {"dent": 0.1, "bump": 0.1, "groove": 0.05, "step": 0.05}
FEATURED, HEIGHTS, IN_FEATURE = ("ball", "egg", "box"), (10, 20, 40, 70, 100), 1.2
EVEN, CHECKED = (400, 800, 2000), 3000  # Contacts that are spread evenly, and points of the object.
OBJECTS = {
    "ball": lambda: revolved(arc(1.0, 0.0, 0.0, np.pi)),
    "egg": lambda: revolved(arc(1.0, 0.0, 0.0, np.pi) * (0.6, 1.0)),
    "ring": lambda: revolved(
        [(1.0 + 0.4 * np.cos(t), 0.4 * np.sin(t)) for t in np.linspace(0, 2 * np.pi, 64)[:-1]], True
    ),
    "overlapping balls": lambda: overlapping_balls(0.2),
    "box": lambda: box(1, 0.8, 0.6),
    "cylinder": lambda: revolved([(0, 0), (0.4, 0), (0.4, 1), (0, 1)]),
    "square ring": lambda: square_ring(0.25, 0.5, 0.3),
    "L": lambda: angle(1, 0.35, 0.4),
    "T": lambda: tee(0.3, 0.7, 1, 0.3, 0.4),
    "hollow ball": lambda: hollow_ball(0.6),
}
ROUNDED = {"rounded cube": lambda: filleted(1, 1, 1, 0.2)}
SCANS = {
    name: bound(scanned, name) for name in ("asteroid", "bottle", "lemon", "pear", "stone_flake", "shell")
}
TOLERANCES = (None, 0.02)  # as a share of the size


def rotation(rng):
    """Three random unit vectors across each other, as rows."""
    return np.linalg.qr(rng.normal(size=(3, 3)))[0]


def strokes_of(thing, gap, rng, step=None):
    """(points, normals) of curves all over an object, in two families of planes, at most `gap` apart."""
    found, pitch = [], gap / np.sqrt(2.0)
    for way in rotation(rng)[:2]:
        heights = thing.vertices @ way
        low, high = heights.min(), heights.max()
        for at in np.arange(low + rng.uniform(0.2, 0.8) * pitch, high, pitch):
            found += cut(thing, heights - at, step or FINE * gap)
    return found


def cut(thing, heights, step):
    """Curves of a mesh where heights (n,) of its vertices are 0, as (points, normals), in steps."""
    above = heights[thing.triangles] > 0.0
    ends = {}
    for face in np.flatnonzero(above.any(axis=1) & ~above.all(axis=1)).tolist():
        corners = thing.triangles[face]
        keys = []
        for a, b in zip(corners, np.roll(corners, -1), strict=True):
            if (heights[a] > 0.0) != (heights[b] > 0.0):
                keys.append((min(a, b), max(a, b)))
        for one, other in (keys, keys[::-1]):
            ends.setdefault(one, []).append((other, face))
    curves, left = [], dict(ends)
    while left:
        key, faces, keys = next(iter(left)), [], []
        while key is not None:
            keys.append(key)
            following = [(k, f) for k, f in left.pop(key) if k in left]
            key = following[0][0] if following else None
            faces += [following[0][1]] if following else []
        closing = [f for k, f in ends[keys[-1]] if k == keys[0]]
        if len(keys) > 2 and closing:
            keys, faces = [*keys, keys[0]], [*faces, closing[0]]
        if faces:
            curves.append((keys, faces))
    return [_stepped(thing, heights, *curve, step) for curve in curves]


def _stepped(thing, heights, keys, faces, step):
    a, b = thing.vertices[np.array(keys)].transpose(1, 0, 2)
    ha, hb = heights[np.array(keys)].T
    corners = a + (ha / (ha - hb))[:, None] * (b - a)
    lengths = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1)))
    at = (np.arange(max(1, int(lengths[-1] / step))) + 0.5) * step
    at = at[at < lengths[-1]]
    which = np.clip(np.searchsorted(lengths, at) - 1, 0, len(faces) - 1)
    share = (at - lengths[which]) / np.maximum(lengths[which + 1] - lengths[which], 1e-12)
    points = corners[which] + share[:, None] * (corners[which + 1] - corners[which])
    return points, normalized(triangle_cross(thing.vertices[thing.triangles[np.array(faces)[which]]]))


def kept(strokes, inside):
    """Parts of strokes where inside(points) holds."""
    found = []
    for points, normals in strokes:
        which = inside(points)
        ends = np.flatnonzero(np.diff(np.concatenate([[False], which, [False]]).astype(int)))
        found += [(points[i:j], normals[i:j]) for i, j in zip(ends[::2], ends[1::2], strict=True)]
    return [stroke for stroke in found if len(stroke[0])]


def partial(thing, strokes, rng):
    """Part of a scan: a half space, a cap, or three curves of one patch; the last have their own noise."""
    kind = rng.choice(["half space", "cap", "curves"], p=[0.5, 0.3, 0.2])
    points = np.vstack([p for p, _ in strokes])
    if kind == "half space":
        way = rotation(rng)[0]
        level = np.quantile(points @ way, rng.uniform(0.3, 0.9))
        return kind, kept(strokes, lambda p: p @ way < level)
    if kind == "cap":
        middle, radius = points[rng.integers(len(points))], rng.uniform(0.2, 0.35)
        return kind, kept(strokes, lambda p: np.linalg.norm(p - middle, axis=1) < radius)
    for number in rng.integers(1000, size=50).tolist():
        try:
            place, normal = thing.start(number)
            contours = core.track(thing, place, normal, sampling(), extent=0.15, step=0.01)
        except ValueError:
            continue
        if all(len(c.points) > 25 for c in contours):
            return kind, [(c.points, c.normals) for c in contours]
    raise ValueError("no place for three curves")


def scan(thing, seed, is_full):
    """(kind, strokes, contours for atlas_of) of a seed."""
    rng = np.random.default_rng(seed)
    strokes, kind = strokes_of(thing, rng.uniform(*GAPS), rng), "full"
    if not is_full:
        kind, strokes = partial(thing, strokes, rng)
    with_normals = seed % 2 == 0
    given = [
        core.Contour(p + rng.normal(0.0, NOISE, p.shape), normals=n if with_normals else None)
        for p, n in strokes
    ]
    return kind, strokes, given


def judged(thing, seed, is_full):
    """A dict of what came of one scan."""
    kind, strokes, given = scan(thing, seed, is_full)
    # Open strokes do not show their outer side.
    hint = None if kind in ("full", "half space") else np.vstack([n for _, n in strokes]).mean(axis=0)
    seconds, atlas = timed(core.atlas_of, given, noise=NOISE, outward=hint)
    rng = np.random.default_rng(seed + 1)
    points, normals = (np.vstack(values) for values in zip(*strokes, strict=True))
    low, high = points.min(axis=0) - 1.0, points.max(axis=0) + 1.0
    near = points[rng.integers(len(points), size=PLACES)] + rng.normal(0.0, 0.2, (PLACES, 3))
    around = np.vstack([rng.uniform(low, high, (PLACES, 3)), near])
    some = rng.integers(len(points), size=PLACES)
    above = points[some] + rng.uniform(0.0, ABOVE, PLACES)[:, None] * normals[some]
    above = above[~thing.is_inside(above)]
    places = np.vstack([around, above])
    truth = thing.distances(places)
    distance, std = atlas.distance(places)
    finite = np.isfinite(std)
    wrong = finite & (np.signbit(distance) != np.signbit(truth))
    sure = wrong & (np.abs(truth) > SURE * np.where(finite, std, 0.0))
    mesh = atlas.reference.mesh
    return {
        "seed": seed,
        "kind": kind,
        "ok": atlas.status == "ok",
        "closed": mesh.is_closed,
        "finite": int(finite[: len(around)].sum()),
        "even": int(finite[:PLACES].sum()),
        "wrong": int(wrong[:PLACES].sum()),
        "near wrong": int(wrong[PLACES : len(around)].sum()),
        "sure wrong": int(sure[: len(around)].sum()),
        "felt above": float(finite[len(around) :].mean()),
        "within": float(np.mean(np.abs(distance - truth)[finite] <= 1.645 * std[finite])),
        "contacts": len(points),
        "patches": len(atlas.patches),
        "seconds": seconds,
        "message": atlas.message,
    }


def print_scans(only, seeds, is_full):
    objects = list(things(OBJECTS, only))
    every = {thing.name: [] for thing in objects}
    for seed in seeds:
        thing = objects[seed % len(objects)]
        name = thing.name
        try:
            one = judged(thing, 1000 * (1 + is_full) + seed // len(objects) * 7 + seed, is_full)
        except ValueError as error:
            print(f"{name} {seed}: {error}", file=sys.stderr, flush=True)
            continue
        every[name].append(one)
        print(name, one, file=sys.stderr, flush=True)
    rows = []
    for name, found in [*every.items(), ("all", [one for some in every.values() for one in some])]:
        if not found:
            continue
        finite, even = (sum(one[key] for one in found) for key in ("finite", "even"))
        counts = {"wrong": even, "near wrong": finite - even, "sure wrong": finite}
        above, within, seconds = (
            np.mean([one[key] for one in found]) for key in ("felt above", "within", "seconds")
        )
        rows.append([
            *(name, str(len(found)), *(str(sum(one[key] for one in found)) for key in ("ok", "closed"))),
            f"{finite / len(found):.0f}",
            *(f"{1e3 * sum(one[key] for one in found) / max(of, 1):.2f}" for key, of in counts.items()),
            *(f"{100 * above:.1f}", f"{within:.3f}", f"{seconds:.1f}"),
        ])  # fmt: skip
    head = [
        *("full scans of" if is_full else "partial scans of", "scans", "ok", "closed", "finite places"),
        *("wrong signs, permille", "near contacts", "sure ones", "% finite above", "within 90 %", "s"),
    ]
    table(head, rows)


def profile(kind, points, middle, way):
    """The height (n,) of a feature at points (n, 3), as a share of its own, and which of them are in it."""
    away = np.linalg.norm(points - middle, axis=1) if kind in ("dent", "bump") else (points - middle) @ way
    away = away / WIDTHS[kind]
    shape = 0.5 * (1.0 + np.tanh(2.0 * away)) if kind == "step" else np.exp(-(away**2))
    return (-1.0 if kind in ("dent", "groove") else 1.0) * shape, np.abs(away) < IN_FEATURE


def print_features(only, first):
    rows = []
    for thing in things({name: OBJECTS[name] for name in FEATURED}, only):
        for seed, (kind, noises) in enumerate(product(WIDTHS, HEIGHTS), start=first):
            rng = np.random.default_rng(seed)
            strokes = strokes_of(thing, rng.uniform(*GAPS), rng)
            points = np.vstack([p for p, _ in strokes])
            # Along normals, two walls would pass through each other at an edge, or leave a gap there.
            ways = normalized(points - thing.vertices.mean(axis=0))
            height, inside = profile(kind, points, points[rng.integers(len(points))], rotation(rng)[0])
            felt = points + noises * NOISE * height[:, None] * ways + rng.normal(0.0, NOISE, points.shape)
            parts = np.split(felt, np.cumsum([len(p) for p, _ in strokes])[:-1])
            seconds, atlas = timed(core.atlas_of, parts, noise=NOISE)
            distance, std = atlas.distance(felt)
            far = np.abs(distance) > SURE * np.hypot(np.where(np.isfinite(std), std, 0.0), NOISE)
            means = [f"{np.abs(distance[which]).mean() / NOISE:.2f}" for which in (inside, ~inside)]
            rows.append([
                thing.name, kind, str(noises), atlas.status, str(len(felt)), str(np.count_nonzero(inside)),
                f"{100.0 * far[inside].mean():.1f}", *means, str(len(atlas.patches)), f"{seconds:.1f}",
            ])  # fmt: skip
            print(*rows[-1], atlas.message, file=sys.stderr, flush=True)
    head = ["object", "feature", "noises high", "status", "contacts", "in it", "% off", "mean, noises"]
    table([*head, "elsewhere", "patches", "s"], rows)


def print_even(only, first):
    rows = []
    for thing, count in product(things(OBJECTS | ROUNDED | SCANS, only), EVEN):
        rng, name = np.random.default_rng(first), thing.name
        object_points, tried = thing.points(CHECKED, rng)[0], thing.points(10 * count, rng)
        points, normals = (values[spread(tried[0], count)] for values in tried)
        for some, tolerance in product((normals, None), TOLERANCES):
            try:
                atlas = core.atlas_of([core.Contour(points, normals=some)], tolerance=tolerance)
            except ValueError as error:
                print(f"{name} {count}: {error}", file=sys.stderr, flush=True)
                continue
            surface = atlas.reference
            off = [
                away(thing.tree, surface.mesh.vertices).max(),
                np.linalg.norm(surface.feet(object_points)[0] - object_points, axis=1).max(),
            ]
            given = "yes" if some is not None else "no", str(tolerance or "")
            rows.append([name, str(count), *given, atlas.status, *(f"{100.0 * most:.2f}" for most in off)])
            print(*rows[-1], atlas.message, file=sys.stderr, flush=True)
    head = ["object", "even contacts", "normals", "tolerance", "status", "% surface off", "% object off"]
    table(head, rows)


def outward(points, normals):
    """The share of contacts, (n, 3) with their true normals, that face outward, and the doubt of these."""
    planes = planes_of(points, NOISE)
    try:
        found = oriented(points, planes)
    except ValueError as error:
        return np.nan, f"refused: {error}"
    doubt = next(doubts_of(points, found, planes.links), None)
    return np.mean(np.einsum("ni,ni->n", found, normals) > 0.0), doubt


def print_orientation(only, is_coarse):
    rows = []
    walls = {name: wall for name, (wall, _) in objects(GAP).items()} | WALLS
    for thing in things({name: make for name, (_, make) in objects(GAP).items()}, only):
        wall = walls[thing.name]
        gap = (COARSE if is_coarse else CLOSE) * 0.5 * wall
        rng = np.random.default_rng(0)
        strokes = strokes_of(thing, gap, rng)
        felt = [p + rng.normal(0.0, NOISE, p.shape) for p, _ in strokes]
        points, normals = np.vstack(felt), np.vstack([n for _, n in strokes])
        (seconds, (right, doubt)), count = timed(outward, points, normals), len(points)
        if is_coarse and doubt is None and right < RIGHT and FEWEST <= count <= MOST:
            atlas = core.atlas_of(felt, noise=NOISE)
            doubt = next(iter(atlas.doubts), None)
        shares = f"{wall:g}", str(count), f"{100 * right:.2f}"
        rows.append([thing.name, *shares, str(doubt or ""), f"{seconds:.1f}"])
        print(rows[-1], file=sys.stderr, flush=True)
    gaps = f"gaps of {COARSE if is_coarse else CLOSE:g} half walls"
    table([gaps, "wall", "contacts", "% outward", "doubt", "s"], rows)


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--partial", type=int, default=0)
    parser.add_argument("--full", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", default="")
    parser.add_argument("--orientation", action="store_true")
    parser.add_argument("--features", action="store_true")
    parser.add_argument("--even", action="store_true")
    options = parser.parse_args()
    for count, is_full in ((options.partial, False), (options.full, True)):
        if count:
            print_scans(options.only, range(options.first, options.first + count), is_full)
    if options.orientation:
        for is_coarse in (False, True):
            print_orientation(options.only, is_coarse)
    if options.features:
        print_features(options.only, options.first)
    if options.even:
        print_even(options.only, options.first)
    print(f"{machine('bpy', 'numpy', 'scipy')}.")


if __name__ == "__main__":
    main()
