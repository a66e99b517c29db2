# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Advice helps: each doubt is gone or smaller where its advice was followed."""

import math
from dataclasses import replace

import numpy as np
import pytest
import surfaces

import core
from core.contours.common_point import common_point
from core.paper import tagc
from core.verdict import REASONS
from tests import solids
from tests.core.atlas.test_measured import ball, cap_rows, few_on_box, rings_of_ball, second
from tests.core.bayes.test_bends import fold
from tests.core.bayes.test_measured_normals import measured, tilted, touched
from tests.core.bayes.test_near_point import cone
from tests.core.exploration.test_taps import FARTHEST, UP, Holes, Sector, explore
from tests.core.reconstruction.test_facets import arc, judged, rounded
from tests.core.reconstruction.test_status import contours_of, cut_short, moved, waves


def facets():
    """A Subdivision modifier makes more facets."""
    found = []
    for mesh in (arc(5), arc(41)):
        z = float(np.interp(0.01, *mesh.profile.T))
        r = core.explore(mesh, (0.01, 0.0, z), UP, extent=0.15).result
        found.append(judged(r, mesh)[0].doubts)
    return found


def taps():
    surface = Sector(-4.0, nearest=0.5)
    return explore(surface, extent=FARTHEST).result.doubts, explore(surface, extent=1.0).result.doubts


def near_edge():
    half = Sector(None, nearest=0.0, azimuths=(0.0, 180.0))
    return explore(half).result.doubts, explore(half, (0.0, -1.0, 0.0)).result.doubts


def gap():
    surface = Holes(None, nearest=0.5)
    return explore(surface, extent=FARTHEST).result.doubts, explore(surface, extent=0.3).result.doubts


def steps(monkeypatch):
    s = surfaces.cylinder(20)
    contours = s.track(surfaces.UPRIGHT)
    monkeypatch.setattr(tagc, "DESCENT_CAP", 1000)
    return [s.fit(contours, method="tagc", solver=solver).doubts for solver in ("descent", "fast")]


def condition():
    s = surfaces.pear()
    return [s.fit(contours_of(s), method=method).doubts for method in ("least-squares", "bayes")]


def kink():
    """Beside the tip of a cone, the point is away from what bends sharply."""
    found = []
    for away in (0.0, 2.0):
        s, planes = np.linspace(-1.0, 1.0, 25), (0.1, 1.1, 2.1)
        lines = [np.add(np.outer(s, [math.cos(a), math.sin(a)]), (away, 0.0)) for a in planes]
        curves = [np.column_stack([xy, -0.2 * np.hypot(*xy.T)]) for xy in lines]
        found.append(core.reconstruct((away, 0, -0.2 * away), map(core.Contour, curves), outward=UP).doubts)
    return found


def point():
    s = surfaces.pear()
    contours = contours_of(s, noise=0.02)
    contours[1] = moved(contours[1], 0.4 * np.cross(s.normal, contours[1].points[-1] - s.point) / 12.0)
    meeting = common_point(contours)[0]
    return [core.reconstruct(at, contours, outward=s.normal).doubts for at in (s.point, meeting)]


def without_normals(contours):
    return [replace(contour, normals=None, normal_std=None) for contour in contours]


def normals():
    s = surfaces.pear()
    turned = tilted(s, measured(touched(s), 0.02), 5.0)
    return [s.fit(contours).doubts for contours in (turned, without_normals(turned))]


def scattered_normals():
    s, rng = surfaces.pear(), np.random.default_rng(0)
    random = [
        replace(c, normals=rng.normal(size=c.normals.shape), normal_std=0.02) for c in touched(s, 0.05, 0)
    ]
    return [s.fit(contours).doubts for contours in (random, without_normals(random))]


def contacts():
    s = surfaces.plane()
    given = contours_of(s, noise=0.3, count=24)
    return [s.fit(some, degree=2).doubts for some in ([replace(c, noise=None) for c in given], given)]


FIVE = (13, 43, 73, 103, 133)


def heights():
    s = surfaces.pear()
    return [s.fit(contours_of(s, degrees=degrees, noise=1.5)).doubts for degrees in ((13, 73, 133), FIVE)]


def directions():
    s = surfaces.ellipsoid(30, 28, 27, 0.4, 0.5)
    return [
        s.fit(contours_of(s, degrees=degrees, noise=0.1, seed=1)).doubts for degrees in ((13, 33, 53), FIVE)
    ]


def curvatures():
    s = surfaces.torus(40, 20, 2.6)
    return [
        s.fit(cut_short(contours_of(s, degrees=degrees), s.point)).doubts for degrees in ((13, 73, 133), FIVE)
    ]


def curve():
    s = surfaces.pear()
    contours = contours_of(s, degrees=FIVE)
    flipped = 2.0 * s.point - contours[0].points
    return [s.fit(some).doubts for some in ([replace(contours[0], points=flipped), *contours[1:]], contours)]


def waves_():
    s = waves(13, 1.2, 20)
    return [
        s.fit(s.track(surfaces.planes((0, 60, 120)), extent=extent, step=extent / 24)).doubts
        for extent in (13, 3)
    ]


def flat_face():
    return [
        core.explore(rounded(), (0.65, 0.0, 0.0), UP, extent=extent).result.doubts for extent in (0.3, 0.04)
    ]


