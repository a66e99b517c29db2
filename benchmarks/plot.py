# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the charts have in common: a look that fits a README's column, colors, labels and files."""

import csv
import sys
import textwrap

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.patheffects import withStroke

from . import ROOT

OUTPUT = ROOT / "build" / "charts"
LABEL_SIZE, CAPTION_SIZE = 7.5, 7.0
# Color-blind readers can tell Okabe and Ito's colors apart. Marks and labels repeat what the colors say.
BLACK, ORANGE, SKY, GREEN, BLUE, VERMILION, PURPLE = (
    "#000000", "#e69f00", "#56b4e9", "#009e73", "#0072b2", "#d55e00", "#cc79a7",
)  # fmt: skip
plt.rcParams.update({
    "figure.dpi": 110, "font.size": 9, "axes.titlesize": 10, "axes.grid": True, "axes.grid.which": "major",
    "grid.color": "#e5e5e5", "axes.axisbelow": True, "axes.spines.top": False, "axes.spines.right": False,
    "legend.frameon": False,
})  # fmt: skip


def save(figure, name, caption, header, rows):
    """Writes build/charts/NAME.png, with the caption below, and NAME.csv with the table behind."""
    OUTPUT.mkdir(parents=True, exist_ok=True)
    # This wraps by the width of an average character: matplotlib's own wrapping forgets the tight box.
    width = int(72.0 * figure.get_figwidth() / (0.55 * CAPTION_SIZE))
    text = textwrap.fill(caption, width, break_on_hyphens=False)
    figure.text(0.01, 0.0, text, ha="left", va="top", fontsize=CAPTION_SIZE, color="#555555")
    figure.savefig(OUTPUT / f"{name}.png", bbox_inches="tight", pad_inches=0.15)
    with open(OUTPUT / f"{name}.csv", "w", newline="", encoding="utf-8") as file:
        file.write(f"# {caption}\r\n")
        csv.writer(file).writerows([header, *rows])
    print(f"{(OUTPUT / name).relative_to(ROOT)}.png and .csv", file=sys.stderr)


def dark(color):
    """A color for text, which is thinner than a mark."""
    return tuple(0.72 * part for part in to_rgb(color))


def label(axes, texts, places):
    """Writes texts, pairs (words, color), near their places (n, 2), each joined to its place by a line."""
    line = {"arrowstyle": "-", "lw": 0.4, "shrinkA": 0, "shrinkB": 2}
    look = {"textcoords": "offset points", "ha": "center", "va": "center", "fontsize": LABEL_SIZE}
    halo = [withStroke(linewidth=1.8, foreground="white")]
    moves = _moves(axes, [text for text, _ in texts], places)
    for (text, color), place, move in zip(texts, places, moves, strict=True):
        arrow = {**line, "color": color}
        axes.annotate(text, place, move, color=color, arrowprops=arrow, path_effects=halo, zorder=4, **look)


def _moves(axes, texts, places):
    """Ways (n, 2) from places to the centers of their texts, in points, so that texts cover little else.

    Each text in turn, four times over, takes one of 80 positions: a near one that overlaps little.
    """
    to_points = 72.0 / axes.figure.dpi
    marks = axes.transData.transform(places) * to_points
    frame = np.array(axes.get_window_extent().extents) * to_points
    sizes = LABEL_SIZE * np.array([(0.58 * len(text) + 0.3, 1.15) for text in texts])
    turns = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    rings = np.array([[r, a] for r in (0.0, 5.0, 11.0, 18.0, 26.0) for a in turns])
    directions = np.column_stack([np.cos(rings[:, 1]), np.sin(rings[:, 1])])
    centers = marks.copy()
    for _ in range(4):
        for i, size in enumerate(sizes):
            spots = marks[i] + directions * (size / 2.0 + 4.5 + rings[:, :1])
            others = np.arange(len(sizes)) != i
            cost = 3.0 * _overlap(spots, size, centers[others], sizes[others])
            cost += 2.0 * _overlap(spots, size, marks, np.full(marks.shape, 7.0)) + rings[:, 0]
            outside = np.maximum(frame[:2] - (spots - size / 2.0), spots + size / 2.0 - frame[2:])
            centers[i] = spots[np.argmin(cost + 50.0 * np.maximum(outside, 0.0).sum(axis=1))]
    return centers - marks


def _overlap(spots, size, centers, sizes):
    """The area (m,) that other boxes cover of a box of this size centered at each of the spots (m, 2)."""
    apart = np.abs(spots[:, None] - centers)
    return np.prod(np.maximum((size + sizes) / 2.0 - apart, 0.0), axis=2).sum(axis=1)
