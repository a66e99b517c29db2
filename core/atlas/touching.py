# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Touches that grow over a whole object by themselves (paper, VI), and the surface of all of them."""

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import LARGEST, Array, finite_array, number, unit_vector
from ..contours.contour import tangent_of, vector_of
from ..contours.finger import Contact, Surface
from ..contours.tracking import generator_of
from ..exploration.extent import Exploration
from ..exploration.options import ExplorationOptions
from ..exploration.touches import exploring_many
from ..reconstruction.result import Reconstruction
from ..steps import part_of, result_of
from ..triangles import far_apart, normalized, row_dot
from .borders import felt_border, snapped_to_border
from .charts import Charts
from .field import covered
from .finger import FACING, Finger, finger_at
from .frontier import AGAIN_APART, Frontier
from .join import Table, refit
from .meshing import Mesh
from .object_atlas import LIMIT, NEAR, Atlas, Check, joined_surface
from .reference_mesh import ReferenceMesh

# python -m benchmarks.atlas judges these.
MOST = 1000  # There are at most this many touches, unless the caller says otherwise.
FIRST_EXTENT = 300.0  # A half curve of the first touch is at most this many tolerances long.
GOOD = 10.0  # The first patch is looked for near the start if its radius is below this many tolerances,
AWAY, EVERY = 30.0, 3  # up to this many tolerances away, at every third place of a disk.
SMALL = 5.0  # Touches do not go on from a patch whose radius is below this many tolerances.
SIDE_BY_SIDE = 8  # This many touches at once are faster, and still done in a tenth of a second.
AGAIN = 5  # Where something is missing or less certain, touches go on at most this often.
CHECKS = 512  # This many rays from outside check the surface.
# This many go to its sharpest vertices, and to the triangles around the sharpest. Without, one of 24 cones is
SHARPEST, SPIKES = 64, 16  # "ok" and off by 5 tolerances; with 128 each, obtuse creases take more touches.
# This many go to its least certain vertices. Without them, and with three rounds AGAIN, 3 of 39 runs on cones
UNSURE = 128  # and chamfered boxes are "ok" and off by up to 4 tolerances.
STRAIGHT = 0.5  # A ray must meet what it is aimed at if the cosine between it and the normal is more.
BORDERS = 2  # This often a mesh is moved to the borders that are felt.
LARGER = 2.0  # A touch reaches at most this many radii of the patch from which it goes on.

PointNormal = tuple[ArrayLike, ArrayLike]  # A point and its normal, (3,) each.


class Progress(NamedTuple):
    """How far the touches of an object are.

    done : number of touches
    uncovered : number of places that are known to be uncovered
    found : the touches since the last Progress
    rims : how far the finger feels each of their patches all round, (AZIMUTHS,), a length
    joining : share of joining the patches to one surface that is done; None while the object is touched
    """

    done: int
    uncovered: int
    found: tuple[Exploration, ...] = ()
    joining: float | None = None
    rims: tuple[Array, ...] = ()


Steps = Generator[Progress, object, Atlas]


def touch_all_over(
    surface: Surface,
    point: ArrayLike,
    outward: ArrayLike,
    *,
    tolerance: float,
    noise: float = 0.0,
    most: int = MOST,
    rng: np.random.Generator | int | None = None,
    earlier: Sequence[Exploration] = (),
) -> Steps:
    """Does what `explore_object` does in steps: yields a Progress after each, and returns the Atlas.

    earlier : touches of the same surface that were found before, from which these go on in place of the
        point, if one of them is as certain as the tolerance; they count as touches

    If it is sent anything false other than None, it stops touching and joins the patches so far. Arguments
    and errors are those of `explore_object`; errors are raised in the first step.
    """
    # Otherwise later steps would import these, which takes longer than a step may.
    from scipy import fft, linalg, ndimage, sparse, spatial  # noqa: F401

    p, up = finite_array("point", point, (3,), LARGEST), unit_vector("outward", outward)
    tolerance, noise = number("tolerance", tolerance, above=0.0), number("noise", noise, least=0.0)
    most, generator = int(number("most", most, least=1.0)), generator_of(rng)
    if tolerance < noise:
        raise ValueError(f"tolerance: expected the noise {noise:g} or more, got {tolerance:g}")
    options = ExplorationOptions(noise=noise, rng=generator, largest_std=tolerance)
    frame = earlier[0].result.frame if earlier else None
    origin, normal = (p, up) if frame is None else (frame.origin, frame.axes[:, 2])
    finger = finger_at(surface, vector_of(origin), vector_of(normal), SMALL * tolerance)
    run = _Run(finger, tolerance, most, options)
    yield from run.taking_up(earlier)
    if not run.found:
        yield from run.show(run.first(p, up))
    yield from _all_over(run)
    return (yield from _joined_and_refined(run))


