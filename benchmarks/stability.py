# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where reconstructions fail, and whether they say so.

`python -m benchmarks.stability [--seeds N]`, from the root of a checkout. One circumstance after the other is
led from harmless to hopeless on exact surfaces, with every method. The command prints Markdown and writes
build/charts/stability.png with four of the sweeps, and stability.csv with all. Lengths are in mm.

A warning or a refusal is due wherever

- the mean |dz| over the domain is more than three times the patch's own mean height_std, or
- the frame is turned by more than 10 degrees, where |kappa1 - kappa2| L > 0.05, and the message does not
  say that there are no principal directions.

Where all is harmless and no warning is due, at most 5 % of the cases may have one. The stated uncertainty may
not be too large either: the median of mean height_std over mean |dz| should be at most 2.

The first table is about what no contact can show, whatever the method, and about measured normals that are
turned: how often a warning was due, and how often "bayes" gave one.
"""

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import NamedTuple

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from core import METHODS, Contour, reconstruct, track
from tests import surfaces

from . import machine, parser_of, plot, table
from .accuracy import SURFACES, TURN, above, darboux, sampling
from .whole import Rays

SEEDS = 3
TOO_FAR, TURNED, UMBILIC, SMALL = 3.0, 10.0, 0.05, 0.01  # The numbers of the rule.
NOISE, NORMAL_STD = 0.05, 0.02  # mm, radians
STEPS = 12  # The number of steps of a half curve.
HOLD_OUT = 100
SADDLE = "monkey saddle"  # Planes along its lines show only a plane, so it has a sweep of its own.


class Setting(NamedTuple):
    """One touch; the defaults are harmless. Lengths are shares of the extent, angles are in degrees."""

    azimuths: tuple = (0.0, 60.0, 120.0)
    tilts: tuple = (0.0, 0.0, 0.0)
    turn: float = TURN  # The angle between azimuth 0 and d1.
    step: float = 1.0 / STEPS
    noise: float | None = None  # With None it is NOISE.
    change: Callable | None = None  # Changes curves: (curves, point, extent, rng) -> curves.
    wrap: Callable | None = None  # Changes the surface: (surface, axes, extent) -> surface.
    scale: float = 1.0  # All coordinates are multiplied by it.
    offset: float = 0.0  # All coordinates are moved by this many extents and rounded to single precision.
    normals: float | None = None  # Measured normals are turned by this many degrees, but claim NORMAL_STD.


class Sweep(NamedTuple):
    """A circumstance: its title, its values, the harmless ones of them, and what each value means."""

    title: str
    values: tuple
    benign: tuple
    setting: Callable  # Makes the Setting of a value.
    surfaces: Callable = lambda value: {n: s for n, s in SURFACES.items() if n != SADDLE}


class Outcome(NamedTuple):
    """What one method made of one touch; the numbers are NaN where the touch was refused."""

    status: str
    error: float = np.nan  # The mean |dz| as a share of the radius.
    std: float = np.nan  # The mean height_std as a share of the radius.
    turn: float = np.nan  # The frame's error in degrees; 0 at what is, or is said to be, an umbilic.
    condition: float = np.nan

    @property
    def is_due(self):
        """Whether a warning or a refusal is due."""
        return self.error > TOO_FAR * self.std or self.turn > TURNED


# Touches ---------------------------------------------------------------------------------------------


def touch(surface, extent, setting, seed):
    """(point, outward, contours). Raises ValueError where the touch is refused."""
    rng = np.random.default_rng(seed)
    axes, _ = darboux(surface)
    contours = track(
        setting.wrap(surface, axes, extent) if setting.wrap else surface,
        surface.point,
        axes[:, 2],
        sampling(setting.azimuths, setting.tilts, setting.turn),
        extent=extent,
        step=setting.step * extent,
        noise=NOISE if setting.noise is None else setting.noise * extent,
        rng=rng,
        tangent=axes[:, 0],
    )
    points = [c.points for c in contours]
    if setting.change:
        points = setting.change(points, surface.point, extent, rng)
    shift = setting.offset * extent * np.array([0.6, -0.48, 0.64])
    dtype = np.float32 if setting.offset else float
    measured = setting.normals is not None
    moved = [
        Contour(
            (setting.scale * p + shift).astype(dtype),
            noise=setting.scale * c.noise,
            normals=_measured_normals(c, axes, setting.normals, rng) if measured else None,
            normal_std=NORMAL_STD if measured else None,
        )
        for p, c in zip(points, contours, strict=True)
    ]
    return (setting.scale * surface.point + shift).astype(dtype), axes[:, 2], moved


def _measured_normals(contour, axes, degrees, rng):
    """Normals (n, 3) at the contacts of a contour, scattered by NORMAL_STD and turned about d1."""
    angle = np.radians(degrees)
    turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    found = contour.normals + rng.normal(0.0, NORMAL_STD, contour.normals.shape)
    return found @ axes @ turn.T @ axes.T


def outcome(surface, setting, point, outward, contours, method):
    """The Outcome of one method on a touch."""
    try:
        r = reconstruct(point, contours, outward=outward, method=method, degree=4)
    except ValueError:
        return Outcome("refused")
    true_axes, kappas = darboux(surface)
    grid, _ = r.domain.grid(HOLD_OUT)
    there = above(
        surface, r.frame.axes, np.array([r.patch.k1, r.patch.k2]) * setting.scale, grid / setting.scale
    )
    misses = np.abs(r.height(*grid.T) - setting.scale * (there @ r.frame.axes[:, 2])) / r.radius
    error = np.mean(np.where(np.isfinite(misses), misses, 1.0))  # A patch over nothing is off by its radius.
    rotation = true_axes.T @ r.frame.axes
    half = max(np.trace(rotation), np.trace(rotation * [-1, -1, 1]))
    turn = np.degrees(np.arccos(np.clip((half - 1.0) / 2.0, -1.0, 1.0)))
    if (kappas[1] - kappas[0]) * r.radius / setting.scale <= UMBILIC or r.posterior.is_round:
        turn = 0.0
    return Outcome(r.status, error, r.mean_height_std / r.radius, turn, r.condition_number)


# Sweeps ----------------------------------------------------------------------------------------------


def outliers(share, curves, point, extent, rng):
    """The curves with a share of the contacts lifted or lowered, normally, by a tenth of the extent."""
    return [
        np.where(
            (rng.random(len(curve)) < share)[:, None] & (curve != point).any(axis=1, keepdims=True),
            curve + rng.normal(0.0, 0.1 * extent, (len(curve), 1)) * [0.0, 0.0, 1.0],
            curve,
        )
        for curve in curves
    ]


def short(share, curves, point, extent, rng):
    """The curves, the first one cut to a share of the extent at both ends."""
    near = np.linalg.norm(curves[0] - point, axis=1) <= share * extent * 1.001
    return [curves[0][near], *curves[1:]]


def apart(distance, curves, point, extent, rng):
    """The curves moved by a distance, each in a direction of its own, so that they miss the point."""
    shifts = rng.normal(size=(len(curves), 3))
    shifts *= distance / np.linalg.norm(shifts, axis=1, keepdims=True)
    return [curve + shift for curve, shift in zip(curves, shifts, strict=True)]


def turned_curve(degrees, curves, point, extent, rng):
    """The curves, the first one turned about the normal, as if the azimuth of its plane were wrong."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return [point + (curves[0] - point) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]), *curves[1:]]


