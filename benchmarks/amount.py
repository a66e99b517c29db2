# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How few contacts, and how few sampling planes, are enough: the error against the amount of data.

`python -m benchmarks.amount [--quick]`, from the root of a checkout. It prints Markdown tables of the errors.
For each noise it prints from how many contacts on the error is at most 1.25 times that with the most, and how
many contacts core.explore takes by itself. It draws build/charts/amount.png.

The surfaces are those of benchmarks.accuracy and random shapes like its own. Each plane is tracked with
contacts close together, and evenly spread ones are taken from these, so that noise and extent stay the same.
Where core.explore chooses, it touches anew. The error is the mean |dz| over a hold-out, which is the same for
all rows of a surface: some 300 points above the domain of the curves in three planes. Lengths are in mm,
errors in micrometers.
"""

import argparse
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache, partial
from typing import NamedTuple

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from core import SamplingPlane, explore, track
from core.patch.domain import closed_spline_domain
from core.patch.monge import exponents, monomials

from . import accuracy, plot
from .plot import plt

FINE = 96  # The number of steps with which half curves are tracked.
STEPS = (2, 3, 4, 6, 8, 12, 16, 24, 32)  # The numbers that are taken: 12 to 192 contacts in three planes.
PLANES = (3, 4, 5, 6)
TOTAL, EACH = 72, 24  # Contacts of all curves together, and of each curve, where the number of planes varies.
ENOUGH = 1.25  # Contacts are enough if the error is at most this multiple of that with the most contacts.
BAYES, TAGC, BOUND = "Bayes, degree 4", "TAGC", "Cramér-Rao bound, degree 4"
CHOSEN = "as many as core.explore takes"
METHODS = {BAYES: accuracy.ours, TAGC: partial(accuracy.ours, method="tagc")}
LOOKS = {  # By noise: color, mark, and the label's place at the line's end.
    0.0: (plot.BLUE, "o", "top"),
    0.02: (plot.GREEN, "s", "bottom"),
    0.1: (plot.VERMILION, "^", "center"),
}
TAGC_NOISE = 0.02  # The chart shows TAGC for this noise only, the table for all.
BEST = {degree: f"best polynomial of degree {degree}" for degree in (4, 6)}
CAPTION = (
    "Marks: bayes of degree 4, medians and quartiles over {} exact surfaces and {} random shapes, radii of "
    "curvature from 15 mm, extents of 10 to 15 mm; seeds of noise: {}. Contacts are spread evenly over the "
    "same extent, whatever their number, and counted without the reference point; planes are at equal turns. "
    "Hold-out: some 300 points above the domain of the curves in three planes, the same whatever was "
    "touched. Limits: the polynomial nearest to the hold-out itself, and the Cramér-Rao bound of unbiased "
    "fits of the visible terms to degree 4 ({} contacts on the right), below which a prior may go. Without "
    "noise the error stays at what three planes cannot show; a fourth shows most of that. TAGC takes its "
    "curvatures from the ten contacts of each curve nearest to the point, which span less the more there are."
)


class Touch(NamedTuple):
    """How much was touched: the number of planes, and of contacts on each half curve."""

    planes: int
    steps: int

    @property
    def contacts(self):
        return 2 * self.planes * self.steps


BY_CONTACTS = [Touch(3, steps) for steps in STEPS]
SAME_TOTAL = [Touch(planes, round(TOTAL / (2 * planes))) for planes in PLANES]
SAME_EACH = [Touch(planes, EACH // 2) for planes in PLANES]
TOUCHES = sorted({*BY_CONTACTS, *SAME_TOTAL, *SAME_EACH})


class Place(NamedTuple):
    """Where a surface is touched, how far, and what is true there; see accuracy.Case."""

    surface: object
    point: np.ndarray
    extent: float
    axes: np.ndarray
    kappas: tuple[float, float]

    def touched(self, touch, planes, noise, seed, **more):
        """What core.track or core.explore finds in planes at equal turns."""
        azimuths = np.radians(accuracy.TURN) + np.pi * np.arange(planes) / planes
        sampling = [SamplingPlane(azimuth) for azimuth in azimuths]
        more |= {"extent": self.extent, "noise": noise, "rng": seed, "tangent": self.axes[:, 0]}
        return touch(self.surface, self.point, self.axes[:, 2], sampling, **more)

    def tracked(self, planes, noise, seed):
        """Contours with FINE steps to a half curve."""
        return self.touched(track, planes, noise, seed, step=self.extent / FINE)


class Remembering:
    """A surface that remembers the hit of each ray, because touches differ only in their noise."""

    def __init__(self, surface):
        self.ray_cast = cache(surface.ray_cast)


def find(key):
    """The Place of an exact surface's name or of the seed of a random shape, and its hold-out (m, 3)."""
    if key in accuracy.SURFACES:
        return _at(*accuracy.SURFACES[key])
    rng = np.random.default_rng(key)
    while True:
        surface, extent = accuracy._random_shape(rng), rng.uniform(10.0, 13.0)
        # Shapes are as curved as in accuracy.random_cases.
        kappas = None if surface is None else accuracy.darboux(surface)[1]
        if kappas is None or max(-kappas[0], kappas[1]) > 1.0 / 15.0:
            continue
        if (kappas[0] * kappas[1] < 0.0) == (key % 3 == 0) and (there := _at(surface, extent)) is not None:
            return there


