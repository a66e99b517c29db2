# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The domain D of a patch: inside a closed cubic spline through the projected curve ends (paper, IV-A).

Where the surface itself ends, the spline would bulge beyond the surface. So it is straight next to such ends.
"""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import Array
from ..lapack import solved_square

GRID = 600  # The grid (8) over a domain has about this number of points.
BOUNDARY_SAMPLES = 1024  # With this number of samples the radius of the boundary is right to 1e-5.
TURN_SAMPLES = 32  # This number of places on each piece shows whether the boundary turns back.
HULL_PLACES = 32  # This number of places on the hull of contacts bounds a domain.
INSIDE_HULL = 0.05  # The origin is inside such a hull by at least this share of the radius.
QUARTER_TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])  # It turns rows counterclockwise.
# Ends this near to each other, as a share of the radius, count once; near the origin, not at all.
SAME_END = 1e-3
# Ends of two or three curves are at most 90 degrees apart: if these are more, one between was at the origin.
MAX_END_GAP = np.radians(100.0)
MIN_LENGTH_SHARE = 1e-6  # No length is divided by less than this share of the farthest end's distance.
AT_POINT = 0.01  # Where the surface ends at the origin, the domain ends this share of the radius away.
GAUSS_ALONG, GAUSS_ACROSS = 4, 3  # Gauss-Legendre nodes along each piece of the boundary, and outward.


@dataclass(frozen=True, eq=False)
class Domain:
    """The part of the tangent plane over which a patch is valid (paper, IV-A); star-shaped about the origin.

    ends : (m, 2), m >= 3, the projected ends of the contours, sorted by azimuth
    open_ends : (m,), whether the surface ends at them, by a crease or its border; None if it ends at none
    """

    ends: Array
    open_ends: NDArray[np.bool_] | None = None

    def scaled(self, factor: float) -> "Domain":
        """The domain with every length multiplied by `factor`."""
        return Domain(factor * self.ends, self.open_ends)

    @cached_property
    def _spline(self) -> tuple[Array, Array]:
        """The chord lengths h (m,), and the closed C2 cubic spline over them by powers, (4, m, 2).

        The slopes s at the ends solve the cyclic system h_i s_(i-1) + 2 (h_(i-1) + h_i) s_i + h_(i-1) s_(i+1)
        = 3 (h_i d_(i-1) + h_(i-1) d_i) with the slopes d of the chords (de Boor, A Practical Guide to
        Splines, IV). Next to straight pieces, which are chords, the spline begins across the ray to the end,
        as a circle would.
        """
        rows = np.arange(len(self.ends))
        last, following = rows - 1, rows + 1 - len(rows)  # The rows before and after, in a circle.
        chords = self.ends[following] - self.ends
        lengths = np.sqrt(np.einsum("mi,mi->m", chords, chords))
        over, before = lengths[:, None], lengths[last]
        rise = chords / over
        system = np.zeros((len(rows), len(rows)))
        system[rows, rows] = 2.0 * (lengths + before)
        system[rows, last], system[rows, following] = lengths, before
        right = 3.0 * (over * rise[last] + before[:, None] * rise)
        straight = np.zeros(len(rows), dtype=bool)
        if self.open_ends is not None:
            straight = self.open_ends | self.open_ends[following]  # pieces, each from its end to the next
            adjacent = straight | straight[last]
            system[adjacent] = np.eye(len(rows))[adjacent]
            right[adjacent] = self.ends[adjacent] @ QUARTER_TURN
            right[adjacent] /= np.linalg.norm(self.ends[adjacent], axis=1, keepdims=True)
        slopes = solved_square(system, right)
        bend = (slopes + slopes[following] - 2.0 * rise) / over
        pieces = np.array([self.ends, slopes, (rise - slopes) / over - bend, bend / over])
        pieces[1, straight], pieces[2:, straight] = rise[straight], 0.0
        return lengths, pieces

    @cached_property
    def _polar(self) -> tuple[Array, Array]:
        """Ascending azimuths and the radii of the boundary there."""
        if self._turns_back:
            azimuths, radii = self._monotone_boundary()
        else:  # Equal numbers keep the ends' symmetry.
            x, y = self._along_spline(math.ceil(BOUNDARY_SAMPLES / len(self.ends))).T
            azimuths, radii = np.arctan2(y, x), np.hypot(x, y)
        order = np.argsort(azimuths)
        return azimuths[order], radii[order]

    def _along_spline(self, count: int) -> Array:
        """`count` places on each piece of the closed spline, (m count, 2)."""
        chords, (start, slope, bend, third) = self._spline
        t = (chords[:, None] / count * np.arange(count))[..., None]
        start, slope, bend, third = (part[:, None] for part in (start, slope, bend, third))
        return (start + t * (slope + t * (bend + t * third))).reshape(-1, 2)

    @cached_property
    def _turns_back(self) -> bool:
        """Whether the closed spline is not star-shaped."""
        x, y = self._along_spline(TURN_SAMPLES).T
        before = np.arange(-1, len(x) - 1)
        return bool((x[before] * y <= y[before] * x).any())

    def _monotone_boundary(self) -> tuple[Array, Array]:
        """Azimuths and radii (BOUNDARY_SAMPLES,) of a periodic monotone cubic r(azimuth) through the ends.

        It takes the place of the closed spline where that is not star-shaped, as next to an end that is much
        nearer than others (scipy's PchipInterpolator). `open_ends` do not count.
        """
        from scipy.interpolate import PchipInterpolator

        # Of two ends in one direction the farther one counts.
        turns, place = np.unique(
            np.round(np.arctan2(self.ends[:, 1], self.ends[:, 0]) / (2.0 * np.pi), 9) % 1.0,
            return_inverse=True,
        )
        reach = np.zeros(len(turns))
        np.maximum.at(reach, place, np.hypot(*self.ends.T))
        at = np.concatenate([turns + whole for whole in (-2.0, -1.0, 0.0, 1.0)])
        azimuths = np.arange(BOUNDARY_SAMPLES, dtype=np.float64) / BOUNDARY_SAMPLES - 0.5
        radii: Array = PchipInterpolator(at, np.tile(reach, 4))(azimuths)
        return 2.0 * np.pi * azimuths, radii

    @property
    def corners(self) -> Array:
        """The ends (k, 2) at which the boundary has a corner: those next to straight pieces."""
        if self.open_ends is None or self._turns_back:
            return np.empty((0, 2))
        straight = self.open_ends | np.roll(self.open_ends, -1)  # pieces, each from its end to the next
        return self.ends[straight | np.roll(straight, 1)]

    @cached_property
    def nodes(self) -> tuple[Array, Array]:
        """Gauss points (n, 2) and weights (n,) of sum 1 for the mean of a function over the domain, n = 12 m.

        They lie on curves parallel to the boundary.
        """
        piece, share, along, out, outward = _gauss(len(self.ends))
        lengths, pieces = self._spline
        chords, (start, slope, bend, third) = lengths[piece, None], pieces[:, piece]
        t = share[:, None] * chords
        points = start + t * (slope + t * (bend + t * third))
        ahead = chords * (slope + t * (2.0 * bend + 3.0 * t * third))
        weights = along * np.abs(points[:, 0] * ahead[:, 1] - points[:, 1] * ahead[:, 0])
        if self._turns_back:
            turns = 2.0 * np.pi * (np.arange(len(piece)) + 0.5) / len(piece)
            points = self.points_at(np.array([np.cos(turns), np.sin(turns)]).T)
            weights = np.einsum("ni,ni->n", points, points)
        return (out * points).reshape(-1, 2), np.ravel(outward * weights) / weights.sum()

    @property
    def node_places(self) -> Array:
        """The radii (n,) of the nodes divided by that of the boundary at their azimuths, between 0 and 1."""
        piece, _, _, out, _ = _gauss(len(self.ends))
        return np.repeat(out.ravel(), len(piece))

    def _radius(self, azimuth: Array) -> Array:
        """The radius of the boundary's polygon at azimuths (...): a b sin w / (a sin u + b sin(w - u)).

        a and b are the radii of the samples before and after, w the angle between them, and u that from the
        first.
        """
        azimuths, radii = self._polar
        turns, turn = azimuths - azimuths[0], (azimuth - azimuths[0]) % (2.0 * np.pi)
        before = np.searchsorted(turns, turn, side="right") - 1
        after, gone = (before + 1) % len(turns), turn - turns[before]
        width = np.maximum((turns[after] - turns[before]) % (2.0 * np.pi), 1e-12)
        a, b = radii[before], radii[after]
        return a * b * np.sin(width) / (a * np.sin(gone) + b * np.sin(width - gone))

    def contains(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.bool_]:
        """Whether each (x, y) lies inside or on the boundary; booleans of the shape of x and y."""
        return np.hypot(x, y) <= self._radius(np.arctan2(y, x)) * (1.0 + 1e-5)

    def places(self, points: Array) -> Array:
        """Points (n, 2) as places (n, 2) on the unit disk: divided by the radius at their azimuths."""
        return points / self._radius(np.arctan2(points[:, 1], points[:, 0]))[:, None]

    def points_at(self, places: Array) -> Array:
        """The points (n, 2) that have these `places`."""
        return places * self._radius(np.arctan2(places[:, 1], places[:, 0]))[:, None]

    def radii(self, count: int) -> Array:
        """Radii (count,) of the boundary, at azimuths from 0 on, but nowhere beyond what is between the ends.

        Between ends at very different distances the spline swings out to where nothing was felt, and between
        ends more than MAX_END_GAP apart there is only what is inside the line from one to the other.
        """
        turns, whole = 2.0 * np.pi * np.arange(count) / count, 2.0 * np.pi
        at, out = np.arctan2(self.ends[:, 1], self.ends[:, 0]) % whole, np.hypot(*self.ends.T)
        order = np.argsort(at)
        at, out = (np.pad(values[order], 1, mode="wrap") for values in (at, out))
        at[0], at[-1] = at[0] - whole, at[-1] + whole
        i = np.searchsorted(at, turns, side="right")
        before, after, last, following = turns - at[i - 1], at[i] - turns, out[i - 1], out[i]
        across = np.maximum(last * np.sin(before) + following * np.sin(after), MIN_LENGTH_SHARE * out.max())
        line = np.maximum(last * following * np.sin(before + after) / across, AT_POINT * out.max())
        line = np.where(before + after > MAX_END_GAP, line, np.inf)
        return np.minimum(np.minimum(self._radius(turns), np.interp(turns, at, out)), line)

    def boundary(self, n: int) -> Array:
        """n points on the boundary, (n, 2), counterclockwise from azimuth 0 in equal turns."""
        azimuths = 2.0 * np.pi * np.arange(n) / n
        return self.points_at(np.column_stack([np.cos(azimuths), np.sin(azimuths)]))

    @cached_property
    def area(self) -> float:
        """The area inside, in length^2."""
        azimuth, r = self._polar
        turn = np.diff(azimuth, append=azimuth[0] + 2.0 * np.pi)
        return float(np.sum(r * np.roll(r, -1) * np.sin(turn)) / 2.0)

    def grid(self, count: int) -> tuple[Array, float]:
        """The grid of (8): about `count` points (m, 2) inside with a uniform spacing h, and h."""
        h = float(np.sqrt(self.area / count))
        reach = self.boundary(BOUNDARY_SAMPLES)
        low, high = np.floor(reach.min(axis=0) / h), np.ceil(reach.max(axis=0) / h)
        axes = (h * (np.arange(a, b) + 0.5) for a, b in zip(low, high, strict=True))
        x, y = (axis.ravel() for axis in np.meshgrid(*axes))
        inside = self.contains(x, y)
        return np.column_stack([x[inside], y[inside]]), h


@lru_cache(maxsize=16)
def _gauss(ends: int) -> tuple[NDArray[np.intp], Array, Array, Array, Array]:
    """The rule of Domain.nodes: pieces, places and weights of the rays; places and weights along a ray."""
    along, along_weights = np.polynomial.legendre.leggauss(GAUSS_ALONG)  # type: ignore[no-untyped-call]
    # The nodes are in r^2.
    square, outward = np.polynomial.legendre.leggauss(GAUSS_ACROSS)  # type: ignore[no-untyped-call]
    return (
        np.repeat(np.arange(ends), GAUSS_ALONG),
        np.tile(0.5 * (along + 1.0), ends),
        np.tile(along_weights, ends),
        np.sqrt(0.5 * (square + 1.0))[:, None, None],
        0.5 * outward[:, None],
    )


def closed_spline_domain(ends: ArrayLike, radius: float, open_ends: ArrayLike | None = None) -> Domain:
    """The domain through projected curve ends (m, 2), in any order; `open_ends` as in Domain.

    Ends within SAME_END of the origin, as of a curve that goes to one side only, or of another end do not
    count. Raises ValueError if fewer than three are left.
    """
    x, y = np.asarray(ends, dtype=float).T
    is_open = np.zeros(len(x), dtype=bool) if open_ends is None else np.asarray(open_ends, dtype=bool)
    out = np.flatnonzero(x * x + y * y > (SAME_END * radius) ** 2)
    order = out[np.argsort(np.arctan2(y[out], x[out]), kind="stable")]
    x, y, is_open = x[order], y[order], is_open[order]
    before = np.arange(-1, len(x) - 1)
    apart = (x - x[before]) ** 2 + (y - y[before]) ** 2 > (SAME_END * radius) ** 2
    count = np.count_nonzero(apart)
    if count < 3:
        raise ValueError(f"ends: expected three or more apart from each other, got {count}")
    return Domain(np.array([x[apart], y[apart]]).T, is_open[apart] if is_open.any() else None)


def hull_domain(points: ArrayLike, radius: float) -> Domain:
    """The domain through places on the hull of points (n, 2), which are not in a line.

    Raises ValueError unless the origin is inside by INSIDE_HULL of the radius.
    """
    from scipy.spatial import ConvexHull

    # Outward normals of the sides, and minus their distances from the origin.
    hull = ConvexHull(np.asarray(points, dtype=float)).equations
    turns = 2.0 * np.pi * np.arange(HULL_PLACES) / HULL_PLACES
    rays = np.array([np.cos(turns), np.sin(turns)])
    ahead = hull[:, :2] @ rays
    if hull[:, 2].max() > -INSIDE_HULL * radius:
        raise ValueError("points: expected the origin among them, got it outside them or at their rim")
    reach = 1.0 / (ahead / -hull[:, 2:]).max(axis=0)
    return closed_spline_domain((reach * rays).T, radius)