def upside_down(which, curves, point, extent, rng):
    """The curves, the first one with its heights negated if `which` is 1."""
    return [point + (curves[0] - point) * [1.0, 1.0, -1.0 if which else 1.0], *curves[1:]]


def late(distance, outward, curves, point, extent, rng):
    """The curves with contacts recorded too late, so that they are moved the way the finger slides.

    outward : whether the finger slides from the point outward, rather than from end to end
    """
    found = []
    for curve in curves:
        run = (curve[-1] - curve[0]) / np.linalg.norm(curve[-1] - curve[0])
        ahead = np.sign((curve - point) @ run)[:, None] if outward else 1.0
        found.append(
            np.where(
                (curve != point).any(axis=1, keepdims=True), curve + distance * extent * ahead * run, curve
            )
        )
    return found


class Facets(Rays):
    """A surface as triangles with edges of about `size`, which cast rays by Blender's tree."""

    def __init__(self, size, surface, axes, extent):
        from scipy.spatial import Delaunay

        count = int(np.ceil(1.5 * extent / size)) + 1
        rows, columns = np.mgrid[-count : count + 1, -count : count + 1] + 0.37
        flat = size * np.column_stack([(columns + 0.5 * rows).ravel(), np.sqrt(0.75) * rows.ravel()])
        flat = flat[np.hypot(*flat.T) < 1.25 * extent + size]
        there = surface.point + above(surface, axes, np.array(darboux(surface)[1]), flat)
        exists = np.isfinite(there).all(axis=1)
        faces = Delaunay(flat[exists]).simplices
        super().__init__(there[exists], faces)