def _all_over(run: "_Run") -> Generator[Progress, object, None]:
    """Touches until nothing within reach is uncovered."""
    while not run.is_stopped and run.done < run.most:
        chosen = yield from run.showing(run.frontier.next_touches(min(SIDE_BY_SIDE, run.most - run.done)))
        if not chosen or run.is_stopped:
            break
        farthest = LARGER * max(touch.place.radius for touch in chosen)
        contacts = [(touch.point, touch.outward) for touch in chosen]
        new = yield from run.showing(run.touching(contacts, farthest))
        for touch in chosen:
            run.frontier.tried(touch)
        yield from run.show(run.now(new=new))


class _Run:
    """The touches so far, and what all of them have in common."""

    def __init__(self, finger: Finger, tolerance: float, most: int, options: ExplorationOptions) -> None:
        self.surface, self.tolerance, self.most, self.options = finger.surface, tolerance, most, options
        least, rng = np.pi * (SMALL * tolerance) ** 2, generator_of(options.rng)
        self.frontier = Frontier(finger, NEAR * tolerance, least, options.noise, rng)
        self.found: list[Exploration] = []
        self.void: list[Contact] = []  # Where the closed surface is, and the finger met nothing near it.
        self.done, self.is_stopped = 0, False

    def show(self, progress: Progress) -> Generator[Progress, object, None]:
        """Yields a Progress. An answer that is false stops the touches, except None."""
        answer = yield progress
        self.is_stopped |= answer is not None and not answer

    def showing(self, steps: Generator[Any, None, Any]) -> Generator[Progress, object, Any]:
        """Runs steps, and shows how far they are after each: a share of joining, or None."""
        while True:
            try:
                joining = next(steps)
            except StopIteration as end:
                return end.value
            yield from self.show(self.now(joining))

    def first(self, point: Array, up: Array) -> Progress:
        """Makes the touch from which all others go on. Raises ValueError if it and those near it fail.

        Where the point is on a crease or in a corner, a place near it makes a better patch.
        """
        n, options = vector_of(up), replace(self.options, farthest=FIRST_EXTENT * self.tolerance)
        disk = self.frontier.finger.disk(vector_of(point), n, tangent_of(n, None), AWAY * self.tolerance)
        results: list[Exploration | ValueError] = []
        for contacts in (disk[:1], disk[1::EVERY]):
            points, outward = contacts.transpose(1, 0, 2)
            results += result_of(exploring_many(self.surface, points, outward, options))
            felt = [e for e in results if isinstance(e, Exploration)]
            if felt and felt[0].result.radius >= GOOD * self.tolerance:
                break
        if not felt:
            raise next(e for e in results if isinstance(e, ValueError))
        first = max(felt, key=lambda e: e.result.radius)
        if not self.frontier.add(first.result):
            raise ValueError("point: expected a surface within three tolerances of the first patch, got none")
        self.found, self.done = [first], self.done + 1
        return self.now(new=[first])

    def taking_up(self, earlier: Sequence[Exploration]) -> Generator[Progress, object, None]:
        """Takes in touches that were found before, unless they are less certain than the tolerance."""
        self.done = len(earlier)
        for e in earlier:
            is_sure = e.result.mean_height_std <= self.tolerance
            if is_sure and self.frontier.add(e.result, SMALL * self.tolerance):
                self.found.append(e)
                yield from self.show(self.now(new=[e]))

    def now(self, joining: float | None = None, new: Sequence[Exploration] = ()) -> Progress:
        """The Progress so far, with the new touches."""
        rims = (self.frontier.charts.rims * self.frontier.charts.radii[:, None])[-len(new) :] if new else ()
        return Progress(self.done, len(self.frontier.queue), tuple(new), joining, tuple(rims))

    def touching(
        self, places: Sequence[PointNormal], farthest: float
    ) -> Generator[None, None, list[Exploration]]:
        """Touches at places; returns those that succeed, and adds their rims to the frontier.

        farthest : the greatest length of a half curve. Failures are counted as done, too
        """
        points, outward = (np.array(values) for values in zip(*places, strict=True))
        results = yield from exploring_many(
            self.surface, points, outward, replace(self.options, farthest=farthest)
        )
        new = []
        for e, point, up in zip(results, points, outward, strict=True):
            # At an edge a fit may end up on the other side.
            if (
                isinstance(e, Exploration)
                and e.result.frame.axes[:, 2] @ up >= FACING
                and self.frontier.add(e.result, SMALL * self.tolerance)
            ):
                new.append(e)
                yield
            else:
                self.frontier.failed_points.append(vector_of(point))
        self.found += new
        self.done += len(places)
        return new

    def joining(self, earlier: dict[int, tuple[int, Table]]) -> Generator[float, None, Charts]:
        """The joined patches; yields the share that is done."""
        contours = [[*e.contours, taps] for e, taps in zip(self.found, self.frontier.taps, strict=True)]
        results = [e.result for e in self.found]
        yield 0.0
        return (yield from refit(contours, results, self.frontier.charts, self.options.noise, earlier))

    def going_on(self, places: Sequence[PointNormal], farthest: float) -> Generator[Progress, object, None]:
        """Touches at places, and all over from there.

        Of places that are near each other only the first is touched, unless its patch leaves others out.

        farthest : the greatest length of a half curve
        """
        points, normals = (np.array(values) for values in zip(*places, strict=True))
        left, old = np.arange(len(points)), len(self.found)
        while len(left) and self.done < self.most and not self.is_stopped:
            few = left[far_apart(points[left], AGAIN_APART * farthest)]
            few = few[: min(SIDE_BY_SIDE, self.most - self.done)]
            some = list(zip(points[few], normals[few], strict=True))
            new = yield from self.showing(self.touching(some, farthest))
            left = np.setdiff1d(left, few)
            left = left[~covered(self.frontier.charts, points[left], normals[left], AGAIN_APART, first=old)]
            yield from self.show(self.now(new=new))
        yield from _all_over(self)

    def check(self, reference: ReferenceMesh) -> Generator[float, None, Check]:
        """Contacts of a finger that comes from outside all round, and places of the mesh that it misses."""
        starts, aims, ups, length = rays_at(reference, self.void)
        yield 1.0
        finger, ways = self.frontier.finger, normalized(aims - starts)
        met = [finger.met(vector_of(p), vector_of(way), length) for p, way in zip(starts, ways, strict=True)]
        contacts = np.array([contact for contact in met if contact is not None]).reshape(-1, 2, 3)
        has_met = np.array([contact is not None for contact in met])
        missed = []
        for i in np.flatnonzero(~has_met[: len(ups)] & ups.any(axis=1)):
            aim, up = vector_of(aims[i]), vector_of(ups[i])
            # Near a rim or a crease, or where a ray slips between two faces of a mesh, something is near.
            if len(finger.disk(aim, up, tangent_of(up, None), self.frontier.near)) == 1:
                missed.append(i)
        return Check(contacts[:, 0], contacts[:, 1], aims[missed], int(has_met[:CHECKS].sum()))

    def atlas(
        self, earlier: dict[int, tuple[int, Table]]
    ) -> Generator[float, None, tuple[Atlas, list[PointNormal]]]:
        """The atlas of what was found so far, and contacts where something is missing or less certain.

        These are where the joined surface ends though the object goes on, where a finger from outside meets
        something else, and where the surface is less certain than the tolerance.
        """
        charts = yield from part_of(self.joining(earlier), 0.0, 0.5)
        patches, self.void = tuple(e.result for e in self.found), []
        reference = yield from part_of(joined_surface(patches, charts, self.tolerance, self.felt), 0.5, 1.0)
        yield 1.0
        assert reference.unfelt is not None
        unfelt = yield from self.frontier.unfelt(reference.unfelt)
        for _ in range(BORDERS):
            steps = felt_border(self.frontier.finger, self.frontier.near, reference.mesh)
            border = yield from part_of(steps, 1.0, 1.0)
            # The finger has looked for what goes on unfelt.
            reference = replace(reference, mesh=snapped_to_border(reference.mesh, border), unfelt=None)
        yield from reference.prepared()
        check = yield from self.check(reference)
        yield 1.0
        uncovered = unfelt + (yield from self.frontier.uncovered(reference))
        places, taps = tuple(place for place, _ in uncovered), tuple(self.frontier.taps)
        atlas = Atlas(
            patches, charts, reference, self.tolerance, places, check, taps, border, self.done >= self.most
        )
        improvable = atlas.improvable
        yield 1.0
        atlas = atlas.widened()
        yield 1.0
        contacts: list[PointNormal] = [contact for _, contact in uncovered]
        contacts += zip(check.points[improvable], check.normals[improvable], strict=True)
        return atlas, contacts + (self.uncertain_contacts(atlas.reference.mesh) if atlas.is_rough else [])

    def felt(self, points: Array, normals: Array) -> Array:
        """How far the object is off places (n, 3) of the closed surface along their normals (n, 3), (n,).

        It is inf where nothing is within the tolerance, and these places are added to `void`. Where something
        is, the closed surface is as near as a touch would have it.
        """
        places = [(vector_of(p), vector_of(n)) for p, n in zip(points, normals, strict=True)]
        contacts = [self.frontier.finger.near(*place, self.tolerance, FACING) for place in places]
        self.void += [place for place, contact in zip(places, contacts, strict=True) if contact is None]
        pairs = zip(places, contacts, strict=True)
        return np.array(
            [math.inf if contact is None else math.dist(p, contact[0]) for (p, _), contact in pairs]
        )

    def uncertain_contacts(self, mesh: Mesh) -> list[Contact]:
        """Contacts where the surface is less certain than LIMIT tolerances, apart from each other.

        Without touches there, the standard model fandisk ends in doubt.
        """
        rough, normals = np.flatnonzero(mesh.std > LIMIT * self.tolerance), mesh.normals
        rough = rough[np.argsort(-mesh.std[rough], kind="stable")]
        apart = AGAIN_APART * self.frontier.charts.radii[mesh.patch[rough]]
        places = rough[far_apart(mesh.vertices[rough], apart)]
        return self.frontier.felt_near(mesh.vertices[places], normals[places])


