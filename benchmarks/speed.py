# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the time of a fit goes, what its solvers gain, and what fitting many at once gains.

`python -m benchmarks.speed [--base ROOT [TASK ...]]`, from the root of a checkout. With --base it only prints
how long fits and automatic touches take, compared with that checkout and with scipy's thin plate
(ratios.py, which needs bpy to read the scans and to cast rays). Otherwise it prints Markdown tables, on the
touches of benchmarks.accuracy (eleven exact surfaces, three plane sets, three noise levels, 75 contacts):

(a) the minimization of (9) by Newton's method, by scipy's L-BFGS-B from the same start and on the same grid,
    and from the paper's start by Newton's method and by the paper's steepest descent;
(b) fits a second, one by one and by core.reconstruct_many;
(c) the times of the parts of one fit.
"""

import argparse
from pathlib import Path
from statistics import median
from typing import NamedTuple
from unittest.mock import patch

import numpy as np
from scipy.optimize import minimize

from core import reconstruct, reconstruct_many
from core.bayes import joint_fit, sextic
from core.paper import tagc
from core.reconstruction import stacks, start
from tools import blender

from . import accuracy, machine, ratios, table, timed

WITHIN = 1e-6  # Minima within this share of the objective count as the same.
TIGHT = {"maxiter": 1000, "ftol": 1e-12, "gtol": 1e-9}
WEIGHT = 1000.0
COPIES = 7  # The number of times that (b) repeats the touches.
RUNS = 5


class Minimum(NamedTuple):
    seconds: float
    value: float


def touches():
    return [
        accuracy.exact_case(name, planes, noise, i)
        for i, name in enumerate(accuracy.SURFACES)
        for planes in accuracy.EXACT_PLANES
        for noise in accuracy.NOISES
    ]


def fit(case, **options):
    return reconstruct(case.point, case.contours, outward=case.axes[:, 2], **{"degree": 4} | options)


# (a) -------------------------------------------------------------------------------------------------


def problem(case):
    """The objective (9) as the fit of a touch minimizes it, and the paper's start."""
    found = []

    def caught(*problem):
        found.append(problem)
        return problem[1], True

    with patch.object(tagc, "descent_minimum", caught):
        fit(case, method="tagc", solver="descent", weight=WEIGHT)
    return found[0]


def minima(case):
    """{solver and start: Minimum} of a touch."""
    objective, papers = problem(case)

    def value_and_gradient(a):
        at = objective.fields(a)
        return objective.value(at), objective.gradient(at)

    def general(start):
        options = {"jac": True, "method": "L-BFGS-B", "options": TIGHT}
        return minimize(value_and_gradient, start, **options).x, True

    def found(solver, *start):
        seconds, (a, _) = timed(solver, *start)
        return Minimum(seconds, objective.value(objective.fields(a)))

    quadric = np.zeros_like(papers)
    return {
        "Newton": found(tagc.newton_minimum, objective, quadric),
        "L-BFGS-B (scipy), same start": found(general, quadric),
        "Newton, the paper's start": found(tagc.newton_minimum, objective, papers),
        "steepest descent, the paper's start": found(tagc.descent_minimum, objective, papers),
    }


def solvers(cases):
    runs = [minima(case) for case in cases]
    newton, general, elsewhere, descent = runs[0]
    lower, same, higher, another = [], [], [], []
    for run in runs:
        ours, theirs = run[newton].value, run[general].value
        change = (ours - theirs) / max(theirs, 1e-12)
        (lower if change < -WITHIN else higher if change > WITHIN else same).append(change)
        if run[elsewhere].value < ours * (1.0 - WITHIN):
            another.append(1.0 - run[elsewhere].value / ours)
    slow = median(run[descent].seconds for run in runs)
    print(f"(a) Minima of (9), weight {WEIGHT:g}, 600 grid points; medians over {len(cases)} touches.\n")
    rows = []
    for name in runs[0]:
        seconds = median(run[name].seconds for run in runs)
        mean = np.mean([run[name].value for run in runs])
        rows.append([name, f"{1e3 * seconds:.1f}", f"{slow / seconds:.1f}", f"{mean:.4f}"])
    table(["solver", "ms", "times as fast as the descent", "mean objective"], rows)
    print(
        f"The minimum of Newton's method is within {WITHIN:g} of that of L-BFGS-B in {len(same)} of "
        f"{len(cases)} touches, lower in {len(lower)}, and higher, another minimum, in {len(higher)}. From "
        f"the paper's start Newton's method finds a lower one than from the quadric in {len(another)}, by "
        f"{100 * median(another or [0.0]):.1f} % in the median.\n"
    )


# (b) -------------------------------------------------------------------------------------------------


def many(cases):
    copies = COPIES * cases
    points, outward = (
        np.array([get(c) for c in copies]) for get in (lambda c: c.point, lambda c: c.axes[:, 2])
    )
    contours = [c.contours for c in copies]
    runs = []
    for _ in range(RUNS):
        seconds, stacked = timed(lambda: reconstruct_many(points, contours, outward=outward, degree=4))
        looped, single = timed(lambda: [fit(case) for case in copies])
        runs.append((len(copies) / seconds, len(copies) / looped))
    off = max(_departure(a, b) for a, b in zip(stacked, single, strict=True))
    at_once, one_by_one = np.median(runs, axis=0)
    print(f"(b) {len(copies)} fits by bayes.\n")
    rows = [["reconstruct", f"{one_by_one:.0f}"], ["reconstruct_many", f"{at_once:.0f}"]]
    table(["", "fits a second"], rows)
    print(f"The heights of the two differ by {off:.1g} of the radius at most.\n")


def _departure(one, other):
    x, y = one.contacts[:, :2].T
    return np.abs(one.height(x, y) - other.height(x, y)).max() / one.radius


# (c) -------------------------------------------------------------------------------------------------

PARTS = {
    "curves through the point": (start, "curves_through"),
    "Darboux frame": (start, "darboux_frames"),
    "equations of the contacts": (joint_fit, "sextics"),
    "waviness and noise": (sextic, "hyperparameters"),
    "posterior": (joint_fit, "posterior_given"),
    "patch and domain": (stacks, "_result"),
}


def parts(cases):
    spent, totals = {name: [] for name in PARTS}, []

    def clocked(inner, name):
        def run(*arguments):
            seconds, value = timed(inner, *arguments)
            spent[name][-1] += seconds
            return value

        return run

    for case in cases:
        for times in spent.values():
            times.append(0.0)
        patches = [patch.object(m, f, clocked(getattr(m, f), name)) for name, (m, f) in PARTS.items()]
        for each in patches:
            each.start()
        totals.append(timed(lambda case=case: fit(case))[0])
        for each in patches:
            each.stop()
    print("(c) One fit by bayes of degree 4: medians in ms.\n")
    rows = [[name, f"{1e3 * median(times):.2f}"] for name, times in spent.items()]
    table(["part", "ms"], [*rows, ["all", f"{1e3 * median(totals):.2f}"]])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--base", type=Path, metavar="ROOT", help="a checkout to compare with")
    parser.add_argument("tasks", nargs="*", choices=[*ratios.TASKS, []], help="what to compare (all)")
    options = parser.parse_args()
    if options.base:
        with blender.quiet():
            cases = ratios.cases()
        ratios.compare(options.base, cases, options.tasks or ratios.TASKS)
        print(f"{machine('bpy', 'numpy', 'scipy')}.")
        return
    cases = touches()
    for case in cases:
        fit(case)
    solvers(cases)
    many(cases)
    parts(cases)
    print(f"{machine('numpy', 'scipy')}.")


if __name__ == "__main__":
    main()