def facets(share, surface, axes, extent):
    return Facets(share * extent / STEPS, surface, axes, extent)


def graphs(k1, k2):
    """{name: (surface, extent)}: a quadric with these curvatures, and the same with higher terms."""
    quadric = {(2, 0): k1 / 2.0, (0, 2): k2 / 2.0}
    higher = {(3, 0): 2e-4, (2, 1): -3e-4, (1, 2): 1e-4, (0, 3): 2e-4, (4, 0): -2e-6, (2, 2): 3e-6}
    return {
        "quadric": (surfaces.graph(quadric), 13.0),
        "quartic": (surfaces.graph({**quadric, **higher}), 13.0),
    }


def by_curvature(share):
    """{name: (surface, extent)}, where the extent is a share of the least radius of curvature."""
    curvature = {n: max(abs(s.k1), abs(s.k2)) for n, (s, _) in SURFACES.items() if n != SADDLE}
    return {name: (SURFACES[name][0], share / k) for name, k in curvature.items() if k}


TURNS = (0, 15, 30, 45, 60, 75, 90)
DIFFERENCES = (0, 1e-12, 1e-9, 1e-6, 1e-4, 1e-3, 0.01, 0.03, 0.1, 0.3)
SWEEPS = (
    Sweep("degrees between planes", (60, 40, 30, 20, 15, 10, 5, 3, 2, 1.5, 1.01, 0.99, 0.5, 0.1, 0), (60, 40),
          lambda v: Setting(azimuths=(0, v, 2 * v))),
    Sweep("degrees of tilt", (0, 10, 20, 30, 40, 50, 60, 70, 75, 80), (0, 10, 20),
          lambda v: Setting(tilts=(v, -v, v))),
    Sweep("degrees of azimuth against d1", TURNS, TURNS, lambda v: Setting(turn=v)),
    Sweep("degrees of azimuth, no noise", TURNS, TURNS, lambda v: Setting(turn=v, noise=0.0)),
    Sweep("degrees of azimuth, monkey saddle", TURNS, (),
          lambda v: Setting(turn=v), lambda v: {SADDLE: SURFACES[SADDLE]}),
    Sweep("near an umbilic: (k2 - k1) L", DIFFERENCES, DIFFERENCES,
          lambda v: Setting(), lambda v: graphs(-0.03 - v / 13.0, -0.03)),
    Sweep("near a parabolic point: k2 L", DIFFERENCES, DIFFERENCES,
          lambda v: Setting(), lambda v: graphs(-0.04, v / 13.0)),
    Sweep("near a planar point: k2 L = -k1 L", DIFFERENCES, DIFFERENCES,
          lambda v: Setting(), lambda v: graphs(-v / 13.0, v / 13.0)),
    Sweep("noise, of the extent", (0, 1e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1),
          (0, 1e-4, 1e-3, 2e-3, 5e-3), lambda v: Setting(noise=v)),
    Sweep("step, of the extent", (0.01, 0.02, 0.04, 0.08, 0.1, 0.12, 0.16, 0.2), (0.08, 0.1, 0.12),
          lambda v: Setting(step=v)),
    Sweep("extent, of the radius of curvature", (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1, 1.2, 1.5),
          (0.3, 0.4, 0.5), lambda v: Setting(), by_curvature),
    Sweep("facets, of the step", (0.1, 0.2, 0.5, 1, 2, 3, 5, 8), (0.1, 0.2, 0.5),
          lambda v: Setting(wrap=partial(facets, v))),
    Sweep("outliers, of the contacts", (0, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5), (0, 0.02),
          lambda v: Setting(change=partial(outliers, v))),
    Sweep("one curve cut to", (1, 0.8, 0.6, 0.4, 0.3, 0.2, 0.1), (1, 0.8),
          lambda v: Setting(change=partial(short, v))),
    Sweep("curves that miss the point, mm", (0, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 1), (0, 0.02, 0.05),
          lambda v: Setting(change=partial(apart, v))),
    Sweep("extents from the origin, float32", (0, 10, 100, 1e3, 1e4, 1e5, 1e6), (0, 10, 100, 1e3),
          lambda v: Setting(offset=v)),
    Sweep("unit, mm", (1e-6, 1e-3, 1, 1e3, 1e6), (1e-6, 1e-3, 1, 1e3, 1e6), lambda v: Setting(scale=v)),
)  # fmt: skip


