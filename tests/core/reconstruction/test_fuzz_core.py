# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""core with any input: it gives finite numbers and a status, or a sentence that names what is wrong.

Data that is random throughout is refused at once and finds little, so most of it is contours of true
surfaces with one thing broken. `pytest --hypothesis-show-statistics` says how many reach a patch.
"""

import copy
import math
import re
from functools import cache

import numpy as np
import pytest
import surfaces
from fuzzing import in_time
from hypothesis import event, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from core import (
    METHODS,
    SOLVERS,
    Contour,
    DegenerateCurvesError,
    Reconstruction,
    SamplingPlane,
    common_point,
    distances,
    explore,
    from_dict,
    reconstruct,
    reconstruct_many,
    suggest_plane,
    to_dict,
    track,
)
from core.contours.finger import NoContactError

NAMES = (
    "azimuth|contours|contours_list|degree|extent|farthest|method|noise|normal|normal_std|normals|outward|plane_normal|planes|point|"
    "points|rng|noise|solver|step|stops|surface|tangent|tilt|weight"
)
SHAPES = (
    surfaces.sphere(25), surfaces.plane(), surfaces.cylinder(20), surfaces.torus(40, 20, 0.6),
    surfaces.torus(40, 20, 2.6), surfaces.bottle_neck(), surfaces.saddle(), surfaces.quartic(),
    surfaces.monkey_saddle(),
)  # fmt: skip
PLANES = [
    [SamplingPlane(math.radians(a), math.radians(b)) for a, b in planes]
    for planes in (
        ((0, 0), (60, 0), (120, 0)),
        ((13, 12), (73, -18), (133, 8)),
        ((0, 0), (35, 0), (80, 0)),
        ((0, 0), (30, 0), (60, 0), (90, 0), (120, 0), (150, 0)),
    )
]
ODD_NUMBERS = st.one_of(
    st.floats(),
    st.sampled_from([
        0, -0.0, -1.0, 5e-324, 1e-300, 1e300, math.inf, math.nan, 10**400, True, None, "2", "x", b"2", 1j, [],
        {}, np.array([1.0]), np.array([1.0, 2.0]), np.complex128(1.0), np.float32(0.1), np.datetime64("2026"),
    ]),
)  # fmt: skip
ODD_VECTORS = st.one_of(
    st.lists(st.floats(), max_size=4),
    st.sampled_from([
        (0, 0, 0), (5e-324, 0, 0), (1e300, 1e300, 1e300), (0, 0, 10**400), ("a", "b", "c"), ("1", "0", "0"),
        None, "xyz", 3.0, {}, [[1, 0, 0]], np.array([1j, 0, 0]), [[1], [2, 3], 4], range(3), (1, None, 0),
        np.array([1, 2, 3], dtype=object), np.arange(6.0)[::2], np.ones((0, 3)), (True, False, True),
    ]),
)  # fmt: skip
ODD_POINTS = st.one_of(
    hnp.arrays(
        st.sampled_from([np.float64, np.float32, np.float16, np.int64, np.uint8, np.complex128, np.bool_]),
        hnp.array_shapes(min_dims=1, max_dims=3, min_side=0, max_side=5),
    ),
    hnp.arrays(np.float64, st.tuples(st.integers(3, 20), st.just(3)), elements=st.floats(-1e3, 1e3)),
    st.lists(st.tuples(st.floats(), st.floats(), st.floats()), max_size=6),
    ODD_VECTORS,
)
ODD_CURVES = st.one_of(
    ODD_VECTORS, st.lists(ODD_VECTORS, max_size=4), st.sampled_from([5, iter(()), Contour])
)


@cache
def tracked(shape, planes, noise):
    """Contours, as arrays, of a good touch: 9 to 17 contacts a curve."""
    s = SHAPES[shape]
    contours = s.track(PLANES[planes], extent=8 + shape, step=2, noise=noise, rng=shape)
    return s.point, s.normal, [c.points for c in contours]


ENDLESS = "The curves do not end by themselves: set farthest, the greatest length to feel"


def is_sentence(error):
    """Whether an exception is one of core's own, says which argument or curve it is about, and is short."""
    words = str(error)
    if type(error) is DegenerateCurvesError:
        known = words.startswith(
            ("curve ", "curves ", "three curves ", "the tangents ", "the curves ", "the ", "neighboring ")
        )
        return known and len(words) < 400 and "nan" not in words
    return (
        type(error) in (ValueError, NoContactError)
        and re.match(rf"({NAMES})(\[\d+\])?: expected ", words)
        and (", got " in words and "\n" not in words and len(words) < 300)
    ) or words == ENDLESS


