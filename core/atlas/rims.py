# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a patch ends, as a finger feels it that taps along rays from the middle of the patch.

Between the ends of curves a domain may bulge beyond a crease or across a hole, and at a crease curves end a
step early. On a flat wall the patch goes on beyond its domain until the wall ends. Where a patch turns away
from its own plane, its heights are no longer those of the surface, and other patches are better.
"""

import math

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..contours.contour import vector_of
from ..reconstruction.result import Reconstruction
from ..triangles import normalized
from .charts import AZIMUTHS
from .finger import Finger
from .join import FARTHEST_RIM

# python -m benchmarks.atlas judges these.
TAPS = 48  # The finger taps along this many rays,
INNER = (0.25, 0.5, 0.75, 1.0, FARTHEST_RIM)  # at these shares of the domain's radius,
OUTER = FARTHEST_RIM * 1.12 ** np.arange(1, 7)  # and at these where the wall is flat.
FLAT = 3.0  # It is flat where the finger is nearer to the continued patch by this factor than it has to be.
HALVINGS = 5  # This many halvings find where a patch ends,
LEAST_RIM = 0.002  # which is at least this share of its largest radius away.
LEAST_COSINE = 0.6  # A patch ends where its normal has a lesser cosine to that at its point.
INWARD = 0.98  # A corner is felt at this share of its radius.
NARROWEST = 5.0  # A patch reaches at most this many times its width.
SLOPE = 1e-3  # Slopes are differences over this share of the radius.


def radial_extent(r: Reconstruction, finger: Finger, near: float) -> Array:
    """The radii (AZIMUTHS,) of a patch, in unit radius, up to where the surface or the patch turns away.

    near : the finger feels the patch where the surface is within this length of it
    """
    domain = r.domain.radii(AZIMUTHS) / r.radius
    azimuths = np.arange(TAPS) * (AZIMUTHS // TAPS)
    radii = domain[azimuths]
    turns = 2.0 * np.pi * azimuths / AZIMUTHS
    rays = r.radius * radii * np.stack([np.cos(turns), np.sin(turns)])
    shares, ended = _extents(r, finger, near, rays)
    if not ended.any():
        return domain
    radii = radii * shares
    if not radii.any():
        return 0.0 * domain
    # A straight crease is a line between azimuths whose inverse radius is nearly linear.
    inverse = 1.0 / np.maximum(radii, LEAST_RIM * radii.max())
    straight = 1.0 / np.interp(np.arange(AZIMUTHS), azimuths, inverse, period=AZIMUTHS)
    radii = np.maximum(straight[1::2], _corners(inverse, ended))
    turns += np.pi / TAPS
    between = r.radius * radii * np.stack([np.cos(turns), np.sin(turns)])
    met = np.isfinite(_offsets(r, finger, near, INWARD * between))
    straight[1::2][met] = radii[met]
    is_end = np.repeat(ended | np.roll(ended, -1), AZIMUTHS // TAPS)
    rim = np.where(is_end, straight, domain)
    # Rays from its middle do not resolve the ends of a narrow patch.
    across = np.roll(rim, AZIMUTHS // 4) + np.roll(rim, -AZIMUTHS // 4)
    return np.minimum(rim, NARROWEST * across)


def _corners(inverse: Array, ended: NDArray[np.bool_]) -> Array:
    """Radii (TAPS,) in the middle between azimuths, where straight creases on both sides of that go on.

    inverse : (TAPS,), 1 over the radii at azimuths; that of a line is a sum of a sine and a cosine
    """
    step = 2.0 * np.pi / TAPS
    before = inverse * np.sin(1.5 * step) - np.roll(inverse, 1) * np.sin(0.5 * step)
    after = np.roll(inverse, -1) * np.sin(1.5 * step) - np.roll(inverse, -2) * np.sin(0.5 * step)
    four = ended & np.roll(ended, 1) & np.roll(ended, -1) & np.roll(ended, -2)
    both = np.maximum(before, after)
    return np.where(four & (both > 0.0), np.sin(step) / np.where(both > 0.0, both, 1.0), 0.0)


def _extents(r: Reconstruction, finger: Finger, near: float, rays: Array) -> tuple[Array, NDArray[np.bool_]]:
    """How far the patch goes along rays (2, TAPS), as shares of these, and whether it ends there."""
    low, high, left = np.zeros(TAPS), np.zeros(TAPS), np.arange(TAPS)
    shares, ended = np.ones(TAPS), np.zeros(TAPS, dtype=bool)
    for share in (*INNER, *OUTER):
        off = _offsets(r, finger, near, share * rays[:, left])
        end = left[np.isinf(off)]
        ended[end], high[end] = True, share
        if share >= FARTHEST_RIM:
            left, off = left[off <= near / FLAT], off[off <= near / FLAT]
        left = left[np.isfinite(off)]
        low[left] = share
    ended[left], shares[left], end = True, OUTER[-1], np.flatnonzero(high)
    low, high = low[end], high[end]
    most = np.where(high > FARTHEST_RIM, near / FLAT, near)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        met = _offsets(r, finger, near, middle * rays[:, end]) <= most
        low, high = np.where(met, middle, low), np.where(met, high, middle)
    shares[end] = low
    return shares, ended


def _offsets(r: Reconstruction, finger: Finger, near: float, xy: Array) -> Array:
    """How far the surface is from a patch at local places (2, k), (k,), lengths.

    It is inf where the finger feels none within the length `near`, and where the patch is too steep.
    """
    x, y, step = *xy, SLOPE * r.radius
    z, right, ahead = r.height(np.append(x, [x + step, x]), np.append(y, [y, y + step])).reshape(3, -1)
    up = np.stack([z - right, z - ahead, np.full(len(z), step)], axis=1) @ r.frame.axes.T
    up = normalized(up)
    offsets = np.full(len(z), np.inf)
    places = r.frame.to_world(np.stack([x, y, z], axis=1)).tolist()
    for i in np.flatnonzero(up @ r.frame.axes[:, 2] > LEAST_COSINE):
        contact = finger.near(vector_of(places[i]), vector_of(up[i]), near)
        offsets[i] = math.inf if contact is None else math.dist(places[i], contact[0])
    return offsets
