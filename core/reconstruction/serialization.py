# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A reconstruction as plain values, for files and other programs, and back."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from ..arguments import LARGEST, SMALLEST, Array, finite_array, number, shown
from ..bayes.posterior import FREE, Posterior, terms_to
from ..contours.contour import Contour
from ..contours.local_geometry import Frame
from ..patch.domain import closed_spline_domain
from ..patch.geometry import Geometry
from ..patch.monge import TERMS, MongePatch
from ..patch.residual import LENGTHS, Residual
from .from_contours import METHODS
from .result import Reconstruction
from .status import Taps

VERSION = 2
ORTHONORMAL = 1e-6  # Axes may be off by so much, because files may have them in single precision.
LEAST_PIVOT = 1e-3  # A residual's factor has no smaller pivot; its priors leave ten times as much.
COEFFICIENTS = [terms_to(degree) - FREE for degree in range(2, 7)]  # Numbers of coefficients by degree.


def to_dict(r: Reconstruction) -> dict[str, Any]:
    """A reconstruction as JSON has it: a dict of numbers, words, lists and dicts, which `from_dict` reads.

    Lengths are in the caller's unit, those of the geometry in its frame. `noise` and `posterior` are in
    units of the radius. `status` and `message` are for readers only: they follow from the rest.
    """
    posterior, residual = r.joint_posterior, r.residual
    return {
        "version": VERSION,
        "method": r.method,
        "status": r.status,
        "message": r.message,
        "converged": r.converged,
        "noise": r.noise,
        "mean_height_std": r.mean_height_std,
        "geometry": {
            "frame": {"origin": r.frame.origin.tolist(), "axes": r.frame.axes.tolist()},
            "radius": r.radius,
            "polynomial": polynomial_dict(r.geometry.polynomial),
            "residual": residual and plain({f.name: getattr(residual, f.name) for f in fields(residual)}),
            "domain": r.domain.ends.tolist(),
            "brinks": None if r.domain.brinks is None else r.domain.brinks.tolist(),
        },
        "patch": polynomial_dict(r.patch),
        "contours": [plain(vars(contour)) for contour in r.contours],
        "strokes": r.strokes.tolist() if len(r.strokes) else None,
        "posterior": None if posterior is None else plain(posterior._asdict()),
        "taps": None if r.taps is None else r.taps._asdict(),
    }


def polynomial_dict(patch: MongePatch) -> dict[str, Any]:
    """The polynomial (1) as plain values."""
    return {"k1": patch.k1, "k2": patch.k2, "coefficients": patch.coefficients.tolist()}


def plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values by name, with arrays as lists."""
    return {
        key: value.tolist() if isinstance(value, np.ndarray | np.generic) else value
        for key, value in values.items()
    }


def from_dict(d: Mapping[str, Any]) -> Reconstruction:
    """The reconstruction that `to_dict` made `d` from, to the last bit.

    Raises ValueError for another version, and for missing or wrong values.
    """
    if _of(d, "version") != VERSION:
        raise ValueError(
            f"version: expected {VERSION}, got {shown(d['version'])}: this was written by another release"
        )
    method, posterior, strokes = _of(d, "method"), _of(d, "posterior"), _of(d, "strokes")
    contours = _contours(_of(d, "contours"), strokes is not None)
    if not isinstance(method, str) or method not in METHODS:
        raise ValueError(f"method: expected one of {', '.join(METHODS)}, got {shown(method)}")
    r = Reconstruction(
        geometry=_geometry(_of(d, "geometry")),
        patch=_polynomial(_of(d, "patch")),
        contours=contours,
        noise=number("noise", _of(d, "noise"), least=0.0),
        method=method,
        converged=bool(_of(d, "converged")),
        strokes=np.empty((0, 3)) if strokes is None else finite_array("strokes", strokes, (None, 3), LARGEST),
        joint_posterior=None if posterior is None else _posterior(posterior),
        taps=_taps(d.get("taps")),
        known_height_std=number("mean_height_std", _of(d, "mean_height_std"), least=0.0),
    )
    if not len(r.contacts):
        raise ValueError("contours: expected contacts besides the reference point, got none")
    return r


def _of(d: Any, key: str) -> Any:
    if not isinstance(d, Mapping):
        raise ValueError(f"{key}: expected it in a dict, got {shown(d)}")
    if key not in d:
        raise ValueError(f"{key}: expected it in the dict of a reconstruction, got none")
    return d[key]


def _geometry(d: Any) -> Geometry:
    frame, radius = _of(d, "frame"), number("radius", _of(d, "radius"), least=SMALLEST)
    axes = finite_array("axes", _of(frame, "axes"), (3, 3))
    if np.abs(axes.T @ axes - np.eye(3)).max() > ORTHONORMAL or np.linalg.det(axes) < 0.0:
        raise ValueError("axes: expected a right-handed frame of unit vectors, got another matrix")
    residual, brinks = _of(d, "residual"), _of(d, "brinks")
    ends = finite_array("domain", _of(d, "domain"), (None, 2))
    if brinks is not None:
        brinks = finite_array("brinks", brinks, (len(ends),)) != 0.0
    return Geometry(
        Frame(finite_array("origin", _of(frame, "origin"), (3,), LARGEST), axes),
        radius,
        _polynomial(_of(d, "polynomial")),
        closed_spline_domain(ends, radius, brinks),
        None if residual is None else _residual(residual),
    )


def _polynomial(d: Any) -> MongePatch:
    coefficients = finite_array("coefficients", _of(d, "coefficients"), (None,))
    if len(coefficients) not in COEFFICIENTS:
        raise ValueError(
            f"coefficients: expected {', '.join(map(str, COEFFICIENTS))} of them, got {len(coefficients)}"
        )
    return MongePatch(number("k1", _of(d, "k1")), number("k2", _of(d, "k2")), coefficients)


def _contours(contours: Any, may_be_none: bool) -> tuple[Contour, ...]:
    if not isinstance(contours, Sequence) or not (contours or may_be_none):
        raise ValueError(f"contours: expected a list of some, got {shown(contours)}")
    names = [field.name for field in fields(Contour)]
    return tuple(Contour(**{name: _of(contour, name) for name in names}) for contour in contours)


def _taps(d: Any) -> Taps | None:
    """The taps, or None if there were none or the file was written before there were taps."""
    if d is None:
        return None
    taps, missed = (int(number(name, _of(d, name), least=0.0)) for name in ("number", "missed"))
    return Taps(taps, missed, number("off", _of(d, "off"), least=0.0))


def _posterior(d: Any) -> Posterior:
    size = len(TERMS)
    shapes: dict[str, tuple[int, ...]] = {
        "mean": (size,),
        "covariance": (size, size),
        "noise": (),
        "visibility": (size - FREE, size - FREE),
        "level": (size + 1,),
    }
    posterior = Posterior(*(finite_array(name, _of(d, name), shape) for name, shape in shapes.items()))
    _require_covariance(posterior.covariance)
    return posterior


def _require_covariance(matrix: Array) -> None:
    largest = float(np.abs(matrix).max())
    apart = np.abs(matrix - matrix.T).max()
    least = min(np.linalg.eigvalsh(matrix).min() + 1e-9 * largest, matrix.diagonal().min())
    if apart > 1e-9 * largest or least < 0.0:
        raise ValueError("covariance: expected a symmetric matrix without negative eigenvalues, got another")


def _residual(d: Any) -> Residual:
    places = finite_array("places", _of(d, "places"), (None, 2))
    size = len(TERMS) + len(places)
    shapes: dict[str, tuple[int, ...]] = {
        "variances": (len(LENGTHS),),
        "mean": (size,),
        "factor": (size, size),
        "noise": (),
    }
    values = {name: finite_array(name, _of(d, name), shape) for name, shape in shapes.items()}
    factor, variances, noise = (values[name] for name in ("factor", "variances", "noise"))
    # It is the factor of the precision, which priors keep from being singular.
    if not np.array_equal(factor, np.tril(factor)) or factor.diagonal().min() < LEAST_PIVOT:
        raise ValueError(
            f"factor: expected a lower triangle, its diagonal {LEAST_PIVOT:g} or more, got another"
        )
    if not (
        variances.min() >= 0.0 < variances.max() and noise > 0.0 and np.abs(places).max(initial=0.0) < 2.0
    ):
        raise ValueError(
            "residual: expected variances and noise above 0, places on the unit disk, got others"
        )
    return Residual(places, **values)
