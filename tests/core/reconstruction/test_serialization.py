# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A reconstruction as plain values and back."""

import json
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import surfaces

from core import (
    METHODS,
    Contour,
    from_dict,
    reconstruct,
    suggest_plane,
    to_dict,
)

SURFACE = surfaces.torus(40, 20, 0.6)


def touched(noise=0.05, **options):
    return SURFACE.fit(SURFACE.track(surfaces.planes((0, 60, 120)), noise=noise, rng=1), **options)


RESULTS = [touched(method=method) for method in METHODS]
RESULTS += [touched(degree=2), touched(degree=6), touched(noise=1.0), touched(degree="auto")]
RESULTS += [replace(RESULTS[0], shape_curvatures=np.array([[-0.5, 0.1], [-0.4, 0.2]]), facet_width=30.0)]


@pytest.mark.parametrize("r", RESULTS)
def test_through_json_and_back_it_is_the_same_to_the_last_bit(r):
    text = json.dumps(to_dict(r), allow_nan=False)
    again = from_dict(json.loads(text))
    assert json.dumps(to_dict(again), allow_nan=False) == text
    x, y = r.domain.grid(80)[0].T
    for name in ("height", "height_std"):
        assert np.array_equal(getattr(again, name)(x, y), getattr(r, name)(x, y))
    assert np.array_equal(again.domain.boundary(50), r.domain.boundary(50))
    assert np.array_equal(again.contacts, r.contacts)
    for one, other in zip(again.contours, r.contours, strict=True):
        for key, value in vars(one).items():
            assert np.array_equal(value, vars(other)[key]), key
    for name in ("method", "status", "message", "radius", "converged", "mean_height_std", "k1_std"):
        assert getattr(again, name) == getattr(r, name)
    for name in ("null_space_dimension", "fit_error", "total_absolute_curvature", "condition_number"):
        assert getattr(again, name) == getattr(r, name)
    assert suggest_plane(again) == suggest_plane(r)


@pytest.mark.parametrize("method", METHODS)
def test_far_from_the_origin_it_is_the_same_too(method):
    shift = np.eye(4)
    shift[:3, 3] = 4e5, -3e5, 1e5
    r = RESULTS[METHODS.index(method)].moved(shift)
    again = from_dict(json.loads(json.dumps(to_dict(r))))
    assert len(again.contacts) == len(r.contacts) == 72
    assert np.array_equal(again.contacts, r.contacts)


def test_it_says_what_it_is():
    d = to_dict(RESULTS[0])
    assert d["version"] == 4
    assert d["status"] == RESULTS[0].status
    assert len(d["contours"]) == 3
    assert len(d["contours"][0]["points"]) == 25


def damaged(path, value):
    d = json.loads(json.dumps(to_dict(RESULTS[0])))
    *inner, last = path
    place = d
    for key in inner:
        place = place[key]
    if value is None:
        del place[last]
    else:
        place[last] = value
    return d


KEYS = sorted(set(to_dict(RESULTS[0])) - {"status", "message", "doubts"})


VALUES = [None, "ball", float("nan"), [], {}, [[1.0]], [{}], -1]


def is_refused(key, value):
    """Only `taps` may be missing."""
    return value is not None or key != "taps"