# The normals of these surfaces are along z, because curves are changed in the axes of the world.
BENT = {"quadric": (-0.04, -0.01), "saddle": (-0.04, 0.02)}
LINES = {  # The polynomials r^n sin(n theta) are 0 along planes at 0, 60 and 120 degrees.
    "sin 3 theta": {(2, 1): 3, (0, 3): -1},
    "sin 6 theta": {(5, 1): 6, (3, 3): -20, (1, 5): 6},
    "sin 9 theta": {(8, 1): 9, (6, 3): -84, (4, 5): 126, (2, 7): -36, (0, 9): 1},
}


def hidden(name, share):
    """Quadrics and a term of LINES, which is a share of the radius at the rim and 0 along the curves."""
    order = max(map(sum, LINES[name]))
    added = {ij: share * c / 13.0 ** (order - 1) for ij, c in LINES[name].items()}
    bent = {n: {(2, 0): k1 / 2.0, (0, 2): k2 / 2.0} for n, (k1, k2) in BENT.items()}
    return {n: (surfaces.graph({**terms, **added}), 13.0) for n, terms in bent.items()}


def upright(value):
    return {f"{n} {kind}": s for n, k in BENT.items() for kind, s in graphs(*k).items()}


def waves(length):
    """Quadrics with oblique waves of this length in mm added, with amplitudes of 0.1 and 0.3 mm."""
    found = {}
    for name, (k1, k2) in BENT.items():
        for height in (0.1, 0.3):
            p, q = 2.0 * np.pi / length * np.array([0.8, 0.6])
            found[f"{name} {height:g}"] = (_waves(k1, k2, height, p, q), 12.0)
    return found


def _waves(k1, k2, height, p, q):
    def level(x, y, z):
        return z - (k1 * x * x + k2 * y * y) / 2.0 - height * (np.cos(p * x + q * y) - 1.0)

    def gradient(r):
        steep = height * np.sin(p * r[0] + q * r[1])
        return np.array([-k1 * r[0] + p * steep, -k2 * r[1] + q * steep, 1.0])

    return surfaces.Exact(level, gradient, np.zeros(3), k1, k2)