def _at(surface, extent):
    """The Place and its hold-out (m, 3), or None where a curve ends early."""
    place = Place(Remembering(surface), surface.point, extent, *accuracy.darboux(surface))
    contours = {m: place.tracked(m, 0.0, 0) for m in PLANES}
    if any(c.stops != ("extent", "extent") for m in PLANES for c in contours[m]):
        return None
    ends = np.vstack([c.points[[0, -1]] for c in contours[PLANES[0]]]) - place.point
    domain = closed_spline_domain((ends @ place.axes)[:, :2], extent)
    points, _ = domain.grid(accuracy.HOLD_OUT)
    hold_out = accuracy.above(surface, place.axes, place.kappas, points)
    return None if np.isnan(hold_out).any() else (place, hold_out)


def spread(contour, steps):
    """The contour with `steps` contacts on either side of the point."""
    kept = FINE + np.round(FINE * np.arange(-steps, steps + 1) / steps).astype(int)
    return replace(contour, points=contour.points[kept], normals=contour.normals[kept])


def cases(place, hold_out, noise, seed):
    """What was touched, as (touch, accuracy.Case), all from the same fine contours."""
    rng = np.random.default_rng(seed)
    fine = {planes: place.tracked(planes, noise, rng) for planes in PLANES}
    for touch in TOUCHES:
        contours = [spread(contour, touch.steps) for contour in fine[touch.planes]]
        yield touch, accuracy.Case(place.point, place.axes, place.kappas, contours, noise, hold_out)


def errors(key, seeds):
    """[((noise, touch, name of a method or limit), error in um)] for all touches of a surface.

    For CHOSEN, where core.explore chooses, there is (number of contacts, error in um) instead of the error.
    """
    place, hold_out = find(key)
    over = hold_out @ place.axes
    rows = [((None, None, name), best_polynomial(over, degree)) for degree, name in BEST.items()]
    for noise in accuracy.NOISES:
        for seed in range(seeds if noise else 1):
            entropy = [seed, *str(key).encode()]
            for touch, case in cases(place, hold_out, noise, entropy):
                scores = {name: accuracy.score(fit(case), case).error for name, fit in METHODS.items()}
                scores[BOUND] = cramer_rao(case)
                rows += [((noise, touch, name), error) for name, error in scores.items()]
            contours = place.touched(explore, PLANES[0], noise, entropy, farthest=place.extent).contours
            case = accuracy.Case(place.point, place.axes, place.kappas, contours, noise, hold_out)
            contacts = sum(len(contour.points) - 1 for contour in contours)
            rows.append(((noise, None, CHOSEN), (contacts, accuracy.score(accuracy.ours(case), case).error)))
    return rows


