# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The page around the parts of a report: HTML and pictures as SVG, in a single file without a renderer."""

from collections.abc import Callable, Iterable, Sequence
from html import escape

import numpy as np
from numpy.typing import ArrayLike

from ..scene.colors import shades
from ..touch.types import Array

PIXELS, BORDER = 320, 5.0  # The width and height of a picture, and what is free around its triangles.
BINS, BAR_WIDTH, HEIGHT = 41, 12, 150  # The number of bars of a histogram, their width and largest height.
PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title}</title>
<style>
body {{ max-width: 64rem; margin: 2rem auto; padding: 0 1rem; font: 1rem/1.5 sans-serif; color: #222; }}
.ok, .doubt {{ padding: .5rem 1rem; border-left: .4rem solid #2a7; background: #eef8f2; }}
.doubt {{ border-color: #d70; background: #fdf4e8; }}
figure {{ display: inline-block; margin: 0 1rem 1rem 0; vertical-align: top; }}
figcaption {{ font-size: .875rem; color: #555; max-width: 20rem; }}
svg {{ max-width: 100%; font: 11px sans-serif; }}
table {{ border-collapse: collapse; display: block; overflow-x: auto; }}
td, th {{ padding: .2rem 1.2rem .2rem 0; text-align: left; vertical-align: top; }}
tr {{ border-bottom: 1px solid #ddd; }}
@media print {{ body {{ margin: 0; }} figure, table {{ break-inside: avoid; }} }}
</style></head><body>
<h1>{title}</h1>
{body}
</body></html>
"""


def page(title: str, parts: Iterable[str]) -> str:
    """The page with a title in plain text and parts in HTML."""
    return PAGE.format(title=escape(title), body="\n".join(parts))


def section(heading: str, *parts: str) -> str:
    """A heading in plain text, and parts of HTML below it."""
    return f"<h2>{escape(heading)}</h2>\n" + "\n".join(parts)


def verdict(words: str, is_good: bool) -> str:
    """A sentence in the color of good or of doubt."""
    return f'<p class="{"ok" if is_good else "doubt"}">{escape(words)}</p>'


def words(text: str) -> str:
    """A paragraph of plain text."""
    return f"<p>{escape(text)}</p>"


def swatch(color: Sequence[float], text: str) -> str:
    """A box of a color, whose parts are from 0 to 1, with words next to it."""
    return f'<p style="border-left: 1rem solid {_hex(color)}; padding-left: .5rem">{escape(text)}</p>'


def figure(picture: str, caption: str) -> str:
    """A picture in SVG with a caption in plain text."""
    return f"<figure>{picture}<figcaption>{escape(caption)}</figcaption></figure>"


def table(rows: Iterable[Sequence[str]], header: Sequence[str] = ()) -> str:
    """A table of rows of plain values, with the first value of each in bold."""
    lines = ["".join(f"<th>{escape(name)}</th>" for name in header)] if header else []
    for first, *others in rows:
        cells = "".join(f"<td>{escape(str(value))}</td>" for value in others)
        lines.append(f"<th>{escape(str(first))}</th>{cells}")
    return f"<table>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"


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
    boxes = [
        f'<rect x="{5 * i}" y="0" width="5.5" height="12" fill="{_hex(fill)}"/>'
        for i, fill in enumerate(shades(np.linspace(low, 1.0, 64), 1.0))
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