LATE = (0.01, 0.02, 0.05, 0.1)
UNTOLD = (
    *(
        Sweep(f"{name} added, of the radius at the rim", (0.005, 0.02, 0.05), (),
              lambda v: Setting(turn=0.0), partial(hidden, name))
        for name in LINES
    ),
    Sweep("one of three curves turned by, degrees", (5, 15, 45, 90), (),
          lambda v: Setting(change=partial(turned_curve, v)), upright),
    Sweep("one of four curves turned by, degrees", (5, 15, 45, 90), (),
          lambda v: Setting((0, 45, 90, 135), (0, 0, 0, 0), change=partial(turned_curve, v)), upright),
    Sweep("one of three curves flipped", (0, 1), (),
          lambda v: Setting(change=partial(upside_down, v)), upright),
    Sweep("one of four curves flipped", (0, 1), (),
          lambda v: Setting((0, 45, 90, 135), (0, 0, 0, 0), change=partial(upside_down, v)), upright),
    Sweep("felt from end to end, late by, of the extent", LATE, (),
          lambda v: Setting(change=partial(late, v, False)), upright),
    Sweep("felt from the point outward, late by, of the extent", LATE, (),
          lambda v: Setting(change=partial(late, v, True)), upright),
    Sweep("waves of, mm, touched each mm", (3, 5, 6, 8, 10, 12), (), lambda v: Setting(), waves),
    Sweep("measured normals turned by, degrees", (0, 1, 2, 5), (), lambda v: Setting(normals=v)),
)  # fmt: skip
ALL = SWEEPS + UNTOLD


class Key(NamedTuple):
    """A touch, by the number of its sweep in ALL, the value, the name of the surface, and the seed."""

    sweep: int
    value: float
    surface: str
    seed: int

    @property
    def is_benign(self):
        return self.value in ALL[self.sweep].benign


def outcomes(key):
    """{method: Outcome} of a touch."""
    sweep = ALL[key.sweep]
    setting, (surface, extent) = sweep.setting(key.value), sweep.surfaces(key.value)[key.surface]
    try:
        touched = touch(surface, extent, setting, [key.seed, *map(ord, key.surface)])
    except ValueError:
        return dict.fromkeys(METHODS, Outcome("refused"))
    return {method: outcome(surface, setting, *touched, method) for method in METHODS}


def is_quiet(found):
    """Whether a warning or a refusal is due that was not given."""
    return found.status == "ok" and found.is_due


# Tables and the sheet --------------------------------------------------------------------------------


def _harmless(of):
    """Outcomes at harmless values where no warning is due.

    A value must be harmless to the method too: its median error there is below SMALL.
    """
    rows = {}
    for key, found in of:
        if key.is_benign:
            rows.setdefault((key.sweep, key.value), []).append(found)
    small = [row for row in rows.values() if np.nanmedian([found.error for found in row]) < SMALL]
    return [found for row in small for found in row if not found.is_due]


def rule_table(results):
    print("For each method the cases where a warning or a refusal is due (all refusals count) and those")
    print("where it was not given; the harmless cases, and the share of them that were warned of; and the")
    print("median of mean height_std over mean |dz|.\n")
    rows = []
    for method in METHODS:
        of = [(key, found[method]) for key, found in results.items()]
        due = [f for _, f in of if f.is_due or f.status == "refused"]
        benign = _harmless(of)
        widths = [f.std / f.error for _, f in of if f.error > 0.0]
        rows.append([
            method,
            f"{len(of)}",
            f"{len(due)}",
            f"{sum(map(is_quiet, due))}",
            f"{len(benign)}",
            f"{100 * np.mean([f.status != 'ok' for f in benign]):.1f} %" if benign else "",
            f"{np.median(widths):.2f}",
        ])  # fmt: skip
    table(["method", "cases", "needed", "needed but missing", "harmless", "warned of", "width"], rows)
    print("A warning was due and not given for:\n")
    for key, found in results.items():
        for method in METHODS:
            f = found[method]
            if is_quiet(f):
                print(
                    f"- {method}, {SWEEPS[key.sweep].title} {key.value:g}, {key.surface}: "
                    f"error {100 * f.error:.2f} %, stated {100 * f.std:.2f} %, turned {f.turn:.0f} degrees"
                )
    print()


