# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Exact surfaces to touch, with their curvatures known in closed form; lengths read as millimeters."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import core


def planes(azimuths, tilts=0.0):
    """Sampling planes at these degrees."""
    pairs = np.broadcast(np.radians(azimuths), np.radians(tilts))
    return [core.SamplingPlane(azimuth, tilt) for azimuth, tilt in pairs]


SHARES = np.linspace(0.0, 1.0, 41)
UPRIGHT, TILTED = planes((13, 73, 133)), planes((13, 73, 133), (12, -18, 8))


@dataclass(frozen=True, eq=False)
class Exact:
    """A level set F = 0, F > 0 outside, that answers rays, with a point on it where the curvatures are known.

    level : maps x, y, z (arrays or floats) to F
    gradient : maps a point (3,) to grad F (3,)
    point, k1, k2 : a reference point, and the principal curvatures there
    """

    level: Callable
    gradient: Callable
    point: np.ndarray
    k1: float
    k2: float

    @property
    def normal(self):
        g = self.gradient(self.point)
        return g / np.linalg.norm(g)

    def track(self, planes, **options):
        """Contours through its point, 12 to either side in steps of 1 unless `options` differ."""
        lengths = {"extent": 12.0, "step": 1.0}
        return core.track(self, self.point, self.normal, planes, **lengths | options)

    def fit(self, contours, **options):
        """The reconstruction of contours through its point."""
        return core.reconstruct(self.point, contours, outward=self.normal, **options)

    def ray_cast(self, origin, direction, distance):
        """The first crossing along the ray, bracketed in one of 40 parts; then regula falsi (Illinois)."""
        (x, y, z), (u, v, w) = map(float, origin), map(float, direction)
        t = float(distance) * SHARES
        f = self.level(x + u * t, y + v * t, z + w * t)
        crosses = f[:-1] * f[1:] <= 0.0
        first = int(crosses.argmax())
        if not crosses[first]:
            return None
        (a, b), (fa, fb) = t[first : first + 2].tolist(), f[first : first + 2].tolist()
        for _ in range(60):
            if fa == fb or abs(b - a) < 1e-15 * distance:
                break
            c = b - fb * (b - a) / (fb - fa)
            fc = float(self.level(x + u * c, y + v * c, z + w * c))
            if fc * fb < 0:
                a, fa = b, fb
            else:
                fa *= 0.5
            b, fb = c, fc
            if fc == 0:
                break
        hit = np.array([x + u * b, y + v * b, z + w * b])
        g = self.gradient(hit)
        return hit, g / math.sqrt(g @ g)

    def crossings(self, starts, direction, distance):
        """The first crossings along parallel rays (m, 3), bisected; NaN where there is none."""

        def level(gone):
            return self.level(*(starts.T[..., None] + np.multiply.outer(direction, gone)))

        f, rows = level(distance * SHARES[None]), np.arange(len(starts))
        crosses = f[:, :-1] * f[:, 1:] <= 0.0
        first = crosses.argmax(axis=1)
        before, gone = f[rows, first, None], distance * SHARES[first, None]
        for half in 0.5 ** np.arange(1, 51) * distance * SHARES[1]:
            gone = np.where(level(gone + half) * before > 0.0, gone + half, gone)
        return np.where(crosses[rows, first, None], starts + gone * direction, np.nan)


def plane():
    return Exact(lambda x, y, z: z, lambda p: np.array([0.0, 0.0, 1.0]), np.zeros(3), 0.0, 0.0)


