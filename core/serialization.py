# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A reconstruction as plain values, for files and other programs, and back."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .arguments import LARGEST, finite_array, number, shown
from .curves import Curves
from .domain import closed_spline_domain
from .local_geometry import Frame
from .monge import MongePatch
from .posterior import FREE, TERMS, Posterior, terms_to
from .reconstruction import METHODS
from .result import Reconstruction

VERSION = 1
ORTHONORMAL = 1e-6
COEFFICIENTS = [terms_to(degree) - FREE for degree in range(2, 7)]  # of the degrees a patch may have


def to_dict(r: Reconstruction) -> dict[str, Any]:
    """`r` as a dict of numbers, words, lists and dicts, as JSON has them; `from_dict` takes it back.

    All lengths are in the caller's unit and in `r.frame`, but for those of `posterior` and `accuracy`,
    which are in units of the radius. `status` and `message` are for readers only: they follow from the
    rest.
    """
    curves = zip(r.curves.points, r.curves.present, r.curves.along, r.curves.tangents, strict=True)
    return {
        "version": VERSION,
        "method": r.method,
        "status": r.status,
        "message": r.message,
        "converged": r.converged,
        "frame": {"origin": r.frame.origin.tolist(), "axes": r.frame.axes.tolist()},
        "radius": r.radius,
        "k1": r.patch.k1,
        "k2": r.patch.k2,
        "coefficients": r.patch.coefficients.tolist(),
        "domain": r.domain.ends.tolist(),
        "accuracy": r.accuracy,
        "curves": [
            {
                "points": (r.radius * points[present]).tolist(),
                "along": along[present].tolist(),
                "tangent": tangent.tolist(),
            }
            for points, present, along, tangent in curves
            if present.any()
        ],
        "posterior": None
        if r.joint_posterior is None
        else {name: np.asarray(value).tolist() for name, value in r.joint_posterior._asdict().items()},
    }


def from_dict(d: Mapping[str, Any]) -> Reconstruction:
    """The reconstruction that `to_dict` made this of; to rounding, whatever its unit.

    Raises ValueError for another version, and for what is missing or has no such value.
    """
    if _of(d, "version") != VERSION:
        raise ValueError(
            f"version: wanted {VERSION}, got {shown(d['version'])}: this was written by another release"
        )
    radius, method = number("radius", _of(d, "radius"), above=0.0), _of(d, "method")
    if not isinstance(method, str) or method not in METHODS:
        raise ValueError(f"method: wanted one of {', '.join(METHODS)}, got {shown(method)}")
    frame, posterior = _of(d, "frame"), _of(d, "posterior")
    axes = finite_array("axes", _of(frame, "axes"), (3, 3))
    if np.abs(axes.T @ axes - np.eye(3)).max() > ORTHONORMAL or np.linalg.det(axes) < 0.0:
        raise ValueError("axes: wanted a right-handed frame of unit vectors, got another matrix")
    coefficients = finite_array("coefficients", _of(d, "coefficients"), (None,))
    if len(coefficients) not in COEFFICIENTS:
        raise ValueError(
            f"coefficients: wanted {', '.join(map(str, COEFFICIENTS))} of them, got {len(coefficients)}"
        )
    return Reconstruction(
        frame=Frame(finite_array("origin", _of(frame, "origin"), (3,), LARGEST), axes),
        radius=radius,
        patch=MongePatch(number("k1", _of(d, "k1")), number("k2", _of(d, "k2")), coefficients),
        domain=closed_spline_domain(finite_array("domain", _of(d, "domain"), (None, 2)), radius),
        curves=_curves(_of(d, "curves"), radius),
        accuracy=number("accuracy", _of(d, "accuracy"), least=0.0),
        method=method,
        converged=bool(_of(d, "converged")),
        joint_posterior=None if posterior is None else _posterior(posterior),
    )


def _of(d: Any, key: str) -> Any:
    if not isinstance(d, Mapping):
        raise ValueError(f"{key}: wanted it in a dict, got {shown(d)}")
    if key not in d:
        raise ValueError(f"{key}: wanted it in the dict of a reconstruction, got none")
    return d[key]


def _curves(curves: Any, radius: float) -> Curves:
    if not isinstance(curves, Sequence) or not curves:
        raise ValueError(f"curves: wanted a list of some, got {shown(curves)}")
    points = [finite_array("points", _of(c, "points"), (None, 3)) / radius for c in curves]
    along = [finite_array("along", _of(c, "along"), (len(p),)) for c, p in zip(curves, points, strict=True)]
    shape = len(curves), max(1, *map(len, points))
    filled = np.zeros((*shape, 3)), np.zeros(shape, dtype=bool), np.full(shape, np.inf)
    for i, p in enumerate(points):
        filled[0][i, : len(p)], filled[1][i, : len(p)], filled[2][i, : len(p)] = p, True, along[i]
    if not filled[1].any():
        raise ValueError("curves: wanted contacts on them, got none")
    tangents = np.array([finite_array("tangent", _of(c, "tangent"), (3,)) for c in curves])
    return Curves(*filled, tangents, np.zeros_like(tangents))


def _posterior(d: Any) -> Posterior:
    size = len(TERMS)
    shapes: dict[str, tuple[int, ...]] = {
        "mean": (size,),
        "covariance": (size, size),
        "noise": (),
        "visibility": (size - FREE, size - FREE),
    }
    return Posterior(*(finite_array(name, _of(d, name), shape) for name, shape in shapes.items()))