def best_polynomial(over, degree):
    """The least mean |dz| (um) of any polynomial through the reference point, by linear programming."""
    from scipy.optimize import linprog

    radius = np.abs(over).max()
    basis, z = monomials(over / radius, exponents(1, degree)), over[:, 2] / radius
    (points, terms), slack = basis.shape, np.eye(len(basis))
    least = linprog(
        np.repeat([0.0, 1.0 / points], [terms, points]),
        A_ub=np.block([[basis, -slack], [-basis, -slack]]),
        b_ub=np.concatenate([z, -z]),
        bounds=[(None, None)] * terms + [(0.0, None)] * points,
    )
    return 1e3 * radius * least.fun


def cramer_rao(case):
    """The mean |dz| (um) of an unbiased estimate of those terms to degree 4 that the contacts show."""
    contacts = np.vstack([c.points for c in case.contours]) - case.point
    contacts = contacts[np.linalg.norm(contacts, axis=1) > 0.0] @ case.axes
    over, radius, terms = case.hold_out @ case.axes, np.abs(contacts).max(), exponents(1, 4)
    # Blind directions are 0 except for rounding; the faintest visible one is 0.04 of the clearest.
    inverse = np.linalg.pinv(monomials(contacts / radius, terms), rcond=1e-2)
    std = case.noise * np.linalg.norm(monomials(over / radius, terms) @ inverse, axis=1)
    return 1e3 * np.sqrt(2.0 / np.pi) * std.mean()


def chosen(found, noise):
    """Medians of the number of contacts that core.explore takes, and of the error with them."""
    return np.median(found[noise, None, CHOSEN], axis=0)


def medians(found, touches, noise, name, quantile=0.5):
    return [float(np.quantile(found[noise, touch, name], quantile)) for touch in touches]


def print_tables(found):
    """Prints medians by noise and method, and how many contacts are enough."""

    def rows(touches, *between):
        for name in (*METHODS, BOUND):
            for noise in accuracy.NOISES if name in METHODS else accuracy.NOISES[1:]:
                cells = (f"{error:.1f}" for error in medians(found, touches, noise, name))
                yield [name, f"{noise:g}", *between, *cells]

    print("Mean |dz| in um, medians over surfaces and seeds, in three planes by the number of contacts:\n")
    contacts = [touch.contacts for touch in BY_CONTACTS]
    accuracy.table(["method", "noise, mm", *map(str, contacts)], rows(BY_CONTACTS))
    print("The same by the number of planes:\n")
    sets = {f"{TOTAL} in all": SAME_TOTAL, f"{EACH} a curve": SAME_EACH}
    head = ["method", "noise, mm", "contacts", *(f"{planes} planes" for planes in PLANES)]
    accuracy.table(head, [row for name, touches in sets.items() for row in rows(touches, name)])
    for noise in accuracy.NOISES:
        error = np.array(medians(found, BY_CONTACTS, noise, BAYES))
        enough = contacts[np.flatnonzero(error > ENOUGH * error[-1]).max(initial=-1) + 1]
        print(
            f"Noise {noise:g} mm: from {enough} contacts on, the error of {BAYES} is at most {ENOUGH:g} "
            f"times that with {contacts[-1]}. "
            "core.explore takes {:.0f} contacts, with which it is {:.1f} um.".format(*chosen(found, noise))
        )
    print(*(f"The {name} is {np.median(found[None, None, name]):.2g} um off." for name in BEST.values()))


def draw_lines(axes, found, touches, at):
    """Draws medians and quartiles for each noise, TAGC's medians, and the limits."""
    for noise, (color, mark, _) in LOOKS.items():
        axes.plot(at, medians(found, touches, noise, BAYES), color=color, marker=mark, markersize=5)
        quartiles = (medians(found, touches, noise, BAYES, q) for q in (0.25, 0.75))
        axes.fill_between(at, *quartiles, color=color, alpha=0.13, linewidth=0)
        if noise:
            axes.plot(at, medians(found, touches, noise, BOUND), color=color, linestyle=":", linewidth=1.3)
    tagc = medians(found, touches, TAGC_NOISE, TAGC)
    axes.plot(at, tagc, color=plot.PURPLE, marker="x", markersize=4, linewidth=0.9)
    axes.axhline(np.median(found[None, None, BEST[4]]), color=plot.BLACK, linestyle="--", linewidth=1)


