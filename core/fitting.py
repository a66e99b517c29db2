# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The coefficients of (1) from the contacts: the three methods of the paper's section IV.

Everything here is in unit radius, in the Darboux frame, kappa1 and kappa2 known. lambda is then a
pure number, the weight of the mean square error f against a curvature integral over the domain.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .arguments import Array
from .domain import Domain
from .monge import MongePatch, exponents, monomials

GRID = 600  # points of (8) over the domain
DESCENT_CAP = 20_000  # steps

Objective = Callable[[Array], tuple[float, Array]]


@dataclass(frozen=True)
class Problem:
    """(1) over n contacts: basis (n, m) @ coefficients (m,) ~ remainder (n,) above the quadric."""

    quadric: MongePatch
    degree: int
    basis: Array
    remainder: Array

    @property
    def condition_number(self) -> float:
        """Largest over smallest singular value of the basis; 1e16 where it has no full rank."""
        singular = np.linalg.svd(self.basis, compute_uv=False)
        return float(singular[0] / max(singular[-1], 1e-16 * singular[0])) if singular.size else 1.0


def problem(k1: float, k2: float, degree: int, points: Array) -> Problem:
    """What (5) asks of the terms of degree 3 to `degree` at local contacts (n, 3)."""
    quadric = MongePatch(k1, k2, np.empty(0))
    x, y, z = points.T
    return Problem(quadric, degree, monomials(x, y, exponents(3, degree)), z - quadric.height(x, y))


def least_squares(data: Problem) -> Array:
    """Equation (5): min f(a), without cut-off but for rounding."""
    return np.linalg.lstsq(data.basis, data.remainder, rcond=None)[0]


def quadratic_variation(data: Problem, domain: Domain, weight: float) -> Array:
    """min of the integral of z_xx^2 + 2 z_xy^2 + z_yy^2 plus lambda f(a) (section V), a linear solve."""
    bends, h = _on_grid(data, domain, [(2, 0), (1, 1), (0, 2)])
    factors = h * np.sqrt([1.0, 2.0, 1.0])
    share = np.sqrt(weight / len(data.basis))
    rows = [share * data.basis, *(f * basis for f, (basis, _) in zip(factors, bends, strict=True))]
    wanted = [share * data.remainder, *(-f * known for f, (_, known) in zip(factors, bends, strict=True))]
    return np.linalg.lstsq(np.vstack(rows), np.concatenate(wanted), rcond=None)[0]


def _on_grid(
    data: Problem, domain: Domain, orders: list[tuple[int, int]]
) -> tuple[list[tuple[Array, Array]], float]:
    """Derivatives of (1) on the grid of (8), each as basis (m, terms) and quadric's part (m,); and h."""
    points, h = domain.grid(GRID)
    x, y = points.T
    terms, known = exponents(3, data.degree), data.quadric.derivatives(x, y)
    return [(monomials(x, y, terms, dx, dy), getattr(known, "x" * dx + "y" * dy)) for dx, dy in orders], h


def total_absolute_curvature(data: Problem, domain: Domain) -> Objective:
    """g(a) of (8) and its gradient, the signs delta_j of K held as they are at a (IV-B).

    With W = 1 + z_x^2 + z_y^2 and D = z_xx z_yy - z_xy^2 the integrand |K| sqrt(W) is |D| W^(-3/2).
    """
    derivatives, h = _on_grid(data, domain, [(1, 0), (0, 1), (2, 0), (1, 1), (0, 2)])
    (bx, qx), (by, qy), (bxx, qxx), (bxy, qxy), (byy, qyy) = derivatives

    def g(a: Array) -> tuple[float, Array]:
        zx, zy = bx @ a + qx, by @ a + qy
        zxx, zxy, zyy = bxx @ a + qxx, bxy @ a + qxy, byy @ a + qyy
        w = 1.0 + zx**2 + zy**2
        det = zxx * zyy - zxy**2
        delta = np.where(det >= 0.0, 1.0, -1.0) * w**-1.5
        slope = -3.0 * delta * det / w
        gradient = (
            (delta * zyy) @ bxx
            + (delta * zxx) @ byy
            - 2.0 * (delta * zxy) @ bxy
            + (slope * zx) @ bx
            + (slope * zy) @ by
        )
        return h**2 * float(delta @ det), h**2 * gradient

    return g


def tagc_objective(data: Problem, domain: Domain, weight: float) -> Objective:
    """g(a) + lambda f(a) of (9) and its gradient."""
    g = total_absolute_curvature(data, domain)

    def objective(a: Array) -> tuple[float, Array]:
        value, gradient = g(a)
        miss = data.basis @ a - data.remainder
        scale = weight / len(miss)
        return value + scale * float(miss @ miss), gradient + 2.0 * scale * (miss @ data.basis)

    return objective


def tagc_start(data: Problem, half_curves: Sequence[Array]) -> Array:
    """a(0): (5) over the contacts and artificial points between them (IV-B).

    half_curves : (n_i, 3) each, outward from the reference point, by azimuth. The paper leaves the
    artificial points open; here k-th contact and k-th contact of neighbouring half curves are joined
    and the line is cut at 1/4, 1/2 and 3/4.
    """
    between = []
    for one, other in zip(half_curves, [*half_curves[1:], half_curves[0]], strict=True):
        pairs = min(len(one), len(other))
        between += [(1.0 - t) * one[:pairs] + t * other[:pairs] for t in (0.25, 0.5, 0.75)]
    artificial = problem(data.quadric.k1, data.quadric.k2, data.degree, np.vstack(between))
    basis = np.vstack([data.basis, artificial.basis])
    return np.linalg.lstsq(basis, np.concatenate([data.remainder, artificial.remainder]), rcond=None)[0]


def quick_minimum(objective: Objective, start: Array) -> tuple[Array, bool]:
    """L-BFGS from `start`; the coefficients, and whether it converged."""
    from scipy.optimize import minimize

    found = minimize(
        objective, start, jac=True, method="L-BFGS-B", options={"maxiter": 1000, "ftol": 1e-10, "gtol": 1e-8}
    )
    # 1 is the cap. Anything else is a minimum, a kink of |K| among them, where no line search descends.
    return found.x, bool(found.status != 1)


def descent_minimum(objective: Objective, start: Array) -> tuple[Array, bool]:
    """The paper's steepest descent from `start`; the coefficients, and whether it converged before the cap.

    Each step is halved until it descends at all, and the next one tries twice as far: a demand for
    more descent would end it on the kinks of |K|. Converged where 100 steps have not lowered the
    objective by a millionth.
    """
    a, (value, gradient) = start, objective(start)
    length, mark = 1.0 / max(float(np.linalg.norm(gradient)), 1e-300), value
    for step in range(1, DESCENT_CAP + 1):
        square = float(gradient @ gradient)
        while True:
            trial = a - length * gradient
            trial_value, trial_gradient = objective(trial)
            if trial_value <= value - 1e-3 * length * square or length * square <= 1e-16 * abs(value):
                break
            length *= 0.5
        if trial_value >= value:
            return a, True
        a, value, gradient = trial, trial_value, trial_gradient
        length *= 2.0
        if step % 100 == 0:
            if mark - value <= 1e-6 * abs(value):
                return a, True
            mark = value
    return a, False
