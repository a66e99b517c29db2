# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of a report as SVG, without a renderer: colored triangles, histograms, scales."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..scene.colors import shades
from ..touch.types import Array

PIXELS, BORDER = 320, 5.0  # The width and height of a picture, and what is free around its triangles.
BINS, BAR_WIDTH, HEIGHT = 41, 12, 150  # The number of bars of a histogram, their width and largest height.


def triangles(points: Array, corners: Array, colors: Array, marks: ArrayLike = ()) -> str:
    """A picture of triangles (m, 3) between points (n, 2), in colors (m, 3 or 4), with marks (k, 2)."""
    place = _fitted(points)
    outlines = ("L".join(f"{x:.1f} {y:.1f}" for x, y in place(points[three])) for three in corners)
    shapes = [
        f'<path d="M{outline}Z" fill="{_hex(color)}" stroke="{_hex(color)}"/>'
        for outline, color in zip(outlines, colors, strict=True)
    ]
    shapes += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="1.6"/>' for x, y in place(np.reshape(marks, (-1, 2)))]
    return f'<svg viewBox="0 0 {PIXELS} {PIXELS}" width="{PIXELS}">{"".join(shapes)}</svg>'


def histogram(values: Array, weights: Array, limit: float, label: Callable[[float], str]) -> str:
    """A histogram of values (n,) with weights (n,) up to a limit; its end bars count what is beyond, too."""
    low = -limit if np.min(values) < 0.0 else 0.0
    edges = np.linspace(low, limit, BINS + 1)
    shares, _ = np.histogram(np.clip(values, low, limit), edges, weights=weights)
    tall = shares / max(shares.max(), 1e-300)
    fills = shades(0.5 * (edges[1:] + edges[:-1]), limit)
    bars = [
        f'<rect x="{BAR_WIDTH * i}" y="{HEIGHT * (1.0 - t):.1f}" width="{BAR_WIDTH - 1}" '
        f'height="{HEIGHT * t:.1f}" fill="{_hex(fill)}" stroke="#888" stroke-width="0.5"/>'
        for i, (t, fill) in enumerate(zip(tall, fills, strict=True))
    ]
    width = BAR_WIDTH * BINS
    places = ((low, 0, "start"), (0.5 * (low + limit), width // 2, "middle"), (limit, width, "end"))
    ticks = [
        f'<text x="{x}" y="{HEIGHT + 18}" text-anchor="{anchor}">{label(value)}</text>'
        for value, x, anchor in places
    ]
    return f'<svg viewBox="0 0 {width} {HEIGHT + 24}" width="{width}">{"".join([*bars, *ticks])}</svg>'


def scale(limit: float, label: Callable[[float], str], low: float = -1.0) -> str:
    """A picture of the colors from `low` times the limit to the limit, with their values."""
    fills = shades(np.linspace(low, 1.0, 64), 1.0)
    boxes = [
        f'<rect x="{5 * i}" y="0" width="5.5" height="12" fill="{_hex(f)}"/>' for i, f in enumerate(fills)
    ]
    words = [
        f'<text x="{x}" y="27" text-anchor="{anchor}">{label(at * limit)}</text>'
        for x, at, anchor in (
            (0, low, "start"),
            (PIXELS // 2, 0.5 * (low + 1.0), "middle"),
            (PIXELS, 1.0, "end"),
        )
    ]
    return f'<svg viewBox="0 0 {PIXELS} 32" width="{PIXELS}">{"".join([*boxes, *words])}</svg>'


def _fitted(points: Array) -> Callable[[Array], Array]:
    """A function that takes points (n, 2) into the middle of a square picture, with y upward."""
    low, high = points.min(axis=0), points.max(axis=0)
    factor = (PIXELS - 2.0 * BORDER) / max((high - low).max(), 1e-300)
    return lambda at: PIXELS / 2.0 + factor * (at - 0.5 * (low + high)) * (1.0, -1.0)


def _hex(color: Sequence[float]) -> str:
    return "#" + "".join(f"{round(255 * min(max(part, 0.0), 1.0)):02x}" for part in color[:3])