def folds():
    s, planes = fold(20), surfaces.planes((10.0, 70.0, 130.0))
    return [core.explore(s, s.point, s.normal, planes, extent=extent).result.doubts for extent in (1.0, 0.15)]


def bend():
    s, planes = cone(0.3, 0.5), surfaces.planes((30, 90, 150))
    return [
        core.explore(s, s.point, s.normal, planes, extent=extent, step=extent / 16).result.doubts
        for extent in (2.0, 0.15)
    ]


def opposed():
    points = np.vstack(rings_of_ball())
    normals = np.where((points[:, 2] > 0.8)[:, None], second(points, None), points)
    return [core.atlas_of([core.Contour(points, normals=some)]).doubts for some in (normals, None)]


def ball_():
    return [
        core.atlas_of([core.Contour(ring, ball=radius) for ring in rings_of_ball()]).doubts
        for radius in (1.4, 0.2)
    ]


def noise():
    points = ball(2000) * np.where(np.arange(2000) % 2, 1.0, 1.03)[:, None]
    given = [core.Contour(points, normals=ball(2000))]
    return core.atlas_of(given).doubts, core.atlas_of(given, noise=0.03).doubts


def cavity():
    return [core.atlas_of([core.Contour(ball(), normals=side * ball())]).doubts for side in (-1.0, 1.0)]


def off_surface():
    near = np.linalg.norm(ball() - (0.6, 0.0, 0.8), axis=1) < 0.5
    points = (1.0 + 0.05 * near * np.random.default_rng(0).normal(size=600))[:, None] * ball()
    given = [core.Contour(points, normals=ball())]
    return [core.atlas_of(given, noise=std).doubts for std in (1e-3, 0.05)]


def confused():
    """Two balls with a gap, felt by strokes that are farther apart than it, and nearer."""
    # Along an axis of the rings ties of distances would leave it to rounding which strokes are neighbors.
    found, apart = [], 1.03 * np.array([1.0, 0.1, 0.3]) / math.hypot(1.0, 0.1, 0.3)
    for gap in (0.2, 0.1):
        one = [0.5 * ring for ring in rings_of_ball(gap=gap)]
        found.append(core.atlas_of([*one, *(ring + apart for ring in one)]).doubts)
    return found


def sparse():
    return [core.atlas_of([few_on_box(count)]).doubts for count in (650, 2000)]


def unfelt():
    return core.atlas_of(cap_rows(), outward=UP).doubts, core.atlas_of(rings_of_ball()).doubts


def cut_short_():
    solid = solids.ball()
    return [
        core.explore_object(solid, solid.start, solid.outward, tolerance=4e-3, most=most, rng=0).doubts
        for most in (4, 200)
    ]


def explored(solid, tolerance):
    return core.explore_object(solid, solid.start, solid.outward, tolerance=tolerance, rng=0).doubts


def goes_on():
    """Patches of a coarse tolerance do not get into a slot."""
    return [explored(solids.slotted(0.14, 0.7), tolerance) for tolerance in (0.05, 0.02)]


def thin():
    """A part of a plate, touched as an object of its own."""
    return explored(solids.block(1.0, 0.7, 0.004), 0.02), explored(solids.block(0.1, 0.07, 0.004), 0.002)


def rays():
    """Patches of a coarse tolerance miss a pin."""
    return [explored(solids.pinned(), tolerance) for tolerance in (0.05, 0.005)]


def rough():
    """A larger tolerance, of the same patches."""
    solid = solids.ball()
    atlas = core.explore_object(solid, solid.start, solid.outward, tolerance=4e-3, rng=0)
    return replace(atlas, tolerance=1e-9).doubts, atlas.doubts


OF_TOUCHES = {
    **{each.__name__.rstrip("_"): each for each in (facets, taps, near_edge, gap, condition, kink, point)},
    **{each.__name__.rstrip("_"): each for each in (normals, scattered_normals, contacts, heights)},
    **{each.__name__.rstrip("_"): each for each in (directions, curvatures, curve, waves_, flat_face)},
    **{each.__name__.rstrip("_"): each for each in (folds, bend, steps)},
}
OF_OBJECTS = {
    each.__name__.rstrip("_"): each
    for each in (
        *(opposed, ball_, noise, cavity, off_surface, confused, sparse, unfelt),
        *(cut_short_, goes_on, thin, rays, rough),
    )
}
# What only Blender knows is in tests/addon.
ELSEWHERE = {"at_edge", "stopped", "out_of_reach", "holes", "off_mesh", "share", "mean_height"}
ELSEWHERE |= {"open_edges", "narrow", "hidden", "single_facets"}


def assert_helped(code, before, after):
    """The doubt of this code is there before, and after that gone or smaller."""
    values = {doubt.code: doubt.value for doubt in after}
    (there,) = (doubt for doubt in before if doubt.code == code)
    assert values.get(code, -math.inf) < there.value


@pytest.mark.parametrize("code", OF_TOUCHES)
def test_what_a_doubt_about_a_touch_advises_helps(code, monkeypatch):
    case = OF_TOUCHES[code]
    assert_helped(code, *(case(monkeypatch) if code == "steps" else case()))


@pytest.mark.long
@pytest.mark.parametrize("code", OF_OBJECTS)
def test_what_a_doubt_about_an_object_advises_helps(code):
    assert_helped(code, *OF_OBJECTS[code]())


def test_each_code_has_a_case():
    assert {*OF_TOUCHES, *OF_OBJECTS} | ELSEWHERE == set(REASONS)