@pytest.mark.parametrize(("key", "value"), [c for c in product(KEYS, VALUES) if is_refused(*c)], ids=str)
def test_a_damaged_dict_is_refused_with_a_sentence(key, value):
    with pytest.raises(ValueError, match=r": expected "):
        from_dict(damaged([key], value))


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (["version"], 2, "version: expected 4, got 2: this was written by another release"),
        (["geometry", "radius"], None, "radius: expected it in the dict of a reconstruction, got none"),
        (["geometry", "radius"], 1e-300, "radius: expected a finite number of 1e-50 or more"),
        (["method"], "magic", "method: expected one of bayes"),
        (["converged"], "false", "converged: expected True or False, as to_dict gives it, got 'false'"),
        (["geometry", "frame", "axes"], np.diag([1, 1, -1]).tolist(), "axes: expected a right-handed frame"),
        (["geometry", "frame", "axes"], np.diag([2, 2, 2]).tolist(), "axes: expected a right-handed frame"),
        (["geometry", "frame", "origin"], [0, 0], "origin: expected shape"),
        (["patch", "k1"], "flat", "k1: expected a finite number"),
        (["patch", "coefficients"], [1.0, 2.0], "coefficients: expected 0, 4, 9, 15, 22 of them, got 2"),
        (["geometry", "domain"], [[0, 0], [1, 1]], "three or more"),
        (["contours"], [], "contours: expected a list of some"),
        (["contours", 0, "points"], [1, 2], "points: expected shape"),
        (["contours", 0, "noise"], -1.0, "noise: expected a finite number of 0 or more"),
        (["posterior", "places"], 3, "places: expected shape"),
        (["posterior", "root"], [[1.0]], "root: expected shape"),
        (["posterior", "mean"], None, "mean: expected it in the dict"),
        (["posterior"], None, "posterior: expected it in the dict"),
        (["geometry", "frame", "axes", 0, 0], 1e300, "axes: expected a right-handed frame"),
        (["geometry", "frame", "origin", 0], 1e20, "point: expected places within 10 radii of the origin"),
        (["geometry", "radius"], 0.5, "domain: expected places within 10 radii of the origin"),
        (["geometry", "domain", 0, 1], 1e30, "domain: expected places within 10 radii of the origin"),
        (["contours", 1, "points", 0, 2], -1e9, r"contours\[1\]: expected places within 10 radii"),
        (["patch", "coefficients", 0], 1e200, "coefficients: expected numbers up to"),
        (["posterior", "root", 0, 0], 1e9, "root: expected numbers up to 1000 in unit radius"),
        (["posterior", "variances", 0], 1e200, "variances: expected numbers"),
        *((["posterior", key, 0], 1e200, f"{key}: expected numbers up to") for key in ("mean",)),
    ],
)
def test_what_is_wrong_is_named(path, value, words):
    with pytest.raises(ValueError, match=words):
        from_dict(damaged(path, value))


@pytest.mark.parametrize("value", [None, 3, "{}", [1, 2]])
def test_what_is_no_dict_is_refused(value):
    with pytest.raises(ValueError, match="version: expected it in a dict"):
        from_dict(value)


def rough(height=0.01):
    """A reconstruction with a process, of contacts on waves that no sextic follows."""
    t, contours = np.linspace(-1.0, 1.0, 31), []
    for a in np.radians((0.0, 60.0, 120.0)):
        x, y = t * np.cos(a), t * np.sin(a)
        contours.append(Contour(np.column_stack([x, y, height * np.sin(9.0 * x + 4.0 * y)])))
    return reconstruct((0, 0, 0), contours, outward=(0, 0, 1))


@pytest.mark.parametrize(
    ("key", "change", "words"),
    [
        ("variances", lambda v: v * [-1.0, 1.0], "variances: expected numbers of 0 or more"),
        ("variances", lambda v: 0.0 * v, "variances: expected .* above 0 where there are places"),
        ("places", lambda v: v[:0], "root: expected shape"),
        ("noise", lambda v: -v, "noise: expected a finite number above 0"),
        ("places", lambda v: 1e300 * v, "places: expected them on the unit disk"),
        ("root", lambda v: v[:, :-1], "root: expected shape"),
        ("alpha", lambda v: v[:-1], "alpha: expected shape"),
    ],
)
def test_a_damaged_posterior_is_refused(key, change, words):
    d = to_dict(rough())
    posterior = d["posterior"]
    assert from_dict(d).posterior.amplitude > 0.0
    posterior[key] = change(np.array(posterior[key])).tolist()
    with pytest.raises(ValueError, match=words):
        from_dict(d)


def test_a_polynomial_with_the_variances_of_a_process_is_refused():
    d = to_dict(touched())
    d["posterior"]["variances"] = [1e-4, 0.0]
    with pytest.raises(ValueError, match=r"variances: expected .* 0 without"):
        from_dict(d)


def test_a_process_of_low_waves_keeps_the_frame_of_its_sextic():
    """They are off it by less than 0.2 % of the radius, as facets of a smooth surface are."""
    r, other = rough(0.002), rough(0.006)
    assert min(r.posterior.amplitude, other.posterior.amplitude) > 0.0
    assert r.posterior.sextic is not None and other.posterior.sextic is None
    assert np.array_equal(r.posterior.polynomial, r.posterior.sextic.mean)
    assert np.array_equal(r.posterior.covariance, r.posterior.sextic.covariance)
    assert [r.patch.k1, r.patch.k2] == pytest.approx(2.0 * r.posterior.sextic.mean[[2, 4]] / r.radius)
    for each in (r, other):
        text = json.dumps(to_dict(each), allow_nan=False)
        assert json.dumps(to_dict(from_dict(json.loads(text))), allow_nan=False) == text
