# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles as pixels, the nearest in front: smaller than a path for each triangle of a large mesh."""

import base64
import struct
import zlib
from collections.abc import Iterator

import numpy as np

from ..touch.types import Array
from . import drawing

PIXELS, BORDER = 480, 4  # The pixels on each side of a picture, and the free ones around its mesh.
APART = 0.7  # The largest distance, in pixels, between samples of a triangle.
AT_ONCE = 500_000  # The number of samples that fit into memory at once.


def picture(points: Array, depths: Array, corners: Array, colors: Array) -> str:
    """An HTML image of triangles (m, 3) between points (n, 2), on a clear ground.

    depths : (n,), larger ones are nearer
    colors : (n, 3), from 0 to 1, at the points
    """
    values = np.column_stack([drawing.fitted(points, PIXELS, BORDER)(points), depths, colors])
    found = np.zeros((PIXELS * PIXELS, 4), dtype=np.uint8)
    nearest = np.full(PIXELS * PIXELS, -np.inf)
    for samples in _samples(values, corners):
        x, y = samples[:, :2].astype(np.intp).T
        place, depth = PIXELS * y + x, samples[:, 2]
        ahead = np.flatnonzero(depth > nearest[place])
        ahead = ahead[np.argsort(depth[ahead], kind="stable")]  # The last of those in one place counts.
        nearest[place[ahead]] = depth[ahead]
        found[place[ahead], :3] = np.rint(255.0 * samples[ahead, 3:].clip(0.0, 1.0))
        found[place[ahead], 3] = 255
    text = base64.b64encode(_png(found.reshape(PIXELS, PIXELS, 4))).decode()
    return (
        f'<img width="{drawing.PIXELS}" height="{drawing.PIXELS}" alt="" src="data:image/png;base64,{text}">'
    )


def _samples(values: Array, corners: Array) -> Iterator[Array]:
    """Values (k, c) all over triangles (m, 3), whose corners have values (n, c), some at once.

    The first two values are places in pixels.
    """
    at = values[corners]
    sides = at[:, :, :2] - np.roll(at[:, :, :2], 1, axis=1)
    longest = np.sqrt((sides**2).sum(axis=2).max(axis=1))
    halvings = np.ceil(np.log2(np.maximum(longest / APART, 1.0))).astype(int)
    for number in np.unique(halvings):
        weights = _weights(2**number)
        some = at[halvings == number]
        for part in np.array_split(some, len(some) * len(weights) // AT_ONCE + 1):
            yield np.einsum("kc,mcv->mkv", weights, part).reshape(-1, values.shape[1])


def _weights(count: int) -> Array:
    """Weights (k, 3) of the corners of a triangle at places all over it, `count` steps from side to side."""
    i, j = np.mgrid[: count + 1, : count + 1].reshape(2, -1)
    i, j = (along[i + j <= count] / count for along in (i, j))
    return np.column_stack([i, j, 1.0 - i - j])


def _png(rgba: Array) -> bytes:
    """The bytes of a .png of pixels (h, w, 4), uint8.

    Blender writes pictures of the file's images only, and a report adds nothing to the file.
    """
    high, wide, _ = rgba.shape
    # Each line begins with its filter, 2: differences from the line above take less than half the bytes.
    lines = np.full((high, 1 + 4 * wide), 2, dtype=np.uint8)
    lines[:, 1:] = np.diff(rgba.reshape(high, -1), axis=0, prepend=np.zeros((1, 4 * wide), dtype=np.uint8))
    parts = (
        (b"IHDR", struct.pack(">IIBBBBB", wide, high, 8, 6, 0, 0, 0)),
        (b"IDAT", zlib.compress(lines.tobytes(), 9)),
        (b"IEND", b""),
    )
    chunks = (
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in parts
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)
