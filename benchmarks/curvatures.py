# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How often the deviations of curvatures and heights hold.

`python -m benchmarks.curvatures [--quick]`, from the root of a checkout; --quick takes a tenth of the
touches. Scans need bpy. The command prints a Markdown table with a row for each kind of touch: of exact
surfaces, random shapes, curves whose common point is found or given with an error (every other one on a
ball), scans, and flat tops between two folds, where both curvatures are 0: with given extents, with an
automatic one, and without normals; and flat cones, near their tips.

The true curvatures of a scan are those of a polynomial fitted to many points of the mesh: of the quartic over
0.6 of the radius, which a fit with a process states, or of the sextic over the domain, which it states
without one, or where its sextic averages facets. Touches are left out if they are refused, or no such
polynomial is near to the mesh.

Touches whose status is "ok" count. Shares are in %: of curvatures (both, k1, k2) and heights within the 90 %
interval, and of curvatures off by more than five deviations, and by more than .03 / L as well. `error / std`
has root mean squares, `std` and `error` are medians in 1e-3 / L, `at point` is that of height_std in 1e-3 L.
"""

import math
from collections import defaultdict
from contextlib import suppress
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from itertools import product

import numpy as np

from core import Contour, common_point, explore, reconstruct, track
from core.patch.monge import exponents, monomials
from tests import surfaces

from . import SCANS_FOLDER, accuracy, machine, parser_of, table
from .accuracy import EXACT_PLANES, PLANES, STEPS, SURFACES, above, darboux, sampling

TOUCHES, ON_SCANS, HOLD_OUT = 1000, 600, 90
WITHIN, FAR, LARGE = 1.645, 5.0, 0.03  # The 90 % interval, and far off: in deviations and in 1 / L.
BALL = surfaces.sphere(25.0), 12.0
NOISE = 0.02  # mm, of found points; the errors of given ones along the normal and sideways:
ERRORS = (0.03, 0.05), (0.1, 0.3)  # a fit passes the former, and warns of the latter.
TOP = 0.2  # Half of the width between folds.
EXTENTS, SCAN_PLANES = (16, 8), (3, 5)
TRUTHS = (0.6, 4), (1.0, 6)  # Shares of the radius, and degrees,
DENSE, EXPLAINED = 1000, 0.01  # of polynomials fitted to this many points; these are off it by less, in L.
HEAD = "touches|number|ok|within|k1|k2|error / std|std|error|> 5 std|and > .03 / L|heights|at point"


def held(r, kappas, local):
    """What counts of a reconstruction, given the true curvatures and the surface, (m, 3), in the frame.

    Errors of k1 and k2 and their deviations, times L; the share of heights within; height_std(0, 0) / L.
    """
    x, y, z = local.T
    covered = np.mean(np.abs(r.height(x, y) - z) <= WITHIN * r.height_std(x, y))
    curvatures = r.radius * np.array([*np.subtract((r.k1, r.k2), np.sort(kappas)), r.k1_std, r.k2_std])
    return np.array([*curvatures, covered, float(r.height_std(0.0, 0.0)) / r.radius])


def row(name, touches):
    """A row of the table: of these touches, each as `held` has it, or None where it is not "ok"."""
    ok = np.array([touch for touch in touches if touch is not None])
    cells = [name, f"{len(touches)}", f"{100 * len(ok) / max(len(touches), 1):.0f}"]
    if not len(ok):
        return cells + [""] * 10
    off, std = np.abs(ok[:, :2]), ok[:, 2:4]
    within, far = off <= WITHIN * std, off > FAR * std
    return [
        *cells,
        *(f"{100 * share:.0f}" for share in (within.mean(), *within.mean(axis=0))),
        f"{math.sqrt(np.mean(off**2) / np.mean(std**2)):.2f}",
        *(f"{1e3 * np.median(values):.2g}" for values in (std, off)),
        *(f"{100 * np.mean(which):.1f}" for which in (far, far & (off > LARGE))),
        f"{100 * ok[:, 4].mean():.0f}",
        f"{1e3 * np.median(ok[:, 5]):.2g}",
    ]


def felt(surface, extent, planes, rng, noise=0.0, steps=STEPS):
    """Contours of an exact surface through its point, in one of PLANES turned by a random angle."""
    lengths, cuts = (
        {"extent": extent, "step": extent / steps},
        sampling(*PLANES[planes], rng.uniform(0.0, 180.0)),
    )
    return track(surface, surface.point, surface.normal, cuts, noise=noise, rng=rng, **lengths)


def exact(seed, noise, noise_is_given=True):
    """A surface of SURFACES and its fit in one of EXACT_PLANES; all of both have their turn."""
    surface, extent = list(SURFACES.values())[seed % len(SURFACES)]
    contours = felt(surface, extent, EXACT_PLANES[seed % 3], np.random.default_rng(seed), noise)
    given = contours if noise_is_given else [replace(contour, noise=None) for contour in contours]
    return surface, reconstruct(surface.point, given, outward=surface.normal)


def automatic(seed, noise):
    """A surface of SURFACES and its fit, with an automatic extent of at most one to three times the usual."""
    surface, extent = list(SURFACES.values())[seed % len(SURFACES)]
    rng = np.random.default_rng(seed)
    place = surface, surface.point, surface.normal, sampling(turn=rng.uniform(0.0, 180.0))
    farthest = rng.uniform(1.0, 3.0) * extent
    return surface, explore(*place, farthest=farthest, noise=noise, rng=rng).result


def random(seed, noise):
    """A shape touched at a point as in accuracy.random_cases, and its fit in one of PLANES."""
    rng = np.random.default_rng(seed)
    while True:
        surface, extent = accuracy._random_shape(rng), rng.uniform(10.0, 13.0)
        k1, k2 = darboux(surface)[1] if surface else (-1.0, 1.0)
        if max(-k1, k2) <= 1.0 / 15.0 and (k1 * k2 < 0.0) == (seed % 3 == 0):
            break
    contours = felt(surface, extent, list(PLANES)[int(rng.integers(len(PLANES)))], rng, noise)
    return surface, reconstruct(surface.point, contours, outward=surface.normal)


def found(seed, count, noise=None, errors=None):
    """Three curves of `count` contacts with noise in all directions; `noise` is that of the fit.

    errors : those of the given point along the normal and sideways; None if the point is found
    """
    rng = np.random.default_rng(seed)
    surface, extent = list(SURFACES.values())[int(rng.integers(len(SURFACES)))] if seed % 2 else BALL
    contours = []
    for contour in felt(surface, extent, EXACT_PLANES[0], rng, steps=(count + 1) // 2):
        apart = np.linalg.norm(contour.points - surface.point, axis=1)
        contacts = contour.points[apart > 0.0][:count]
        contours.append(Contour(contacts + rng.normal(0.0, NOISE, contacts.shape), noise=noise))
    if errors is None:
        point = common_point(contours)[0]
    else:
        aside = np.cross(surface.normal, rng.normal(size=3))
        point = surface.point + rng.choice([-1.0, 1.0]) * errors[0] * surface.normal
        point += errors[1] / np.linalg.norm(aside) * aside
    return surface, reconstruct(point, contours, outward=surface.normal)


def fold(seed, angle, is_automatic=False, has_normals=True, k=0.0):
    """A top of two curvatures k, or a flat one, that falls off by this angle, in degrees, at both sides."""
    rng, slope = np.random.default_rng(seed), math.tan(math.radians(angle))
    x, y = rng.uniform(-TOP, TOP, 2)
    surface = surfaces.Exact(
        lambda x, y, z: z + slope * np.maximum(np.abs(x) - TOP, 0.0) - 0.5 * k * (x * x + y * y),
        lambda p: np.array([slope * np.sign(p[0]) * (abs(p[0]) > TOP) - k * p[0], -k * p[1], 1.0]),
        *(np.array([x, y, 0.5 * k * (x * x + y * y)]), 0.0, 0.0),
    )
    planes, extent = sampling(turn=rng.uniform(0.0, 180.0)), rng.uniform(0.4, 1.0)
    lengths = {"farthest": 1.5} if is_automatic else {"extent": extent}
    r = explore(surface, surface.point, surface.normal, planes, **lengths).result
    bare = [replace(contour, normals=None) for contour in r.contours]
    return surface, r if has_normals else reconstruct(surface.point, bare, outward=surface.normal)


def cone(seed):
    """A flat cone, touched near its tip with an automatic extent."""
    rng = np.random.default_rng(seed)
    slope, away, planes = rng.uniform(0.1, 0.7), rng.uniform(0.2, 0.9), sampling(turn=rng.uniform(0.0, 180.0))
    surface = surfaces.Exact(
        lambda x, y, z: z + slope * np.hypot(x, y),
        lambda p: np.array([*(slope * p[:2] / math.hypot(*p[:2])), 1.0]),
        *(np.array([away, 0.0, -slope * away]), 0.0, 0.0),
    )
    return surface, explore(surface, surface.point, surface.normal, planes, farthest=2.0).result


ROWS = {
    **{f"exact, noise {noise:g}": partial(exact, noise=noise) for noise in (0.0, 0.02, 0.1)},
    "exact, noise 0.02, not given": partial(exact, noise=0.02, noise_is_given=False),
    **{f"exact, noise {noise:g}, automatic": partial(automatic, noise=noise) for noise in (0.0, 0.02)},
    **{f"random shapes, noise {noise:g}": partial(random, noise=noise) for noise in (0.0, 0.05)},
    **{f"found point, {n} contacts": partial(found, count=n) for n in (15, 41, 101, 400)},
    **{f"found point, {n} contacts, noise given": partial(found, count=n, noise=NOISE) for n in (41, 400)},
    **{f"given point, {e[0]:g} and {e[1]:g} off": partial(found, count=41, errors=e) for e in ERRORS},
    **{f"folds of {angle} degrees": partial(fold, angle=angle) for angle in (5, 10, 15, 20)},
    **{f"folds of {a} degrees, automatic": partial(fold, angle=a, is_automatic=True) for a in (5, 20)},
    **{f"folds of {a} degrees, no normals": partial(fold, angle=a, has_normals=False) for a in (5, 10, 20)},
    **{f"curved folds of {a} degrees": partial(fold, angle=a, k=-1.0) for a in (10, 20)},
    **{
        f"curved folds of {a} degrees, {kind}": partial(fold, angle=a, k=-1.0, **options)
        for a in (10, 20)
        for kind, options in (("automatic", {"is_automatic": True}), ("no normals", {"has_normals": False}))
    },
    "near the tip of a cone, automatic": cone,
}


def on_surface(touch, seed):
    """A touch of an exact surface as in `row`; its true curvatures are those nearest to the point."""
    try:
        surface, r = touch(seed)
    except ValueError:
        return None
    if r.status != "ok":
        return None
    at = r.frame.origin
    for _ in range(20):  # Newton's method along the gradient.
        gradient = surface.gradient(at)
        at = at - surface.level(*at) * gradient / (gradient @ gradient)
    here, points = replace(surface, point=r.frame.origin), r.domain.grid(HOLD_OUT)[0]
    local = above(here, r.frame.axes, np.array([r.k1, r.k2]), points) @ r.frame.axes
    return held(r, darboux(replace(surface, point=at))[1], local[np.isfinite(local[:, 2])])


def true_curvatures(scan, r, share, degree):
    """The curvatures (2,) at the point of the polynomial nearest to the scan over a share of the radius.

    It is None where the scan has no such points in the domain, or the polynomial does not explain them.
    """
    flat = r.domain.grid(DENSE / share**2)[0]
    over = r.frame.to_local(scan.above(r, flat[np.hypot(*flat.T) <= share * r.radius])) / r.radius
    basis = monomials(over, exponents(0, degree))
    b = np.linalg.lstsq(basis, over[:, 2], rcond=None)[0]
    if len(over) < DENSE / 2 or np.sqrt(np.mean((over[:, 2] - basis @ b) ** 2)) > EXPLAINED:
        return None
    first, second = np.eye(2) + np.outer(b[1:3], b[1:3]), np.array([[2.0 * b[3], b[4]], [b[4], 2.0 * b[5]]])
    return np.linalg.eigvals(np.linalg.solve(first, second)).real / math.sqrt(first.trace() - 1.0) / r.radius


def by_truth(scan, r):
    """Yields the kind of a fit with the degree that is true, and the touch as in `row`."""
    is_sextic = r.posterior.sextic is not None or not r.posterior.amplitude
    kind = ("facets" if r.posterior.amplitude else "no process") if is_sextic else "process"
    for share, degree in TRUTHS if is_sextic else TRUTHS[:1]:
        if r.status != "ok":
            yield f"{kind}, true degree {degree}", None
        elif (kappas := true_curvatures(scan, r, share, degree)) is not None:
            local = r.frame.to_local(scan.above(r, r.domain.grid(HOLD_OUT)[0]))
            yield f"{kind}, true degree {degree}", held(r, kappas, local)


def scan_touches(scan, count):
    """Yields what the names of rows begin with, and a fit, at `count` places of a scan."""
    for point, up in scan.places(count, 0):
        for planes, share in product(SCAN_PLANES, EXTENTS):
            cuts = sampling(180.0 / planes * np.arange(planes))
            with suppress(ValueError):  # There is an edge or a hole.
                contours = track(scan, point, up, cuts, extent=1.0 / share, step=1.0 / share / STEPS)
                yield f"scans, {planes} planes", reconstruct(point, contours, outward=up)
        with suppress(ValueError):
            yield "scans, automatic", explore(scan, point, up, farthest=0.5).result


def scan_rows(count):
    """{name: touches} of all scans, about `count` for each number of planes."""
    from .real import Scan

    rows, paths = defaultdict(list), sorted(SCANS_FOLDER.glob("*.*"))
    for path in paths:
        scan = Scan(path)
        for name, r in scan_touches(scan, max(1, round(count / len(paths) / len(EXTENTS)))):
            for kind, of in by_truth(scan, r):
                rows[f"{name}, {kind}"].append(of)
    return dict(sorted(rows.items()))


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--quick", action="store_true", help="a tenth of the touches")
    part = 10 if parser.parse_args().quick else 1
    rows = {n: [on_surface(touch, seed) for seed in range(TOUCHES // part)] for n, touch in ROWS.items()}
    if find_spec("bpy") and any(SCANS_FOLDER.glob("*.*")):
        rows |= scan_rows(ON_SCANS // part)
    else:
        print(f"There is no bpy, or there are no scans in {SCANS_FOLDER}: their rows are left out.\n")
    table(HEAD.split("|"), [row(name, touches) for name, touches in rows.items()])
    print(f"{TOUCHES // part} touches a row; {machine('numpy', 'scipy')}.")


if __name__ == "__main__":
    main()
