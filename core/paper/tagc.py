# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Total absolute Gaussian curvature against the contacts: the objective (9) and two minimizations (IV-B).

lambda stays as it is given. The paper updates it from step to step by a rule that it does not state, and its
text takes the gradient of f + lambda g although (9) is g + lambda f.
"""

from typing import NamedTuple

import numpy as np

from ..arguments import Array
from ..patch.domain import Domain
from ..patch.monge import PARTIALS
from .least_squares import Problem, on_grid

# |D| is rounded by these shares of its mean at the start, one after the other. With the last one the minimum
# is right to a millionth: benchmarks.speed of e20b52a compared it with L-BFGS-B.
ROUNDINGS = np.geomspace(1.0, 1e-5, 14)
SETTLED_OBJECTIVE = 1e-3  # When a step wins less than this share of the objective, the next rounding begins.
CONVERGED = 1e-8
NEWTON_CAP, DESCENT_CAP = 200, 20_000  # There are at most this many steps.


class _Fields(NamedTuple):
    """The surface of some coefficients on the m points of the grid, and how far it is off the contacts."""

    slopes: Array  # z_x, z_y (2, m)
    bends: Array  # z_xx, z_xy, z_yy (3, m)
    w: Array
    w_power: Array  # W^(-3/2)
    det: Array
    residuals: Array  # (n,)


class Objective:
    """g(a) + lambda f(a) of (9), in unit radius, on the grid of (8).

    With W = 1 + z_x^2 + z_y^2 and D = z_xx z_yy - z_xy^2 the integrand |K| sqrt(W) is |D| W^(-3/2). |D| has a
    kink where the surface turns from elliptic to hyperbolic; a rounding r > 0 replaces it by sqrt(D^2 + r^2).
    """

    def __init__(self, data: Problem, domain: Domain, weight: float) -> None:
        basis, self._quadric_bends, h = on_grid(data, domain, PARTIALS[1:])
        self._basis, self._area, self._data = basis, h**2, data
        self._flat = np.concatenate(list(basis), axis=1)  # (terms, 5 m)
        self._scale = weight / len(data.basis)
        self._data_hessian = 2.0 * self._scale * data.basis.T @ data.basis
        xx, xy, yy = basis[2:]
        # Lengths of steps are measured with the bending energy in place of |D|.
        self.metric = self._data_hessian + self._area * (xx @ xx.T + 2.0 * xy @ xy.T + yy @ yy.T)

    def fields(self, a: Array) -> _Fields:
        """The surface at coefficients (terms,), from which all else is computed."""
        z = (a @ self._flat).reshape(5, -1) + self._quadric_bends
        (zx, zy), (zxx, zxy, zyy) = z[:2], z[2:]
        w = 1.0 + zx * zx + zy * zy
        residuals = self._data.basis @ a - self._data.remainder
        return _Fields(z[:2], z[2:], w, 1.0 / (w * np.sqrt(w)), zxx * zyy - zxy * zxy, residuals)

    def total_absolute_curvature(self, at: _Fields, rounding: float = 0.0) -> float:
        """The integral g of (8)."""
        return self._area * float(np.hypot(at.det, rounding) @ at.w_power)

    def value(self, at: _Fields, rounding: float = 0.0) -> float:
        """The objective g + lambda f of (9)."""
        return self.total_absolute_curvature(at, rounding) + self._scale * float(at.residuals @ at.residuals)

    def gradient(self, at: _Fields, rounding: float = 0.0) -> Array:
        """The gradient (terms,); without rounding, the signs delta_j of K count as constant (IV-B)."""
        (zx, zy), (zxx, zxy, zyy) = at.slopes, at.bends
        size = np.hypot(at.det, rounding)
        delta = (at.det / size if rounding else np.where(at.det >= 0.0, 1.0, -1.0)) * at.w_power
        slope = -3.0 * size * at.w_power / at.w
        by_field = np.concatenate([slope * zx, slope * zy, delta * zyy, -2.0 * delta * zxy, delta * zxx])
        return self._area * (self._flat @ by_field) + 2.0 * self._scale * (at.residuals @ self._data.basis)

    def hessian(self, at: _Fields, rounding: float) -> Array:
        """The Hessian (terms, terms), in which W counts as constant: slopes are small where D matters."""
        zxx, zxy, zyy = at.bends
        xx, xy, yy = self._basis[2:]
        size = np.hypot(at.det, rounding)
        det = zyy * xx - 2.0 * zxy * xy + zxx * yy  # the gradient of D
        delta = at.det / size * at.w_power
        mixed = (delta * xx) @ yy.T
        around = (rounding**2 * at.w_power / (size * size * size) * det) @ det.T
        return self._area * (around + mixed + mixed.T - (2.0 * delta * xy) @ xy.T) + self._data_hessian


def newton_minimum(objective: Objective, start: Array) -> tuple[Array, bool]:
    """Newton's method from `start` with |D| rounded less and less: the coefficients; whether it converged."""
    a, at, steps = start, objective.fields(start), 0
    if not len(a):
        return a, True
    scale = max(float(np.mean(np.abs(at.det))), 1e-9)
    # If the weight is huge, rounding may leave the metric indefinite.
    least = 1e-13 * np.trace(objective.metric) * np.eye(len(a))
    whitening = np.linalg.inv(np.linalg.cholesky(objective.metric + least)).T
    for share in ROUNDINGS:
        rounding, damping = scale * share, 1e-3
        value = objective.value(at, rounding)
        enough = SETTLED_OBJECTIVE if share > ROUNDINGS[-1] else CONVERGED
        while steps < NEWTON_CAP:
            before, steps = value, steps + 1
            a, at, value, damping = _newton_step(objective, whitening, a, at, value, rounding, damping)
            if before - value <= enough * before:
                break
    return a, steps < NEWTON_CAP