def ellipsoid(a, b, c, u=0.0, v=0.0):
    """An ellipsoid of semi-axes a, b, c, touched at longitude u, latitude v; K and H are the textbook's."""
    axes2 = np.array([a, b, c]) ** 2
    p = np.array([a * np.cos(u) * np.cos(v), b * np.sin(u) * np.cos(v), c * np.sin(v)])
    s = np.sum((p / axes2) ** 2)
    gaussian = 1.0 / (np.prod(axes2) * s**2)
    mean = (p @ p - axes2.sum()) / (2.0 * np.prod(axes2) * s**1.5)
    half = np.sqrt(max(mean**2 - gaussian, 0.0))
    return Exact(
        lambda x, y, z: x**2 / a**2 + y**2 / b**2 + z**2 / c**2 - 1.0,
        lambda q: 2.0 * q / axes2,
        p,
        mean - half,
        mean + half,
    )


def sphere(r):
    return ellipsoid(r, r, r, 0.7, 0.4)


def cylinder(r):
    return Exact(
        lambda x, y, z: x**2 + y**2 - r**2,
        lambda p: np.array([2.0 * p[0], 2.0 * p[1], 0.0]),
        np.array([r * np.cos(0.5), r * np.sin(0.5), 3.0]),
        -1.0 / r,
        0.0,
    )


def torus(big, small, angle, outside=1.0):
    """A torus around z, touched at `angle` of its tube, inside at pi. With outside=-1 its hole is solid."""
    rho = big + small * np.cos(angle)
    kappas = sorted([-outside / small, -outside * np.cos(angle) / rho])

    def gradient(p):
        ring = np.hypot(p[0], p[1])
        away = 2.0 * (ring - big) / ring
        return outside * np.array([away * p[0], away * p[1], 2.0 * p[2]])

    return Exact(
        lambda x, y, z: outside * ((np.hypot(x, y) - big) ** 2 + z**2 - small**2),
        gradient,
        np.array([rho * np.cos(0.3), rho * np.sin(0.3), small * np.sin(angle)]),
        *kappas,
    )


def bottle_neck():
    """The paper's neck, with kappa -0.0423 around it and 0.0172 along it: the skin of a torus's hole."""
    small = 1.0 / 0.0172
    return torus(small + 1.0 / 0.0423, small, np.pi, outside=-1.0)


def graph(terms):
    """z = sum c x^i y^j over {(i, j): c}, i + j >= 2, touched at the origin."""

    def partial(dx, dy):
        """A derivative by Horner's scheme, in y and then in x: rays ask for it many times."""
        rows = []
        for i in range(max(i for i, _ in terms), dx - 1, -1):
            of_y = range(max((j for k, j in terms if k == i), default=0), dy - 1, -1)
            rows.append([math.perm(i, dx) * math.perm(j, dy) * float(terms.get((i, j), 0.0)) for j in of_y])

        def value(x, y):
            total = 0.0 * x * y
            for row in rows:
                along_y = 0.0
                for c in row:
                    along_y = along_y * y + c
                total = total * x + along_y
            return total

        return value

    height, along_x, along_y = partial(0, 0), partial(1, 0), partial(0, 1)
    hessian = [
        [2.0 * terms.get((2, 0), 0.0), terms.get((1, 1), 0.0)],
        [terms.get((1, 1), 0.0), 2.0 * terms.get((0, 2), 0.0)],
    ]
    return Exact(
        lambda x, y, z: z - height(x, y),
        lambda p: np.array([-along_x(p[0], p[1]), -along_y(p[0], p[1]), 1.0]),
        np.zeros(3),
        *np.linalg.eigvalsh(hessian),
    )


def monkey_saddle():
    return graph({(3, 0): 1.0 / 900.0, (1, 2): -3.0 / 900.0})


def saddle():
    """A hyperbolic quadric with curvatures -0.03 and 0.02."""
    return graph({(2, 0): -0.015, (0, 2): 0.01})


def quartic():
    """A quartic Monge patch with every term of (1) in it."""
    return graph({
        (2, 0): -0.02, (0, 2): 0.0075, (3, 0): 2e-4, (2, 1): -3e-4, (1, 2): 1e-4, (0, 3): 2e-4,
        (4, 0): -8e-6, (3, 1): 5e-6, (2, 2): 1e-5, (1, 3): -6e-6, (0, 4): 4e-6,
    })  # fmt: skip


