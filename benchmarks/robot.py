# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How near the fits come to what a real robot has felt, and whether their intervals are true there.

`python -m benchmarks.robot FOLDER [--points N] [--radius MM]`, from the root of a checkout; FOLDER has a copy
of github.com/vu-arma-dev/robot-palpation-data. mat-io, which reads it, needs numpy 2, which only the
environment for Python 3.13 has. The command prints Markdown tables.

A surgical robot has wiped over kidney and organ phantoms in rows, under force control. Where |force| > 0.1 N,
there is a contact at position - 3.15 mm x force direction. At seeded random places of each exploration, about
a fifth of all blocks of successive contacts are held out. The other contacts within the radius are fitted in
three ways: all of them as strokes; three curves of some 50 contacts each that are cut out of them; and these
curves together with the strokes. The held-out contacts over the domain tell the error, and whether an
interval of deviation and scatter holds them. The scatter is that of the contacts given to a method about its
surface.

The last table compares moving centers along the force with `ball=3.15`, which moves them along the normals of
the fit to the centers. The held-out centers judge both: they should be 3.15 mm away from the surface.
"""

import math
import sys
import warnings
from functools import partial
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np

from core import Contour, distances, reconstruct
from core.reconstruction.strokes import means

from . import machine, parser_of, table, timed
from .peers import matern_on_quadric

BALL, LEAST_FORCE = 3.15, 0.1  # mm, N
BLOCK, SHARE = 60, 5  # The number of contacts in a block; one block in SHARE is held out, on average.
BAND, IN_BAND = 0.35, 50  # A curve has contacts up to BAND mm from its plane, and some IN_BAND of these.
FEWEST = 300  # The least number of contacts that are given at a place.
SUBSET, MOST = 200, 600  # The numbers of random contacts to which a process and a spline are fitted.
SMOOTHINGS = (0.1, 1.0, 10.0)  # In unit radius; the best values between 0.01 and 100 are among them.


class Place(NamedTuple):
    """Contacts around a place of an exploration, in mm."""

    place: np.ndarray
    outward: np.ndarray
    given: np.ndarray  # (n, 3)
    held_out: np.ndarray  # (m, 3)
    centers: tuple[np.ndarray, np.ndarray]  # of the ball at both


class Score(NamedTuple):
    """The mean |dz| in mm, that over what deviation and scatter expect, the share within 90 %, seconds."""

    error: float
    ratio: float
    within: float
    seconds: float


def explorations(folder):
    """Yields (contacts (n, 3), force directions (n, 3)) of each exploration, in the order of time."""
    from matio import load_from_mat

    for path in sorted(Path(folder).rglob("exploration/*.mat")):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # It warns of MATLAB classes that it does not know.
            (logger,) = load_from_mat(path).values()
        logs = logger.properties["logs"].ravel()
        position, force = (np.concatenate([log[key].T for log in logs]) for key in ("position", "force"))
        size = np.linalg.norm(force, axis=1)
        felt = size > LEAST_FORCE
        direction = force[felt] / size[felt, None]
        yield position[felt] - BALL * direction, direction


def places(contacts, directions, count, radius):
    """Yields Places at random contacts; those with too few contacts around them are left out."""
    rng = np.random.default_rng(0)
    for i in rng.integers(len(contacts), size=count):
        blocks = (np.arange(len(contacts)) + rng.integers(BLOCK)) // BLOCK
        held_out = rng.integers(SHARE, size=blocks[-1] + 1)[blocks] == 0
        near = np.linalg.norm(contacts - contacts[i], axis=1) < radius
        outward = directions[near].mean(axis=0)
        some = near & ~held_out, near & held_out
        if np.count_nonzero(some[0]) >= FEWEST:
            centers = tuple(contacts[which] + BALL * directions[which] for which in some)
            yield Place(contacts[i], outward, *(contacts[which] for which in some), centers)


def curves(r, given):
    """Yields three thinned bands of contacts through the origin of a reconstruction, as Contours."""
    local = r.frame.to_local(given)
    for azimuth in np.pi / 3.0 * np.arange(3):
        across = local[:, 1] * math.cos(azimuth) - local[:, 0] * math.sin(azimuth)
        band = given[np.abs(across) < BAND]
        along = np.argsort(r.frame.to_local(band)[:, :2] @ [math.cos(azimuth), math.sin(azimuth)])
        yield Contour(band[along][:: max(1, len(band) // IN_BAND)])


# Peers: from contacts in a frame and in unit radius to functions for height and deviation -------------


def process(contacts, thin):
    height, height_std = matern_on_quadric(thin(contacts), noisiest=10.0)
    return height, height_std


def spline(contacts, thin, **options):
    from scipy.interpolate import RBFInterpolator

    chosen = thin(contacts)
    return RBFInterpolator(chosen[:, :2], chosen[:, 2], **options), None


def some(contacts, most):
    """Random contacts, at most `most` of them."""
    chosen = np.random.default_rng(0).permutation(len(contacts))[:most]
    return contacts[chosen]


def averaged(contacts):
    """The means to which a reconstruction thins strokes."""
    return means(contacts, np.array([1.0, 0.0]), np.arange(len(contacts)))[0]


KERNELS = {
    "RBF thin plate": {"kernel": "thin_plate_spline"},
    "RBF cubic": {"kernel": "cubic", "degree": 2},
}
SUBSETS = {f"{MOST} contacts": partial(some, most=MOST), "the same means": averaged}
PEERS = {
    f"Matérn process, {SUBSET} contacts": partial(process, thin=partial(some, most=SUBSET)),
    "Matérn process, the same means": partial(process, thin=averaged),
    **{
        f"{name}, {subset}, smoothing {smoothing:g}": partial(
            spline, thin=thin, smoothing=smoothing, **options
        )
        for name, options in KERNELS.items()
        for subset, thin in SUBSETS.items()
        for smoothing in SMOOTHINGS
    },
}
ALL, CROSSED, BOTH = "only strokes", "three curves", "curves and strokes"


def scored(at, height, height_std, given, held_out, seconds):
    """The Score of a fit to contacts (n, 3) in unit radius, which is `at` mm."""
    off = np.abs(held_out[:, 2] - height(held_out[:, :2]))
    if height_std is None:
        return Score(at * off.mean(), np.nan, np.nan, seconds)
    scatter = np.sqrt(np.mean((given[:, 2] - height(given[:, :2])) ** 2))
    std = np.hypot(height_std(held_out[:, :2]), scatter)
    return Score(at * off.mean(), np.mean(off) / (0.8 * np.mean(std)), np.mean(off < 1.645 * std), seconds)


def of_reconstruction(r, seconds, judge, place):
    """The Score of a reconstruction, on the contacts over the domain of `judge`, as for all methods."""
    given, held_out = in_unit_radius(r, judge, place)
    height, std = (lambda p, f=f: f(*(r.radius * p).T) / r.radius for f in (r.height, r.height_std))
    return scored(r.radius, height, std, given, held_out, seconds)


def in_unit_radius(r, judge, place):
    """Given and held-out contacts over the domain of `judge`, in the frame of r and in its unit radius."""
    return (r.frame.to_local(inside(judge, points)) / r.radius for points in (place.given, place.held_out))


def inside(r, points):
    """Contacts over the domain that are at most a radius above or below it, so not of another side."""
    local = r.frame.to_local(points)
    return points[r.domain.contains(*local[:, :2].T) & (np.abs(local[:, 2]) <= r.radius)]


def scores_at(place, radius):
    """{method: Score} of a place, or None where the strokes carry no patch."""
    try:
        seconds, judge = timed(
            reconstruct, place.place, [], outward=place.outward, strokes=[place.given], radius=radius
        )
    except ValueError:
        return None
    if len(inside(judge, place.held_out)) < FEWEST // SHARE:
        return None
    scores = {ALL: of_reconstruction(judge, seconds, judge, place)}
    given, held_out = in_unit_radius(judge, judge, place)
    for name, peer in PEERS.items():
        seconds, found = timed(peer, given)
        scores[name] = scored(judge.radius, *found, given, held_out, seconds)
    try:
        crossed = list(curves(judge, place.given))
        for name, strokes in ((CROSSED, []), (BOTH, [place.given])):
            options = {"outward": place.outward, "strokes": strokes}
            seconds, r = timed(reconstruct, judge.frame.origin, crossed, **options)
            scores[name] = of_reconstruction(r, seconds, judge, place)
    except ValueError:  # The rows are too far apart for curves to be cut out.
        pass
    return scores


def ball_scores(place, radius):
    """{way: (mean distance of held-out centers from where they should be in mm, seconds)}, or None."""
    at_center = place.place + BALL * place.outward / np.linalg.norm(place.outward)
    ways = {
        "along the force": (place.place, place.given),
        "along the normals, ball=3.15": (at_center, Contour(place.centers[0], ball=BALL)),
    }
    found = {}
    for way, (point, given) in ways.items():
        options = {"outward": place.outward, "strokes": [given], "radius": radius}
        try:
            seconds, r = timed(reconstruct, point, [], **options)
        except ValueError:
            return None
        centers = r.frame.to_local(place.centers[1])
        centers = centers[r.domain.contains(*centers[:, :2].T) & (np.abs(centers[:, 2]) <= r.radius)]
        if len(centers) < FEWEST // SHARE:
            return None
        away = r.radius * distances(r.geometry.surface, centers / r.radius)
        found[way] = np.abs(away - BALL).mean(), seconds
    return found


def best(scores, prefix):
    """The method with the least mean error over all places, of those whose names begin with `prefix`."""
    names = {name for of in scores for name in of if name.startswith(prefix)}
    return min(names, key=lambda name: np.mean([of[name].error for of in scores if name in of]))


def row(name, scores):
    found = [of[name] for of in scores if name in of]
    errors, ratios, within, seconds = zip(*found, strict=True)
    more = ["", ""] if np.isnan(ratios[0]) else [f"{np.mean(ratios):.2f}", f"{np.mean(within):.2f}"]
    return [
        name, str(len(found)), f"{np.mean(errors):.3f}", f"{np.median(errors):.3f}", *more,
        f"{1e3 * median(seconds):.1f}",
    ]  # fmt: skip


def main():
    parser = parser_of(__doc__)
    parser.add_argument("folder", help="the folder of the data")
    parser.add_argument("--points", type=int, default=20, help="of each exploration (%(default)s)")
    parser.add_argument("--radius", type=float, default=8.0, help="of a patch, in mm (%(default)s)")
    options = parser.parse_args()
    every, balls = [], []
    for contacts, directions in explorations(options.folder):
        for place in places(contacts, directions, options.points, options.radius):
            balls.append(ball_scores(place, options.radius))
            found = scores_at(place, options.radius)
            if found is not None:
                every.append(found)
    if not every:
        sys.exit(f"robot: there is no exploration/*.mat in {options.folder}")
    prefixes = [ALL, *list(PEERS)[:2]]
    prefixes += [f"{name}, {subset}" for name in KERNELS for subset in SUBSETS]
    named = {prefix: best(every, prefix) for prefix in prefixes}
    head = ["method", "places", "mean error, mm", "median", "error / expected", "within 90 %", "ms"]
    table(head, [row(name, every) for name in named.values()])
    table(head, [row(name, [of for of in every if CROSSED in of]) for name in (ALL, BOTH, CROSSED)])
    balls = [found for found in balls if found is not None]
    head = ["centers are moved", "places", "mean error, mm", "median", "ms"]
    rows = []
    for way in balls[0]:
        errors, seconds = np.array([found[way] for found in balls]).T
        errors = [f"{error:.3f}" for error in (errors.mean(), np.median(errors))]
        rows.append([way, str(len(balls)), *errors, f"{1e3 * median(seconds):.1f}"])
    table(head, rows)
    print(f"Radius {options.radius:g} mm; {machine('numpy', 'scipy', 'scikit-learn')}.")


if __name__ == "__main__":
    main()