def refused(call, *arguments, **options):
    """The result of a call, or None where it refuses with a sentence. Anything else fails."""
    try:
        return call(*arguments, **options)
    except ValueError as error:
        assert is_sentence(error), f"{type(error).__name__}: {error}"
        event(f"refused: {str(error).partition(':')[0][:24]}")


def examine(r):
    """Everything public of a reconstruction is finite, and so is its surface on its domain."""
    assert isinstance(r, Reconstruction)
    assert r.status in ("ok", "uncertain", "not_converged")
    assert r.message.endswith(".")
    assert "nan" not in r.message
    points, triangles = r.mesh()
    assert 0 <= triangles.min() <= triangles.max() < len(points)
    x, y = np.vstack([r.domain.grid(100)[0], r.domain.boundary(12), points[:, :2]]).T
    patch = r.patch
    numbers = [
        *(r.radius, r.noise, r.mean_height_std, r.fit_error, r.total_absolute_curvature),
        *(r.null_space_dimension, r.condition_number, patch.k1, patch.k2, r.domain.area),
    ]
    arrays = [
        *(r.frame.origin, r.frame.axes, r.contacts, r.domain.ends, patch.coefficients, numbers, x, y),
        *(patch.height(x, y), patch.normal(x, y), patch.gaussian_curvature(x, y), patch.mean_curvature(x, y)),
        *(
            patch.principal_curvatures(x, y),
            r.height_std(x, y),
            r.posterior.mean,
            r.posterior.root,
            r.posterior.alpha,
        ),
        distances(patch, np.column_stack([x, y, patch.height(x, y)])),
    ]
    for array in arrays:
        assert np.isfinite(array).all(), array
    assert r.frame.axes.T @ r.frame.axes == pytest.approx(np.eye(3), abs=1e-9)
    assert patch.k1 <= patch.k2
    plane, expected = suggest_plane(r)
    assert np.isfinite([plane.azimuth, plane.tilt, expected]).all()
    assert 0.0 <= expected <= r.mean_height_std * (1 + 1e-6)
    event(f"patch, {r.status}")


# Each of these functions breaks one thing of a touch, in place. A touch is a dict of point, outward, curves
# (arrays), keyword arguments for each Contour, and options for reconstruct.


def nothing(draw, touch):
    pass


def scale(draw, touch):
    """Another unit of length."""
    factor = 10.0 ** draw(st.integers(-60, 60))
    touch["point"] = factor * touch["point"]
    touch["curves"] = [factor * c for c in touch["curves"]]


def shift(draw, touch):
    """Far from the origin, so that digits get lost."""
    by = 10.0 ** draw(st.integers(0, 40)) * np.array([1.0, -0.3, 0.1])
    touch["point"] = touch["point"] + by
    touch["curves"] = [c + by for c in touch["curves"]]


def squash(draw, touch):
    """One axis longer or shorter."""
    factors = np.ones(3)
    factors[draw(st.integers(0, 2))] = 10.0 ** draw(st.integers(-30, 30)) * draw(st.sampled_from([1, 0, -1]))
    touch["curves"] = [touch["point"] + factors * (c - touch["point"]) for c in touch["curves"]]


def contact(draw, touch):
    """One contact is elsewhere, or nowhere."""
    curve = touch["curves"][draw(st.integers(0, 2))]
    row, column = draw(st.integers(0, len(curve) - 1)), draw(st.integers(0, 2))
    curve[row, column] = draw(
        st.one_of(st.floats(), st.floats(-100, 100), st.sampled_from([1e6, -1e12, 1e30, 5e-324]))
    )


def outliers(draw, touch):
    """Some contacts are far off."""
    seed, size = draw(st.integers(0, 99)), 10.0 ** draw(st.integers(-12, 45))
    rng = np.random.default_rng(seed)
    for curve in touch["curves"]:
        wrong = rng.random(len(curve)) < rng.choice([0.1, 0.5, 1.0])
        curve[wrong] += size * rng.normal(size=(np.count_nonzero(wrong), 3))


def duplicates(draw, touch):
    """Contacts at one place, many times."""
    number = draw(st.integers(0, 2))
    curve = touch["curves"][number]
    count = draw(st.integers(1, 40))
    touch["curves"][number] = np.repeat(curve, [count if i == 2 else 1 for i in range(len(curve))], axis=0)


def fewer(draw, touch):
    """Only some contacts of each curve, in another order."""
    for number, curve in enumerate(touch["curves"]):
        rows = draw(st.lists(st.integers(0, len(curve) - 1), min_size=2, max_size=12))
        touch["curves"][number] = curve[rows]


