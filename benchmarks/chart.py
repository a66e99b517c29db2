# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed against accuracy: each fit of this project, and what else one could take, on the same contacts.

`python -m benchmarks.chart [--quick]`, from the root of a checkout. A peer whose package is missing is left
out with a message. The command writes build/charts/speed_accuracy.png and .csv: milliseconds from contacts to
the heights of the hold-out, and micrometers by which these are off, for the exact surfaces, plane sets and
noise levels of benchmarks.accuracy (`--quick` takes one plane set and one seed). The methods take turns, case
by case, in one process on one thread.
"""

import sys
from functools import cache, partial
from importlib.util import find_spec
from itertools import groupby
from statistics import median
from typing import NamedTuple

import numpy as np

from core import explore, track
from tools import blender

from . import accuracy, machine, parser_of, peers, plot, timed

QUICK_PLANES = accuracy.EXACT_PLANES[:1]
SEEDS = 4  # The number of seeds of the noise in the full run.
REPEATED = 0.02  # A method that takes fewer seconds is run three times more, for a median.
LEAST_COVERED = 0.9  # A surface that covers less of the hold-out has failed.
SAME = ("d2", "d3", "d4", "d6")  # Degrees whose marks would cover that of "auto".
HOLLOW = "(hollow)"  # The label of methods that get more data than the others, so they do not compete.
# Distributions whose names differ from their modules'.
DISTRIBUTIONS = {"sklearn": "scikit-learn"}
TIME_LIMITS = (0.3, 300.0)  # The limits of the axes.
OFF_SCALE = 400.0  # Errors above this many um are not to scale: a band at the top has their values.
HEIGHT_LIMITS = (2.5, 1500.0)


class Method(NamedTuple):
    """A method in a chart.

    `run` maps a case of benchmarks.accuracy to a peers.Fit.
    """

    label: str
    family: str
    run: object
    says: str  # What the label stands for.
    needs: tuple = ()
    planes: int = 3
    touches: bool = False  # Whether it touches by itself, so that `run` is not used.


OURS, PAPER, INTERPOLATION = "bayes: this project's default", "the paper's fits", "interpolation"
PROCESSES, SPLINES, MESHES = "Gaussian processes", "splines", "meshes"
FIXED = "fixed degree, under the mark of auto"
LOOKS = {
    OURS: (plot.BLUE, "o"),
    PAPER: (plot.VERMILION, "s"),
    INTERPOLATION: (plot.GREEN, "^"),
    PROCESSES: (plot.PURPLE, "D"),
    SPLINES: (plot.ORANGE, "v"),
    MESHES: (plot.BLACK, "X"),
}


def _bayes(label, says, planes=3, **options):
    return Method(label, OURS, partial(accuracy.ours, **options), says, planes=planes)


def _paper(label, says, method, **options):
    return Method(label, PAPER, partial(accuracy.ours, method=method, **options), says)


def _powers(label, method, weights, says, **options):
    return [
        _paper(f"{label} {w:.0e}".replace("e+0", "e"), says, method, weight=w, **options) for w in weights
    ]


def _peer(label, family, says, fit, *needs, **options):
    return Method(label, family, partial(fit, **options), says, needs)


METHODS = [
    *(_bayes(f"d{d}", FIXED, degree=d) for d in (2, 3, 4, 6)),
    _bayes("auto", "degree by evidence", degree="auto"),
    *(_bayes(f"{m} planes", f"degree 4, from more contacts {HOLLOW}", planes=m, degree=4) for m in (4, 5)),
    Method("auto touch", OURS, None, f"own extent and step, tracking included {HOLLOW}", touches=True),
    *_powers("TAGC", "tagc", (1e2, 1e3, 1e4), "total |K|, weight; by Newton"),
    *_powers("desc.", "tagc", (1e2, 1e3, 1e4), "the same by steepest descent", solver="descent"),
    *_powers("QV", "quadratic-variation", (1e3, 1e5), "quadratic variation, weight"),
    _paper("LS", "least squares, degree 4", "least-squares"),
    _paper("quadric", "frame and curvatures only", "least-squares", degree=2),
    *(_peer(label, INTERPOLATION, f"scipy, {name[4:]}, {accuracy.settings(accuracy.SPLINES[name])}",
            peers.radial_basis, **accuracy.SPLINES[name])
      for label, name in (("RBF tp", "RBF thin plate"), ("RBF cubic", "RBF cubic"))),
    _peer("MLS", INTERPOLATION, "moving least squares, quadrics", peers.moving_least_squares),
    *(_peer(f"jet {d}", INTERPOLATION, "one free polynomial, degree", peers.jet, degree=d) for d in (3, 4)),
    _peer("GP Matérn", PROCESSES, "scikit-learn, nu = 5/2", peers.gaussian_process, "sklearn"),
    _peer("GP RBF", PROCESSES, "squared exponential", peers.gaussian_process, "sklearn", nu=np.inf),
    _peer("spline", SPLINES, "scipy, SmoothBivariateSpline", peers.smoothing_spline),
    _peer("Poisson+n", MESHES, "pymeshlab, with the true normals", peers.screened_poisson, "pymeshlab",
          true_normals=True),
    _peer("Poisson", MESHES, "normals estimated from the contacts", peers.screened_poisson, "pymeshlab",
          true_normals=False),
]  # fmt: skip


class Remembering:
    """A surface that remembers the hit of each ray, because touches differ only in their noise."""

    def __init__(self, surface):
        self.ray_cast = cache(surface.ray_cast)


class Touch(NamedTuple):
    """A case, and contours in more planes through its point."""

    case: accuracy.Case
    contours: dict  # The contours by the number of planes.
    explored: object  # A function: calls core.explore there, with this extent as the farthest.


class Result(NamedTuple):
    label: str
    noise: float
    ms: float
    error: float  # It is NaN where the method has failed.


# Measurement -----------------------------------------------------------------------------------------


def touch_of(name, planes, noise, seed):
    surface, extent = accuracy.SURFACES[name]
    remembering = Remembering(surface)  # The time excludes rays, because they are slow in Python.
    number = 1000 * seed + list(accuracy.SURFACES).index(name)
    case = accuracy.exact_case(name, planes, noise, number)
    contours = {3: case.contours}
    lengths = {"extent": extent, "step": extent / accuracy.STEPS, "tangent": case.axes[:, 0], "noise": noise}
    for count in (4, 5):
        cuts = accuracy.sampling(180.0 / count * np.arange(count), turn=accuracy.TURN)
        contours[count] = track(surface, case.point, case.axes[:, 2], cuts, rng=number, **lengths)
    cuts = accuracy.sampling(*accuracy.PLANES[planes], accuracy.TURN)
    sensor = {"farthest": extent, "tangent": case.axes[:, 0], "noise": noise, "rng": number}
    explored = partial(explore, remembering, case.point, case.axes[:, 2], cuts, **sensor)
    return Touch(case, contours, explored)


def fit_result(method, touch):
    """Seconds, and the mean |dz| in um over the part of the hold-out that the fit covers.

    The error is NaN where that part is less than LEAST_COVERED.
    """
    case = touch.case._replace(contours=touch.contours[method.planes])

    def touched():
        r = touch.explored().result
        return peers.Fit(r.frame.axes, r.height)

    def heights():
        fit = touched() if method.touches else method.run(case)
        x, y, z = (case.hold_out @ fit.axes).T
        return fit.height(x, y) - z

    if method.touches:
        touched()  # The surface now remembers the rays.
    seconds, miss = typical(heights)
    covered = np.isfinite(miss)
    return seconds, 1e3 * np.abs(miss[covered]).mean() if covered.mean() >= LEAST_COVERED else np.nan


def typical(run):
    """Seconds of processor time of a call, and what it returned.

    The time of a quick call is the median of three more calls.
    """
    seconds, found = timed(run)
    if seconds < REPEATED:
        seconds = median(timed(run)[0] for _ in range(3))
    return seconds, found


def measure(methods, touch):
    """The results of all methods on one touch; an exception is a failure."""
    for method in methods:
        try:
            seconds, error = fit_result(method, touch)
        except Exception as problem:  # Peers raise exceptions of all kinds if they find nothing.
            print(f"{method.label}: {problem}", file=sys.stderr)
            seconds, error = np.nan, np.nan
        yield Result(method.label, touch.case.noise, 1e3 * seconds, error)


def available(methods):
    missing = {module for method in methods for module in method.needs if find_spec(module) is None}
    for module in sorted(missing):
        out = ", ".join(method.label for method in methods if module in method.needs)
        print(f"{DISTRIBUTIONS.get(module, module)} is not installed: {out} left out")
    return [method for method in methods if not missing & set(method.needs)]


def rows_of(methods, results):
    """Head and rows of the table, a row for each method and noise.

    Medians and quartiles are over the cases in which the method did not fail.
    """
    head = ["method", "family", "meaning", "noise mm", "planes", "cases", "failed share"]
    head += [f"{measure} {part}" for measure in ("ms", "um") for part in ("q1", "median", "q3")]
    rows = []
    for noise in accuracy.NOISES:
        for method in methods:
            of = [(r.ms, r.error) for r in results if (r.label, r.noise) == (method.label, noise)]
            good = [values for values in of if np.isfinite(values).all()] or [np.full(len(of[0]), np.nan)]
            failed = np.mean([not np.isfinite(values).all() for values in of])
            quartiles = np.quantile(good, (0.25, 0.5, 0.75), axis=0).T.ravel()
            of_what = [method.label, method.family, method.says, noise, method.planes, len(of)]
            rows.append([*of_what, round(failed, 3), *(float(f"{value:.4g}") for value in quartiles)])
    return head, rows


# Drawing ---------------------------------------------------------------------------------------------


class Mark(NamedTuple):
    """A method in a panel: quartiles of time and of error."""

    label: str
    family: str
    more: bool  # Whether it has more data than the others.
    x: tuple
    y: tuple


def marks_of(table, noise):
    """Marks of the methods that did not always fail."""
    head, rows = table
    time, error = (head.index(f"{what} q1") for what in ("ms", "um"))
    return [
        Mark(row[0], row[1], HOLLOW in row[2], row[time : time + 3], row[error : error + 3])
        for row in rows
        if row[3] == noise and np.isfinite(row[time]) and row[0] not in SAME
    ]


def panel(axes, marks, noise, limits, off_scale):
    """Draws marks with quartiles and labels; those off the scale are in a band at the top, with values."""
    axes.set(xscale="log", yscale="log", xlim=TIME_LIMITS, ylim=limits)
    axes.set_title(f"noise {noise:g} mm" if noise else "no noise")
    for ticks in (axes.xaxis, axes.yaxis):
        ticks.set_major_formatter(lambda value, _: f"{value:g}" if value < off_scale else "")
    texts, places, beyond = [], [], 0
    for mark in marks:
        color, shape = LOOKS[mark.family]
        x, y, text = mark.x[1], mark.y[1], mark.label
        if y > off_scale:
            text = f"{text} ↑ {y / 1e3:.1f} mm" if y < 1e4 else f"{text} ↑ {y / 1e3:.0f} mm"
            y, beyond = limits[1] * 0.84 * 0.7**beyond, beyond + 1
        else:
            axes.plot([x, x], mark.y[::2], color=color, lw=0.8, alpha=0.35, zorder=2)
            axes.plot(mark.x[::2], [y, y], color=color, lw=0.8, alpha=0.35, zorder=2)
        face, edge = ("white", color) if mark.more else (color, "white")
        axes.plot(x, y, shape, mfc=face, mec=edge, ms=7.0, mew=0.8, zorder=3)
        places.append((x, y))
        texts.append((text, plot.dark(color)))
    if beyond:
        axes.axhspan(off_scale, limits[1], color="#f3f3f3", zorder=0)
    plot.label(axes, texts, np.array(places))


def pareto(axes, marks):
    """Draws steps along the methods that no other beats in both time and error.

    Methods with more data and those off the scale do not count.
    """
    best, front = np.inf, []
    for mark in sorted((m for m in marks if not m.more and m.y[1] <= OFF_SCALE), key=lambda m: m.x[1]):
        if mark.y[1] < best:
            best = mark.y[1]
            front.append((mark.x[1], best))
    x, y = zip(*front, (axes.get_xlim()[1], best), strict=True)
    axes.plot(x, y, drawstyle="steps-post", color="#999999", lw=1.2, ls="--", zorder=1)


def key(axes, methods):
    """Writes what the labels stand for, family by family."""
    axes.axis("off")
    lines = []
    for family, of in groupby(methods, key=lambda method: method.family):
        lines.append((LOOKS[family], family, True))
        for says, same in groupby(of, key=lambda method: method.says):
            lines.append((LOOKS[family], f"{_listed([method.label for method in same])}: {says}", False))
    height = 1.0 / len(lines)
    for line, ((color, shape), text, heading) in enumerate(lines):
        y = 1.0 - (line + 0.5) * height
        look = {"color": plot.dark(color), "weight": "bold" if heading else "normal", "fontsize": 8}
        axes.text(0.04, y, text, transform=axes.transAxes, va="center", **look)
        if heading:
            axes.plot(0.01, y, shape, color=color, ms=7.0, transform=axes.transAxes, clip_on=False)


def _listed(labels):
    """Labels in one string, as in "TAGC 1e2, 1e3": the word that all begin with is written once."""
    first = labels[0].split()[0] + " "
    return ", ".join([labels[0], *(text.removeprefix(first) for text in labels[1:])])


def draw_heights(table, methods, caption):
    figure, grid = plot.plt.subplots(2, 2, figsize=(8.6, 8.6))
    figure.subplots_adjust(left=0.07, right=0.99, top=0.92, bottom=0.07, hspace=0.22, wspace=0.13)
    figure.suptitle("Surface patches from three curves: speed and accuracy", fontsize=12, weight="bold")
    for axes, noise in zip(grid.flat, accuracy.NOISES, strict=False):
        marks = marks_of(table, noise)
        panel(axes, marks, noise, HEIGHT_LIMITS, OFF_SCALE)
        pareto(axes, marks)
        axes.set_xlabel("time, ms")
    for axes in grid[:, 0]:
        axes.set_ylabel("error of the height, µm")
    key(grid[1, 1], methods)
    plot.save(figure, "speed_accuracy", caption, *table)


# Command ---------------------------------------------------------------------------------------------


def touches(quick):
    for name in accuracy.SURFACES:
        for planes in QUICK_PLANES if quick else accuracy.EXACT_PLANES:
            for noise in accuracy.NOISES:
                for seed in range(SEEDS if noise and not quick else 1):
                    yield touch_of(name, planes, noise, seed)


def measured(methods, quick):
    """The results of all touches."""
    found = []
    with blender.quiet():  # One of MeshLab's filters prints to standard output.
        for i, touch in enumerate([touch_of("pear", QUICK_PLANES[0], 0.02, 0), *touches(quick)]):
            results = list(measure(methods, touch))
            found += results if i else []  # The first touch is for warming up.
    return found


def caption_of(methods, quick):
    modules = {module for method in methods for module in method.needs}
    packages = sorted(DISTRIBUTIONS.get(module, module) for module in modules)
    sets, seeds = (1, 1) if quick else (len(accuracy.EXACT_PLANES), SEEDS)
    cases = (
        f"Medians and quartiles over {len(accuracy.SURFACES)} exact surfaces, patches of 24 to 30 mm, plane "
        f"sets ({sets}) and seeds of the noise ({seeds}); all methods take turns, after a warm-up. "
    )
    heights = (
        f"Error: mean |dz| at some {accuracy.HOLD_OUT} points of the true surface. Time: processor time from "
        "the contacts to the heights there, including the frame. Dashed: Pareto front, given three curves. "
        "Gray: off scale. "
    )
    return f"{cases}{heights}On {machine('numpy', 'scipy', *packages)}."


def main():
    parser = parser_of(__doc__)
    parser.add_argument("--quick", action="store_true", help="one plane set and seed")
    options = parser.parse_args()
    methods = available(METHODS)
    results = measured(methods, options.quick)
    draw_heights(rows_of(methods, results), methods, caption_of(methods, options.quick))


if __name__ == "__main__":
    main()
