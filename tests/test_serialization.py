# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A reconstruction as plain values and back."""

import json

import numpy as np
import pytest
import surfaces

from core import METHODS, from_dict, suggest_plane, to_dict

SURFACE = surfaces.torus(40, 20, 0.6)


def touched(noise=0.05, **options):
    return SURFACE.fit(SURFACE.track(surfaces.planes((0, 60, 120)), noise=noise, rng=1), **options)


RESULTS = [touched(method=method) for method in METHODS]
RESULTS += [touched(degree=2), touched(degree=6), touched(noise=1.0), touched(degree="auto")]


@pytest.mark.parametrize("r", RESULTS)
def test_through_json_and_back_it_is_the_same(r):
    again = from_dict(json.loads(json.dumps(to_dict(r), allow_nan=False)))
    x, y = r.domain.grid(80)[0].T
    near = {"rel": 1e-9, "abs": 1e-12}
    assert np.array_equal(again.frame.axes, r.frame.axes)
    assert np.array_equal(again.frame.origin, r.frame.origin)
    assert again.patch.height(x, y) == pytest.approx(r.patch.height(x, y), **near)
    assert again.height_std(x, y) == pytest.approx(r.height_std(x, y), **near)
    assert again.domain.boundary(50) == pytest.approx(r.domain.boundary(50), **near)
    assert again.contacts == pytest.approx(r.contacts, **near)
    for name in ("k1", "k2"):
        assert getattr(again.patch, name) == getattr(r.patch, name)
    for name in ("method", "status", "message", "blind", "radius", "converged"):
        assert getattr(again, name) == getattr(r, name)
    for name in ("fit_error", "mean_height_std", "total_absolute_curvature", "condition_number"):
        assert getattr(again, name) == pytest.approx(getattr(r, name), rel=1e-9)
    assert suggest_plane(again)[1] == pytest.approx(suggest_plane(r)[1], rel=1e-6)
    twice = to_dict(again)
    assert twice["curves"][1]["points"] == pytest.approx(np.array(to_dict(r)["curves"][1]["points"]), **near)


def test_it_says_what_it_is():
    d = to_dict(RESULTS[0])
    assert d["version"] == 1
    assert d["status"] == RESULTS[0].status
    assert len(d["curves"]) == 3
    assert len(d["curves"][0]["points"]) == 24


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


KEYS = sorted(set(to_dict(RESULTS[0])) - {"status", "message"})


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.parametrize("value", [None, "ball", float("nan"), [], {}, [[1.0]], [{}], -1], ids=str)
def test_a_damaged_dict_is_refused_with_a_sentence(key, value):
    if (
        (key == "converged" and value is not None)
        or (key in ("k1", "k2") and value == -1)
        or (
            key == "coefficients" and value == []  # of degree 2
        )
    ):
        return
    with pytest.raises(ValueError, match=r": wanted "):
        from_dict(damaged([key], value))


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (["version"], 2, "version: wanted 1, got 2: this was written by another release"),
        (["radius"], None, "radius: wanted it in the dict of a reconstruction, got none"),
        (["method"], "magic", "method: wanted one of bayes"),
        (["frame", "axes"], [[1, 0, 0], [0, 1, 0], [0, 0, -1]], "axes: wanted a right-handed frame"),
        (["frame", "axes"], [[2, 0, 0], [0, 2, 0], [0, 0, 2]], "axes: wanted a right-handed frame"),
        (["frame", "origin"], [0, 0], "origin: wanted shape"),
        (["coefficients"], [1.0, 2.0], "coefficients: wanted 0, 4, 9, 15, 22 of them, got 2"),
        (["domain"], [[0, 0], [1, 1]], "three or more"),
        (["curves"], [], "curves: wanted a list of some"),
        (["curves", 0, "tangent"], [1, 2], "tangent: wanted shape"),
        (["curves", 0, "along"], [1, 2], "along: wanted shape"),
        (["posterior", "covariance"], [[1.0]], "covariance: wanted shape"),
        (["posterior", "mean"], None, "mean: wanted it in the dict"),
    ],
)
def test_what_is_wrong_is_named(path, value, words):
    with pytest.raises(ValueError, match=words):
        from_dict(damaged(path, value))


@pytest.mark.parametrize("value", [None, 3, "{}", [1, 2]])
def test_what_is_no_dict_is_refused(value):
    with pytest.raises(ValueError, match="version: wanted it in a dict"):
        from_dict(value)