def one_sided(draw, touch):
    """Curves that run to one side of the point only, or that begin away from it."""
    for number in draw(st.sets(st.integers(0, 2), min_size=1)):
        middle = len(touch["curves"][number]) // 2
        touch["curves"][number] = touch["curves"][number][middle + draw(st.integers(-1, 1)) :]


def straight(draw, touch):
    """Contacts of a curve on a line, or nearly."""
    bend = draw(st.sampled_from([0.0, 1e-300, 1e-12, 1e-3, 1e3]))
    for number in draw(st.sets(st.integers(0, 2), min_size=1)):
        offsets = touch["curves"][number] - touch["point"]
        along = np.outer(offsets @ (a := offsets[0] / np.linalg.norm(offsets[0])), a)
        touch["curves"][number] = touch["point"] + along + bend * (offsets - along)


def alike(draw, touch):
    """Two curves in nearly one direction."""
    share = draw(st.sampled_from([0.0, 1e-15, 1e-3, 0.02, 0.03, 0.1]))
    one, other = touch["curves"][:2]
    touch["curves"][1] = (
        one + share * (other[: len(one)] - one[: len(other)]) if len(one) == len(other) else one
    )


def circle(draw, touch):
    """Curves that come back to where they were."""
    turn = draw(st.sampled_from([0.5, 1.0, 2.0])) * np.linspace(-np.pi, np.pi, 21)
    for number, curve in enumerate(touch["curves"]):
        tangent = (curve[-1] - curve[0]) / np.linalg.norm(curve[-1] - curve[0])
        arc = np.outer(np.sin(turn), tangent) - np.outer(1.0 - np.cos(turn), touch["outward"])
        touch["curves"][number] = touch["point"] + arc


def reference(draw, touch):
    """The reference point off the curves."""
    touch["point"] = touch["point"] + 10.0 ** draw(st.integers(-12, 45)) * np.array([0.3, -1.0, 0.5])


def number_kind(draw, touch):
    """Other kinds of numbers, and of arrays."""
    kind = draw(
        st.sampled_from([np.float32, np.float16, np.int64, np.int8, "list", "fortran", "strided", "strings"])
    )
    change = {
        "list": np.ndarray.tolist,
        "fortran": np.asfortranarray,
        "strided": lambda c: np.repeat(c, 2, axis=0)[::-2],
        "strings": lambda c: c.astype(str),
    }.get(kind, lambda c: c.astype(kind))
    touch["curves"] = [change(c) for c in touch["curves"]]


def contour_option(draw, touch):
    """An odd keyword argument of each Contour."""
    name = draw(st.sampled_from(["plane_normal", "normals", "noise", "stops"]))
    values = {
        "plane_normal": ODD_VECTORS,
        "normals": ODD_POINTS,
        "noise": st.one_of(ODD_NUMBERS, st.floats(0, 1e60)),
        "stops": st.sampled_from(
            [("extent", "crease"), ("a",), "ab", 5, (None, "x"), (1, 2), [], ("a", "b", "c")]
        ),
    }
    touch["contour"] = {name: draw(values[name])}


def option(draw, touch):
    """An odd argument of reconstruct, valid or not."""
    name = draw(
        st.sampled_from(["outward", "point", "method", "solver", "degree", "noise", "weight", "curves"])
    )
    values = {
        "outward": ODD_VECTORS,
        "point": ODD_VECTORS,
        "curves": ODD_CURVES,
        "degree": st.one_of(
            st.integers(-2, 9), st.sampled_from([2.0, True, np.int64(4), "4", "auto "]), ODD_VECTORS
        ),
        "noise": st.one_of(ODD_NUMBERS, st.floats(0, 1e60)),
        "weight": st.one_of(ODD_NUMBERS, st.floats(0, 1e60)),
    }
    touch[name] = draw(values.get(name, st.one_of(ODD_VECTORS, st.sampled_from(["", "BAYES", ("bayes",)]))))


BREAKS = (
    nothing, scale, shift, squash, contact, outliers, duplicates, fewer, one_sided, straight, alike, circle,
    reference, number_kind, contour_option, option,
)  # fmt: skip