def _newton_step(
    objective: Objective,
    whitening: Array,
    a: Array,
    at: _Fields,
    value: float,
    rounding: float,
    damping: float,
) -> tuple[Array, _Fields, float, float]:
    """A Newton step with Levenberg's damping, which lowers the objective or is none.

    whitening : (terms, terms), W with W' M W = I for the metric M
    a, at, value : the coefficients, and the fields and the objective there
    rounding : of the objective's kinks, so that it has derivatives
    damping : what is added to the eigenvalues; larger ones make shorter steps

    Returns a, at and value after the step, and the damping of the next one. The Hessian H may be indefinite,
    so the eigenvalues of W' H W count by their absolute values.
    """
    eigenvalues, directions = np.linalg.eigh(whitening.T @ objective.hessian(at, rounding) @ whitening)
    directions = whitening @ directions
    along = objective.gradient(at, rounding) @ directions
    while True:
        lengths = along / (np.maximum(np.abs(eigenvalues), 1e-9) + damping)
        trial = a - directions @ lengths
        trial_fields = objective.fields(trial)
        trial_value = objective.value(trial_fields, rounding)
        expected = float(lengths @ (along - 0.5 * eigenvalues * lengths))
        if trial_value < value:
            quick = value - trial_value > 0.7 * expected
            return trial, trial_fields, trial_value, damping * (0.1 if quick else 2.0)
        if expected <= 1e-10 * value:
            return a, at, value, damping
        damping = max(4.0 * damping, 1e-3)


def descent_minimum(objective: Objective, start: Array) -> tuple[Array, bool]:
    """The paper's steepest descent from `start`: the coefficients, and whether it converged before the cap.

    Each step is halved until it descends at all, and the next one begins twice as long: a demand for more
    descent would end it on the kinks of |K|. It has converged when 100 steps have not lowered the objective
    by a millionth.
    """
    a, at = start, objective.fields(start)
    value, gradient = objective.value(at), objective.gradient(at)
    length, mark = 1.0 / max(float(np.linalg.norm(gradient)), 1e-300), value
    for step in range(1, DESCENT_CAP + 1):
        square = float(gradient @ gradient)
        while True:
            trial = a - length * gradient
            at = objective.fields(trial)
            trial_value = objective.value(at)
            if trial_value <= value - 1e-3 * length * square or length * square <= 1e-16 * abs(value):
                break
            length *= 0.5
        if trial_value >= value:
            return a, True
        a, value, gradient = trial, trial_value, objective.gradient(at)
        length *= 2.0
        if step % 100 == 0:
            if mark - value <= 1e-6 * abs(value):
                return a, True
            mark = value
    return a, False
