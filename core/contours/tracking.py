# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contour tracking in a sampling plane (paper, sections III-C and V), on anything that can answer a ray."""

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import LARGEST, Array, finite_array, list_of, number, shown, unit_vector
from .contour import EXTENT, Contour, SamplingPlane, Vector, dot, tangent_of, vector_of
from .finger import LEAST_IN_PLANE, Surface, checked, contacts, first_contact, section

MOST_IN_HALF = 10_000  # Half a contour has at most this many contacts.


def track(
    surface: Surface,
    point: ArrayLike,
    outward: ArrayLike,
    planes: Sequence[SamplingPlane],
    *,
    extent: float,
    step: float,
    noise: float = 0.0,
    rng: np.random.Generator | int | None = None,
    tangent: ArrayLike | None = None,
) -> list[Contour]:
    """Slides a finger over `surface` both ways from `point`, once in each plane (paper, III-C and V).

    point, outward : (3,), the reference point and the outward normal; a sheet can be touched from either side
    planes : azimuths are measured from `tangent`, see SamplingPlane.axes
    extent, step : lengths of each half curve, as a sum of chords, and of a chord between contacts
    noise : standard deviation of the sensor, in the plane and along the curve's normal; drawn from `rng`

    Returns one Contour for each plane, from azimuth + 180 degrees to azimuth, which contains the exact point.
    Raises ValueError for bad numbers, and if there is no surface at the point.
    """
    step, extent = number("step", step, above=0.0), number("extent", extent, above=0.0)
    _half_count(extent, step)
    return tracker(surface, point, outward, planes, step=step, noise=noise, rng=rng, tangent=tangent)(extent)


def tracker(
    surface: Surface,
    point: ArrayLike,
    outward: ArrayLike,
    planes: Sequence[SamplingPlane],
    *,
    step: float,
    noise: float = 0.0,
    rng: np.random.Generator | int | None = None,
    tangent: ArrayLike | None = None,
    least_cosine: float = -1.0,
) -> Callable[[float], list[Contour]]:
    """`track` as a function of the extent, which continues the contours that it has.

    least_cosine : a contour ends where the normals of two contacts turn by more than this cosine's angle
    """
    p = finite_array("point", point, (3,), LARGEST)
    n = vector_of(unit_vector("outward", outward))
    planes = list_of("planes", planes, SamplingPlane)
    noise, generator = number("noise", noise, least=0.0), generator_of(rng)
    e1 = tangent_of(n, tangent)
    start, up, side = first_contact(checked(surface), vector_of(p), n, e1, step)
    first, curves = Contour(p[None], None, np.array([up]), noise), []
    for plane in planes:
        t, u, across = plane.axes_of_unit_vectors(n, e1)
        cast, up_in_plane = section(surface, start, t, u, side), complex(dot(up, t), dot(up, u))
        # The curve's normal, turned clockwise by a quarter, is its tangent.
        halves = [_Half(contacts(cast, up_in_plane, turn, n, step, least_cosine)) for turn in (1j, -1j)]
        curves.append(_Curve(first.with_valid(plane_normal=np.array(across)), across, halves))

    def contours(extent: float) -> list[Contour]:
        """The contours to this extent, a length. Raises ValueError if it is not a length of several steps."""
        count = _half_count(extent, step)
        return [_extended(curve, count, generator) for curve in curves]

    return contours


def _half_count(extent: float, step: float) -> int:
    """The number of contacts of half a contour."""
    if extent < step:
        raise ValueError(f"step: expected no more than the extent {extent:g}, got {step:g}")
    if extent / step > MOST_IN_HALF:
        raise ValueError(f"step: expected at least a {MOST_IN_HALF}th of the extent {extent:g}, got {step:g}")
    return math.floor(extent / step * (1.0 + 1e-6))  # Both may have been float32.


@dataclass(eq=False)
class _Half:
    """One side of a contour: contacts with normals, the number that was felt, and why there are no more."""

    contacts: Generator[tuple[Vector, Vector], None, str]
    count: int = 0
    stop: str = EXTENT


@dataclass(eq=False)
class _Curve:
    """The part of a contour that was followed, the normal of its plane, and what goes on from its ends."""

    contour: Contour
    across: Vector
    halves: list[_Half]


def _extended(curve: _Curve, count: int, generator: np.random.Generator) -> Contour:
    """The contour of up to `count` contacts on either side; contacts keep the noise that they have."""
    back, ahead = (_next_contacts(half, count) for half in curve.halves)
    if back or ahead:
        of, behind = curve.contour, len(back)
        points, normals = np.array([*back[::-1], *ahead]).transpose(1, 0, 2)
        if of.noise:
            # The point has none.
            offsets = np.delete(generator.normal(0.0, of.noise, len(points) + 1), behind)
            points = points + offsets[:, None] * _curve_normals(normals, curve.across)
        curve.contour = of.with_valid(
            points=np.concatenate([points[:behind], of.points, points[behind:]]),
            normals=np.concatenate([normals[:behind], of.normals, normals[behind:]]),
        )
    at, (before, after) = curve.halves[0].count, (min(half.count, count) for half in curve.halves)
    stops = [EXTENT if half.count > count else half.stop for half in curve.halves]
    return curve.contour.part(slice(at - before, at + after + 1), (stops[0], stops[1]))


def _next_contacts(half: _Half, count: int) -> list[tuple[Vector, Vector]]:
    """The contacts, with normals, by which a half contour now grows to `count`, or fewer where it ends."""
    felt: list[tuple[Vector, Vector]] = []
    while half.stop == EXTENT and half.count < count:
        try:
            felt.append(next(half.contacts))
            half.count += 1
        except StopIteration as end:
            half.stop = end.value
    return felt


def generator_of(rng: np.random.Generator | int | None) -> np.random.Generator:
    """The generator for a seed, or the given one. Raises ValueError if `rng` is neither."""
    try:
        return np.random.default_rng(rng)
    except (TypeError, ValueError):
        raise ValueError(
            f"rng: expected a Generator or a whole number of 0 or more, got {shown(rng)}"
        ) from None


def _curve_normals(normals: Array, across: Vector) -> Array:
    """The curve's unit normals from those of the surface; shorter if these hardly lie in the plane."""
    in_plane = normals - np.outer(normals @ across, across)
    return in_plane / np.maximum(np.linalg.norm(in_plane, axis=1, keepdims=True), LEAST_IN_PLANE)