def of_value(results, number, value, method):
    """Outcomes of a method at a value of a sweep, and medians of error, std and condition of those made."""
    of = [found[method] for key, found in results.items() if (key.sweep, key.value) == (number, value)]
    made = [f for f in of if f.status != "refused"] or [Outcome("refused")]
    return of, [np.median([getattr(f, what) for f in made]) for what in ("error", "std", "condition")]


def untold_table(results):
    print("What no contact can tell, and normals that contradict contacts: bayes, medians in % of L.\n")
    rows = []
    for number, sweep in enumerate(UNTOLD, len(SWEEPS)):
        for value in sweep.values:
            of, medians = of_value(results, number, value, "bayes")
            rows.append([
                sweep.title,
                f"{value:g}",
                f"{len(of)}",
                f"{sum(f.is_due for f in of)}",
                f"{sum(map(is_quiet, of))}",
                f"{sum(f.status != 'ok' for f in of)}",
                *(f"{100.0 * median:.2f}" for median in medians[:2]),
            ])  # fmt: skip
    table(["change", "value", "cases", "needed", "needed but missing", "warned", "error", "stated"], rows)


HEAD = ["sweep", "value", "method", "cases", "error", "height_std", "condition", "warned", "refused"]
HEAD += ["not given"]


def rows_of(results):
    """A row for each sweep, value and method: medians over what was not refused, and shares of all."""
    rows = []
    for number, sweep in enumerate(SWEEPS):
        for value in sweep.values:
            for method in METHODS:
                found, medians = of_value(results, number, value, method)
                refused = np.mean([f.status == "refused" for f in found])
                warned = np.mean([f.status not in ("ok", "refused") for f in found])
                shares = [round(share, 3) for share in (warned, refused)]
                quiet = sum(map(is_quiet, found))
                rows.append(
                    [sweep.title, value, method, len(found), *(f"{m:.3g}" for m in medians), *shares, quiet]
                )
    return rows


LOOKS = {  # color, line, letter
    "bayes": (plot.BLUE, "-", "B"),
    "tagc": (plot.VERMILION, "--", "T"),
    "quadratic-variation": (plot.GREEN, "-.", "Q"),
    "least-squares": ("#777777", ":", "L"),
}
# The sweeps in the picture; its table has all.
SHOWN = ("degrees between planes", "noise, of the extent", "outliers, of the contacts", "one curve cut to")
ERRORS, CONDITIONS = (2e-5, 20.0), (10.0, 1e8)
ORANGE, DARK, HARMLESS = (0.95, 0.65, 0.1), (0.15, 0.15, 0.15), "#e4eee4"


def draw(rows, caption):
    """Draws build/charts/stability.png, with a panel for each sweep of SHOWN, and writes stability.csv."""
    figure = plot.plt.figure(figsize=(8.6, 6.2), layout="constrained")
    figure.suptitle("Where reconstructions fail, and whether they say so", fontsize=12, weight="bold")
    legend, panels = figure.subfigures(2, 1, height_ratios=(0.08, 1.0))
    for number, (part, title) in enumerate(zip(panels.subfigures(2, 2).flat, SHOWN, strict=True)):
        (sweep,) = (sweep for sweep in SWEEPS if sweep.title == title)
        axes = part.subplots(3, 1, height_ratios=(3, 1.2, 1.4))
        of = {m: [row for row in rows if (row[0], row[2]) == (title, m)] for m in METHODS}
        panel(axes, sweep, of, number % 2 == 0)
    handles = [
        Line2D([], [], color=color, ls=line, label=f"{letter}: {method}")
        for method, (color, line, letter) in LOOKS.items()
    ]
    handles.append(Line2D([], [], color=plot.BLUE, ls="", marker=".", label="bayes: mean height_std"))
    shares = (
        (ORANGE, "share with a warning"),
        (DARK, "share refused"),
        (HARMLESS, "harmless: no warning needed"),
    )
    handles += [Patch(color=color, label=label) for color, label in shares]
    legend.legend(handles=handles, loc="center", ncols=4, fontsize=plot.LABEL_SIZE)
    plot.save(figure, "stability", caption, HEAD, rows)