def rays_at(reference: ReferenceMesh, void: Sequence[Contact] = ()) -> tuple[Array, Array, Array, float]:
    """Rays that check a mesh from outside all round: their starts, and places that they go to, (k, 3).

    Also the normals (CHECKS / 2, 3) at those of the first that must meet something there, see STRAIGHT, and 0
    at others; and the length of all, which ends beyond the mesh. The first CHECKS are random: half go to the
    middles of triangles, the others to any place near the mesh. More come straight down, as at a slant they
    would end at the wall of a slot near its rim: to the SHARPEST vertices, whose triangles have the least sum
    of angles there, to the UNSURE ones of the largest deviation, to triangles around SPIKES of the sharpest,
    and to as many of the places `void`, where a finger met nothing near: there a slot may be bridged.
    """
    rng, mesh = np.random.default_rng(0), reference.mesh
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    middle, far = 0.5 * (low + high), float(np.linalg.norm(high - low))
    away = rng.normal(size=(CHECKS, 3))
    away *= far / np.linalg.norm(away, axis=1, keepdims=True)
    aims = middle + 0.5 * far * rng.uniform(-1.0, 1.0, (CHECKS, 3))
    aimed = rng.integers(len(mesh.triangles), size=CHECKS // 2)
    centers = mesh.vertices[mesh.triangles].mean(axis=1)
    aims[: CHECKS // 2] = centers[aimed]
    ways = (aims - middle - away)[: CHECKS // 2]
    # The triangle's own normal counts: that of a vertex on a crease is between those of its sheets.
    ahead = row_dot(reference.normals[aimed], ways)
    facing = ahead < -STRAIGHT * np.linalg.norm(ways, axis=1)
    ups = np.where(facing[:, None], reference.normals[aimed], 0.0)
    sharpest = np.argsort(np.where(reference.is_open, np.inf, reference.angles), kind="stable")[:SHARPEST]
    unsure = np.argsort(np.where(reference.is_open, 0.0, -mesh.std), kind="stable")[:UNSURE]
    some = np.append(sharpest, unsure)
    around = np.unique(reference.fans[sharpest[:SPIKES]])
    around = around[np.linalg.norm(reference.normals[around], axis=1) > STRAIGHT]  # The others have no area.
    bridged = np.array(void).reshape(-1, 2, 3)[rng.permutation(len(void))[:UNSURE]]
    straight = np.vstack([mesh.vertices[some], centers[around], bridged[:, 0]])
    up = far * np.vstack([mesh.normals[some], reference.normals[around], bridged[:, 1]])
    return np.vstack([middle + away, straight + up]), np.vstack([aims, straight]), ups, 3.0 * far


def _joined_and_refined(run: _Run) -> Steps:
    """The atlas of what was found, after more touches where something is missing or less certain."""
    earlier: dict[int, tuple[int, Table]] = {}
    for again in range(AGAIN, -1, -1):
        atlas, contacts = yield from run.showing(run.atlas(earlier))
        before = len(run.found)
        if not again or run.is_stopped or not contacts:
            break
        yield from run.going_on(contacts, float(atlas.charts.radii.max()))
        if len(run.found) == before:
            break
    return replace(atlas, is_cut_short=True) if run.is_stopped else atlas


def explore_object(
    surface: Surface,
    point: ArrayLike,
    outward: ArrayLike,
    *,
    tolerance: float,
    noise: float = 0.0,
    most: int = MOST,
    rng: np.random.Generator | int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Atlas:
    """Touches a whole object (paper, VI), from one reference point on, and joins the patches to one surface.

    point, outward : (3,), where to begin, and the outward direction there
    tolerance : a length; touches go on until the mean deviation of each patch's height is below it, if
        possible
    noise, rng : as in `explore`
    most : the largest number of touches
    progress : called with the numbers of touches and of uncovered places; what it returns stops
        the touches if it is false, as False and 0 are, except None

    The surface only has to answer rays. Raises ValueError for bad arguments, for a tolerance below the noise,
    and if the first touch fails. Where a later touch fails, the Atlas has an uncovered place.
    """
    steps = touch_all_over(surface, point, outward, tolerance=tolerance, noise=noise, most=most, rng=rng)
    try:
        state, shown = next(steps), 0
        while True:
            more = None
            if progress and state.joining is None and state.done > shown:
                more, shown = progress(state.done, state.uncovered), state.done
            state = steps.send(more)
    except StopIteration as end:
        return end.value


def covered_by(r: Reconstruction, rim: Array, points: Array, tolerance: float) -> NDArray[np.bool_]:
    """Which points (n, 3) of the world are inside the rim of a patch, and as near to it as a finger feels it.

    rim : how far the patch reaches from its point all round, (k,), lengths, from azimuth 0 on
    """
    x, y, z = r.frame.to_local(points).T
    azimuths = np.linspace(0.0, 2.0 * np.pi, len(rim), endpoint=False)
    is_covered: NDArray[np.bool_] = np.hypot(x, y) < np.interp(
        np.arctan2(y, x), azimuths, rim, period=2.0 * np.pi
    )
    is_covered[is_covered] = np.abs(z[is_covered] - r.height(x[is_covered], y[is_covered])) < NEAR * tolerance
    return is_covered