@st.composite
def touches(draw):
    """A touch of a true surface, with one thing broken, now and then two."""
    shape, planes = draw(st.integers(0, len(SHAPES) - 1)), draw(st.integers(0, len(PLANES) - 1))
    point, outward, curves = copy.deepcopy(tracked(shape, planes, draw(st.sampled_from([0.0, 0.05]))))
    touch = {
        "point": point,
        "outward": outward,
        "curves": curves,
        "contour": {},
        "method": draw(st.sampled_from(METHODS)),
        "degree": draw(st.sampled_from([2, 3, 4, 5, 6, "auto"])),
        "noise": draw(st.sampled_from([None, 0.0, 0.05, 10.0])),
        "weight": draw(st.sampled_from([None, 1e-9, 1.0, 1e5, 1e12])),
        "solver": draw(st.sampled_from([SOLVERS[0]] * 9 + [SOLVERS[1]])),
    }
    chosen = draw(st.lists(st.sampled_from(BREAKS), min_size=1, max_size=2, unique=True))
    for broken in sorted(chosen, key=BREAKS.index):
        with np.errstate(all="ignore"):
            broken(draw, touch)
        event(f"broken: {broken.__name__}")
    return touch


def contours_of(touch):
    curves, more = touch.pop("curves"), touch.pop("contour")
    if isinstance(curves, list):
        return [Contour(points, **more) for points in curves]
    return curves


@given(touches())
@in_time
def test_a_touch_with_one_thing_broken(touch):
    contours = refused(contours_of, touch)
    if contours is None:
        return
    arguments = touch | {"contours": contours}
    r = refused(reconstruct, **arguments)
    if r is not None:
        examine(r)


@pytest.mark.long
@given(touches())
@in_time
def test_many_touches_with_one_of_them_broken(touch):
    """The broken one gives what `reconstruct` gives for it, and does the other no harm."""
    contours = refused(contours_of, touch)
    if contours is None:
        return
    point, outward, curves = tracked(0, 0, 0.0)
    good, options = (
        [Contour(c) for c in curves],
        {name: touch[name] for name in ("method", "degree", "noise", "weight", "solver")},
    )
    many = refused(
        reconstruct_many,
        [touch["point"], point],
        [contours, good],
        outward=[touch["outward"], outward],
        **options,
    )
    single = refused(reconstruct, touch["point"], contours, outward=touch["outward"], **options)
    if many is None:
        assert single is None
        return
    found, other = many
    examine(other)
    if single is None:
        assert isinstance(found, DegenerateCurvesError)
        assert is_sentence(found), found
        return
    examine(found)
    # Where a fit is in doubt, rounding may decide between two surfaces.
    if single.status == "ok" == found.status and single.method == "bayes":
        x, y = single.domain.grid(60)[0].T
        turn = found.frame.axes.T @ single.frame.axes
        u, v, w = turn @ [x, y, single.patch.height(x, y)]
        assert found.patch.height(u, v) == pytest.approx(w, abs=1e-4 * single.radius)


@given(st.lists(ODD_POINTS, max_size=5), ODD_VECTORS, ODD_VECTORS, st.sampled_from(METHODS))
@in_time
def test_arbitrary_curves(curves, point, outward, method):
    contours = refused(lambda: [Contour(c) for c in curves])
    if contours is not None:
        r = refused(reconstruct, point, contours, outward=outward, method=method)
        if r is not None:
            examine(r)


@given(st.lists(ODD_POINTS, max_size=5))
@in_time
def test_where_arbitrary_curves_meet(curves):
    found = refused(lambda: common_point([Contour(c) for c in curves]))
    if found is not None:
        assert all(np.isfinite(values).all() for values in found)


@pytest.mark.long
@given(st.integers(0, 8), st.integers(0, 3), st.data())
@in_time
def test_arbitrary_measured_normals(shape, planes, data):
    """Normals are fitted or refused, and the reconstruction survives as plain values."""
    point, outward, curves = tracked(shape, planes, 0.0)
    contours = []
    for curve in curves:
        normals = data.draw(st.one_of(hnp.arrays(np.float64, curve.shape), st.just(curve - point + outward)))
        std = data.draw(st.one_of(ODD_NUMBERS, st.floats(1e-300, 1e3)))
        contours.append(refused(Contour, curve, normals=normals, normal_std=std) or Contour(curve))
    r = refused(reconstruct, point, contours, outward=outward)
    if r is not None:
        examine(r)
        examine(from_dict(to_dict(r)))


def odd_hits(point, normal):
    """What a surface might answer in place of the right answer."""
    unit = st.floats(0.0, 6.3).map(lambda a: (math.cos(a), 0.6 * math.sin(a), 0.8 * math.sin(a)))
    near = st.tuples(*[st.floats(-5.0, 5.0).map(lambda d, x=x: x + d) for x in point])
    return st.one_of(
        st.none(),
        st.tuples(near, st.just(normal)),
        st.tuples(st.just(point), unit),
        st.tuples(st.tuples(*[st.floats(-1e50, 1e50)] * 3), unit),
        st.just((np.array(point), np.float32(normal))),
    )