def panel(axes, sweep, of, first):
    """Draws errors, condition numbers and shares of a sweep, one below the other."""
    places = np.arange(len(sweep.values))
    errors, conditions, shares = axes
    errors.set_title(sweep.title, fontsize=8)
    for method, rows in of.items():
        color, line, _ = LOOKS[method]
        errors.plot(places, np.clip([float(r[4]) for r in rows], *ERRORS), line, color=color, lw=1.4)
        conditions.plot(places, np.clip([float(r[6]) for r in rows], *CONDITIONS), line, color=color, lw=1.2)
    bayes = of["bayes"]
    errors.plot(places, np.clip([float(r[5]) for r in bayes], *ERRORS), ".", color=plot.BLUE, ms=5)
    errors.set(yscale="log", ylim=ERRORS, yticks=[1e-4, 1e-2, 1])
    conditions.set(yscale="log", ylim=CONDITIONS, yticks=[1e2, 1e6])
    warned, refused = (np.array([[r[i] for r in rows] for rows in of.values()]) for i in (7, 8))
    mixture = np.stack([1.0 - warned - refused, warned, refused], axis=-1) @ [(1.0, 1.0, 1.0), ORANGE, DARK]
    shares.imshow(mixture, aspect="auto")
    shares.set_yticks(range(len(METHODS)), [LOOKS[m][2] for m in METHODS], fontsize=6)
    shares.set_xticks(
        places, [f"{v:g}" for v in sweep.values], fontsize=6, rotation=45 if len(places) > 8 else 0
    )
    shares.grid(False)
    for number, value in enumerate(sweep.values):
        if value in sweep.benign:
            errors.axvspan(number - 0.5, number + 0.5, color=HARMLESS, zorder=0)
    for part in (errors, conditions):
        part.set_xlim(-0.5, len(places) - 0.5)
        part.set_xticks([])
        part.tick_params(labelsize=6, labelleft=first)
        part.minorticks_off()
    if first:
        errors.set_ylabel("error / L", fontsize=7)
        conditions.set_ylabel("condition", fontsize=7)


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--seeds", type=int, default=SEEDS, help="of the noise (%(default)s)")
    options = parser.parse_args()
    keys = [
        Key(number, value, surface, seed)
        for number, sweep in enumerate(ALL)
        for value in sweep.values
        for surface in sweep.surfaces(value)
        for seed in range(options.seeds)
    ]
    with ProcessPoolExecutor() as pool:
        found = dict(zip(keys, pool.map(outcomes, keys, chunksize=8), strict=True))
    results = {key: of for key, of in found.items() if key.sweep < len(SWEEPS)}
    untold_table(found)
    rule_table(results)
    used = machine("numpy", "scipy", "bpy")
    caption = (
        "Medians over ten exact surfaces (quadrics and quartics near the special points) and "
        f"{options.seeds} seeds. All else is harmless: planes 60 degrees apart, {STEPS} steps to a "
        f"side, noise of {NOISE:g} "
        "mm, radii L of 12 to 15 mm. Error: mean |dz| over the domain. Below it are the condition number and "
        f"the shares of the touches with a warning and of the refused. On {used}."
    )
    draw(rows_of(results), caption)
    print(f"Errors are in % of the radius; {used}.")


if __name__ == "__main__":
    main()