def revolution(radius, slope, height, longitude=0.4):
    """x^2 + y^2 = radius(z)^2, where slope is the derivative of radius, touched at a height."""
    r, h = radius(height), 1e-4
    bend = (slope(height + h) - slope(height - h)) / (2.0 * h)
    steep = np.sqrt(1.0 + slope(height) ** 2)
    return Exact(
        lambda x, y, z: x**2 + y**2 - radius(z) ** 2,
        lambda p: np.array([2.0 * p[0], 2.0 * p[1], -2.0 * radius(p[2]) * slope(p[2])]),
        np.array([r * np.cos(longitude), r * np.sin(longitude), height]),
        *sorted([-1.0 / (r * steep), bend / steep**3]),
    )


def pear():
    """A body of revolution with a waist, as a pear's, touched at the belly."""
    return revolution(
        lambda z: 24.0 - 0.15 * z - 5e-3 * z**2 - 1.6e-4 * z**3,
        lambda z: -0.15 - 1e-2 * z - 4.8e-4 * z**2,
        -3.0,
    )


def sine():
    """z = 0.8 sin(0.22 x + 0.7) cos(0.09 y), touched above the origin, away from its crests."""
    a, p, q, phase = 0.8, 0.22, 0.09, 0.7
    steep = np.sqrt(1.0 + (a * p * np.cos(phase)) ** 2)
    return Exact(
        lambda x, y, z: z - a * np.sin(p * x + phase) * np.cos(q * y),
        lambda r: np.array(
            [
                -a * p * np.cos(p * r[0] + phase) * np.cos(q * r[1]),
                a * q * np.sin(p * r[0] + phase) * np.sin(q * r[1]),
                1.0,
            ]
        ),
        np.array([0.0, 0.0, a * np.sin(phase)]),
        # z_xy and z_y are 0 there.
        *sorted([-a * p**2 * np.sin(phase) / steep**3, -a * q**2 * np.sin(phase) / steep]),
    )


FIVE = {
    "ellipsoid": ellipsoid(35, 25, 20, 0.6, 0.5),
    "torus": torus(40, 20, 0.6),
    "pear": pear(),
    "saddle": saddle(),
    "sphere": sphere(25),
}


def heights_over(surface, r, count=200):
    """Points of a reconstruction's domain (m, 2), and the surface's heights there in its frame, by rays."""
    points, _ = r.domain.grid(count)
    starts = r.frame.to_world(np.column_stack([points, np.full(len(points), r.radius)]))
    hits = surface.crossings(starts, -r.frame.axes[:, 2], 2.0 * r.radius)
    assert np.isfinite(hits).all()
    return points, r.frame.to_local(hits)[:, 2]


def off_data(surface, r):
    """Mean |dz| of a reconstruction over its domain."""
    points, heights = heights_over(surface, r)
    return np.mean(np.abs(r.patch.height(*points.T) - heights))


def wavy(rng, rough):
    """The height of a random cubic with waves, which ask for a residual if they are `rough`."""
    k, c = rng.uniform(-0.5, 0.5, 2), rng.normal(0.0, 0.1, 2)
    lengths = rng.uniform(2.0, 12.0, 4) * (1.0 if rough else 0.3)
    azimuths, phases, sizes = *rng.uniform(0.0, 7.0, (2, 4)), rng.uniform(0.002, 0.03, 4)

    def height(x, y):
        z = 0.5 * (k[0] * x**2 + k[1] * y**2) + c[0] * x**3 + c[1] * x**2 * y
        for p, a, phase, size in zip(lengths, azimuths, phases, sizes, strict=True):
            z = z + size * (np.cos(p * (x * np.cos(a) + y * np.sin(a)) + phase) - np.cos(phase))
        return z

    return height