def draw(found):
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(8.2, 4.7), sharey=True, width_ratios=(3, 2), layout="constrained"
    )
    figure.suptitle("How much data is enough", fontsize=12, weight="bold")
    contacts = [touch.contacts for touch in BY_CONTACTS]
    draw_lines(left, found, BY_CONTACTS, contacts)
    draw_lines(right, found, SAME_TOTAL, PLANES)
    for noise, (color, *_) in LOOKS.items():
        left.plot(*chosen(found, noise), "*", color=color, mec="black", mew=0.8, markersize=14, zorder=3)
    for noise, (color, mark, _) in LOOKS.items():
        each = medians(found, SAME_EACH, noise, BAYES)
        right.plot(PLANES, each, "-.", color=color, marker=mark, mfc="white", markersize=5, linewidth=1)
    left.set(title="Three planes, more contacts", xlabel="contacts", ylabel="error of the height, µm")
    left.set(xscale="log", yscale="log", xlim=(11, 400), ylim=(0.4, 400))
    left.set_xticks(contacts, contacts)
    left.xaxis.set_minor_locator(NullLocator())
    left.set_yticks([1, 10, 100], [1, 10, 100])
    right.set(title="More planes", xlabel="sampling planes", xticks=PLANES, xlim=(2.8, 6.2))
    label(left, right, found)
    return figure


def label(left, right, found):
    """Writes names at the lines' ends, and what the line styles mean."""
    last = BY_CONTACTS[-1:]
    at = 1.07 * last[0].contacts
    for noise, (color, _, align) in LOOKS.items():
        name = f"noise {noise:g} mm" if noise else "no noise"
        left.text(at, *medians(found, last, noise, BAYES), name, color=color, va=align, fontsize=8)
    tagc = medians(found, last, TAGC_NOISE, TAGC)
    left.text(at, *tagc, f"TAGC,\n{TAGC_NOISE:g} mm", color=plot.PURPLE, va="center", fontsize=8)
    four, six = (np.median(found[None, None, name]) for name in BEST.values())
    left.text(
        11.5, 0.92 * four, f"best polynomial of degree 4 (of degree 6: {six:.2g} µm)", va="top", fontsize=8
    )
    lines = {
        f"{TOTAL} contacts in all": {"marker": "o"},
        f"{EACH} contacts a curve": {"marker": "o", "mfc": "white", "ls": "-.", "lw": 1},
        "Cramér-Rao bound": {"ls": ":"},
    }
    handles = [Line2D([], [], color="#555555", label=name, **style) for name, style in lines.items()]
    star = {"marker": "*", "mec": "black", "mew": 0.8, "markersize": 12, "ls": ""}
    left.legend(
        handles=[Line2D([], [], color="#bbbbbb", label=CHOSEN, **star)], loc="upper right", fontsize=8
    )
    right.legend(handles=handles, loc="upper right", fontsize=8)


def csv_rows(found):
    for (noise, touch, name), values in found.items():
        planes, contacts = ("", "") if touch is None else (touch.planes, touch.contacts)
        if name == CHOSEN:
            planes, contacts = PLANES[0], f"{chosen(found, noise)[0]:g}"
            values = [error for _, error in values]
        quantiles = (f"{value:.4g}" for value in np.quantile(values, (0.5, 0.25, 0.75)))
        yield [planes, contacts, noise, name, *quantiles]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer shapes and seeds")
    seeds, shapes = (2, 4) if parser.parse_args().quick else (8, 24)
    found = defaultdict(list)
    with ProcessPoolExecutor(2) as pool:
        for rows in pool.map(partial(errors, seeds=seeds), [*accuracy.SURFACES, *range(shapes)]):
            for key, error in rows:
                found[key].append(error)
    print_tables(found)
    header = ["planes", "contacts", "noise, mm", "method", "median, um", "lower quartile", "upper quartile"]
    caption = CAPTION.format(len(accuracy.SURFACES), shapes, seeds, TOTAL)
    plot.save(draw(found), "amount", caption, header, csv_rows(found))


if __name__ == "__main__":
    main()