def bad_hits(point, normal):
    """What is no point, or no unit normal."""
    return st.one_of(
        st.just((point, (0.0, 0.0, 0.0))),
        st.tuples(st.tuples(*[st.floats()] * 3), st.just(normal)),
        st.tuples(st.just(point), st.tuples(*[st.floats()] * 3)),
        st.sampled_from([(), 5, (None, None), (point,), ((1, 2), (3, 4)), ("abc", "def")]),
    )


class OddSurface:
    """A true surface that answers every `rarely`-th ray with what `hits` draws."""

    def __init__(self, shape, data, rarely, hits):
        self.shape, self.data, self.rarely, self.hits, self.count = shape, data, rarely, hits, 0

    def ray_cast(self, origin, direction, distance):
        with np.errstate(all="ignore"):  # odd answers lead rays far away
            hit = self.shape.ray_cast(origin, direction, distance)
        self.count += 1
        if self.count % self.rarely or self.count > 60:
            return hit
        point, normal = (origin, direction) if hit is None else hit
        return self.data.draw(self.hits(tuple(map(float, point)), tuple(map(float, normal))))


@pytest.mark.long
@given(
    st.data(),
    st.integers(0, len(SHAPES) - 1),
    st.integers(2, 40),
    st.sampled_from([odd_hits, odd_hits, odd_hits, bad_hits]),
)
@in_time
def test_a_surface_that_answers_oddly(data, shape, rarely, hits):
    s = SHAPES[shape]
    surface = OddSurface(s, data, rarely, hits)
    contours = refused(track, surface, s.point, s.normal, PLANES[0], extent=8, step=1.5, noise=0.01, rng=1)
    if contours is not None:
        for contour in contours:
            assert np.isfinite(contour.points).all()
        r = refused(reconstruct, s.point, contours, outward=s.normal)
        if r is not None:
            examine(r)
    found = refused(
        explore, OddSurface(s, data, rarely, hits), s.point, s.normal, PLANES[0], farthest=24.0, rng=1
    )
    if found is not None:
        examine(found.result)


TRACKING = {
    "point": ODD_VECTORS,
    "outward": ODD_VECTORS,
    "tangent": ODD_VECTORS,
    "planes": st.one_of(
        st.builds(lambda a, b: [SamplingPlane(a, b)], ODD_NUMBERS, ODD_NUMBERS),
        st.builds(lambda a: [SamplingPlane(a)], st.floats()),
        st.sampled_from([[], None, 5, [None], [0.0, 1.0], "abc", iter(())]),
    ),
    "extent": ODD_NUMBERS,
    "step": st.one_of(ODD_NUMBERS, st.floats(1e-300, 8.0)),
    "noise": ODD_NUMBERS,
    "rng": ODD_NUMBERS,
}


@given(st.sets(st.sampled_from(sorted(TRACKING)), min_size=1, max_size=2), st.data())
@in_time
def test_tracking_with_odd_arguments(names, data):
    s = SHAPES[1]
    arguments = {"point": s.point, "outward": s.normal, "planes": PLANES[0], "extent": 8.0, "step": 1.5}
    arguments |= {name: data.draw(TRACKING[name]) for name in sorted(names)}
    contours = refused(track, s, **arguments)
    if contours is not None:
        for contour in contours:
            assert np.isfinite(contour.points).all()
        event("tracked")


EXPLORING = TRACKING | {
    "farthest": ODD_NUMBERS,
    "extent": st.one_of(TRACKING["extent"], st.sampled_from(["auto", "far"])),
    "step": st.one_of(TRACKING["step"], st.sampled_from(["auto", "near"])),
    "method": st.sampled_from([*METHODS, "magic", None]),
    "degree": st.sampled_from([2, 4, "auto", 7]),
}


@given(st.sets(st.sampled_from(sorted(EXPLORING)), min_size=1, max_size=2), st.data())
@in_time
def test_exploring_with_odd_arguments(names, data):
    s = SHAPES[1]
    arguments = {"point": s.point, "outward": s.normal, "planes": PLANES[0], "farthest": 16.0}
    arguments |= {name: data.draw(EXPLORING[name]) for name in sorted(names)}
    found = refused(explore, s, **arguments)
    if found is not None:
        examine(found.result)
        assert 0.0 < found.step <= found.extent
        event("explored")
