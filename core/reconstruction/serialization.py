# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A reconstruction as plain values, for files and other programs, and back."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from ..arguments import LARGEST, SMALLEST, Array, finite_array, number, number_or_none, shown
from ..bayes.kernel import LENGTHS
from ..bayes.posterior import SurfacePosterior, terms_to
from ..bayes.prior import FREE
from ..contours.contour import Contour
from ..contours.local_geometry import Frame
from ..patch.domain import closed_spline_domain
from ..patch.geometry import Geometry
from ..patch.monge import TERMS, MongePatch
from .options import METHODS
from .result import Reconstruction
from .status import Taps

VERSION = 4
ORTHONORMAL = 1e-6  # Axes may be off by this, because files may have them in single precision.
FARTHEST = 10.0  # Contacts and ends of curves are within this many radii of the origin, the farthest at L.
WIDEST = 1e3  # The root of a covariance in unit radius has no larger numbers; the prior's have some 1.
COEFFICIENTS = [terms_to(degree) - FREE for degree in range(2, 7)]  # Numbers of coefficients by degree.


def to_dict(r: Reconstruction) -> dict[str, Any]:
    """A reconstruction as JSON has it: a dict of numbers, words, lists and dicts, which `from_dict` reads.

    Lengths are in the caller's unit, those of the geometry in its frame. `noise`, `point_std` and `posterior`
    are in units of the radius; the latter is None for the paper's methods, whose surface is `patch`. What is
    for readers only follows from the rest: `status`, `message` and `doubts`.
    """
    posterior = r.posterior if r.method == "bayes" else None
    return {
        "version": VERSION,
        "method": r.method,
        "status": r.status,
        "message": r.message,
        "doubts": [doubt.to_dict() for doubt in r.doubts],
        "converged": r.converged,
        "noise": r.noise,
        "point": r.point.tolist(),
        "point_std": r.point_std,
        "mean_height_std": r.mean_height_std,
        "geometry": {
            "frame": {"origin": r.frame.origin.tolist(), "axes": r.frame.axes.tolist()},
            "radius": r.radius,
            "domain": r.domain.ends.tolist(),
            "open_ends": None if r.domain.open_ends is None else r.domain.open_ends.tolist(),
        },
        "patch": polynomial_dict(r.patch),
        "contours": [plain(vars(contour)) for contour in r.contours],
        "strokes": r.strokes.tolist() if len(r.strokes) else None,
        "posterior": posterior and _posterior_dict(posterior),
        "taps": None if r.taps is None else r.taps._asdict(),
        "shape_curvatures": r.shape_curvatures.tolist() if len(r.shape_curvatures) else None,
        "facet_width": r.facet_width,
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
    if _value(d, "version") != VERSION:
        raise ValueError(
            f"version: expected {VERSION}, got {shown(d['version'])}: this was written by another release"
        )
    method, strokes, shape = (_value(d, key) for key in ("method", "strokes", "shape_curvatures"))
    patch = _polynomial(_value(d, "patch"))
    if not isinstance(method, str) or method not in METHODS:
        raise ValueError(f"method: expected one of {', '.join(METHODS)}, got {shown(method)}")
    surface = _posterior(_value(d, "posterior")) if method == "bayes" else None
    geometry = _geometry(_value(d, "geometry"), surface or patch)
    r = Reconstruction(
        geometry=geometry,
        patch=patch,
        contours=_contours(_value(d, "contours"), may_be_none=strokes is not None),
        noise=number("noise", _value(d, "noise"), least=0.0),
        method=method,
        point=finite_array("point", _value(d, "point"), (3,), LARGEST),
        point_std=number("point_std", _value(d, "point_std"), least=0.0),
        converged=_converged(_value(d, "converged")),
        strokes=np.empty((0, 3)) if strokes is None else finite_array("strokes", strokes, (None, 3), LARGEST),
        taps=_taps(d.get("taps")),
        shape_curvatures=(
            np.empty((0, 2)) if shape is None else finite_array("shape_curvatures", shape, (None, 2), LARGEST)
        ),
        facet_width=number("facet_width", _value(d, "facet_width"), least=0.0),
    )
    _require_contacts(r)
    return r.judged_with(mean_height_std=number("mean_height_std", _value(d, "mean_height_std"), least=0.0))


def _require_contacts(r: Reconstruction) -> None:
    """Raises ValueError for a reconstruction without contacts, or with places that are too far away."""
    places = {f"contours[{i}]": contour.points for i, contour in enumerate(r.contours)}
    for name, points in {"point": r.point[None], "strokes": r.strokes, **places}.items():
        _require_near(name, points - r.frame.origin, r.radius)
    if not len(r.contacts):
        raise ValueError("contours: expected contacts besides the reference point, got none")


def _require_near(name: str, offsets: Array, radius: float) -> None:
    """Raises ValueError for places (n, k) relative to the origin that are too far away."""
    if np.abs(offsets).max(initial=0.0) > FARTHEST * radius:
        raise ValueError(f"{name}: expected places within {FARTHEST:g} radii of the origin, got others")


def _value(d: Any, key: str) -> Any:
    """The value of a key. Raises ValueError if `d` is no dict or lacks the key."""
    if not isinstance(d, Mapping):
        raise ValueError(f"{key}: expected it in a dict, got {shown(d)}")
    if key not in d:
        raise ValueError(f"{key}: expected it in the dict of a reconstruction, got none")
    return d[key]


def _converged(value: Any) -> bool:
    """The value, if it is True or False. Raises ValueError for anything else."""
    if not isinstance(value, bool):
        raise ValueError(f"converged: expected True or False, as to_dict gives it, got {shown(value)}")
    return value


def _geometry(d: Any, surface: SurfacePosterior | MongePatch) -> Geometry:
    """The geometry with this surface: a posterior in unit radius, or a patch in the caller's unit."""
    frame, radius = _value(d, "frame"), number("radius", _value(d, "radius"), least=SMALLEST)
    axes = finite_array("axes", _value(frame, "axes"), (3, 3))
    unit = np.clip(axes, -2.0, 2.0)  # The products of larger numbers might be none.
    if np.abs(unit.T @ unit - np.eye(3)).max() > ORTHONORMAL or np.linalg.det(unit) < 0.0:
        raise ValueError("axes: expected a right-handed frame of unit vectors, got another matrix")
    open_ends = _value(d, "open_ends")
    ends = finite_array("domain", _value(d, "domain"), (None, 2))
    _require_near("domain", ends, radius)
    if open_ends is not None:
        open_ends = finite_array("open_ends", open_ends, (len(ends),)) != 0.0
    return Geometry(
        Frame(finite_array("origin", _value(frame, "origin"), (3,), LARGEST), axes),
        radius,
        surface.scaled(1.0 / radius) if isinstance(surface, MongePatch) else surface,
        closed_spline_domain(ends, radius, open_ends),
    )


def _polynomial(d: Any) -> MongePatch:
    """The polynomial (1) that `polynomial_dict` wrote."""
    coefficients = finite_array("coefficients", _value(d, "coefficients"), (None,), LARGEST)
    if len(coefficients) not in COEFFICIENTS:
        raise ValueError(
            f"coefficients: expected {', '.join(map(str, COEFFICIENTS))} of them, got {len(coefficients)}"
        )
    return MongePatch(number("k1", _value(d, "k1")), number("k2", _value(d, "k2")), coefficients)


def _contours(contours: Any, may_be_none: bool) -> tuple[Contour, ...]:
    """The contours of a list of dicts, which is empty only if there `may_be_none`."""
    if not isinstance(contours, Sequence) or not (contours or may_be_none):
        raise ValueError(f"contours: expected a list of some, got {shown(contours)}")
    return tuple(
        Contour(**{f.name: _value(contour, f.name) for f in fields(Contour)}) for contour in contours
    )


def _taps(d: Any) -> Taps | None:
    """The taps, or None if there were none or the file was written before there were taps."""
    if d is None:
        return None
    taps, missed = (int(number(name, _value(d, name), least=0.0)) for name in ("number", "missed"))
    return Taps(
        taps,
        missed,
        number("off", _value(d, "off"), least=0.0),
        number("missing", d.get("missing", 0.0), least=0.0),
        number_or_none("height", d.get("height"), least=0.0),
    )


def _posterior_dict(posterior: SurfacePosterior) -> dict[str, Any]:
    """A posterior as plain values, with its sextic if it has one."""
    values = {f.name: getattr(posterior, f.name) for f in fields(posterior)}
    return plain(values | {"sextic": posterior.sextic and _posterior_dict(posterior.sextic)})


def _posterior(d: Any) -> SurfacePosterior:
    """The posterior, in unit radius, that `_posterior_dict` wrote."""
    size, places = len(TERMS), finite_array("places", _value(d, "places") or np.empty((0, 2)), (None, 2))
    shapes: dict[str, tuple[int | None, ...]] = {
        "mean": (size,),
        "root": (None, size + 1 + len(places)),
        "visibility": (size - FREE, size - FREE),
        "alpha": (len(places),),
        "variances": (len(LENGTHS),),
    }
    values = {name: finite_array(name, _value(d, name), shape, LARGEST) for name, shape in shapes.items()}
    if np.abs(values["root"]).max(initial=0.0) > WIDEST:
        raise ValueError(f"root: expected numbers up to {WIDEST:g} in unit radius, got larger ones")
    variances, noise = values["variances"], np.array(number("noise", _value(d, "noise"), above=0.0))
    if variances.min() < 0.0 or (variances.max() > 0.0) != (len(places) > 0):
        raise ValueError(
            "variances: expected numbers of 0 or more, above 0 where there are places and 0 without, got "
            f"{shown(variances.tolist())}"
        )
    if np.abs(places).max(initial=0.0) >= 2.0:
        raise ValueError("places: expected them on the unit disk, got others")
    sextic = _value(d, "sextic")
    return SurfacePosterior(
        noise=noise, places=places, sextic=None if sextic is None else _posterior(sextic), **values
    )
