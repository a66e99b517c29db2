# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The chart of benchmarks.real: error and coverage against the number of planes, and error against time."""

from statistics import median

import numpy as np

from . import machine, plot

STYLES = (  # These are in the order of benchmarks.real's methods.
    ("bayes", plot.BLUE, "o"),
    ("without residual", plot.SKY, "s"),
    ("RBF thin plate", plot.GREEN, "^"),
    ("RBF cubic", plot.VERMILION, "v"),
    ("Matérn process", plot.PURPLE, "D"),
)


AUTOMATIC = "automatic touch"
CAPTION = (
    "scans, half curves of 1/32, 1/16 and 1/8 of the object, without noise. The times are medians of "
    "processor time for a fit and 300 heights with three to six planes; the star is a touch with three "
    "planes that chooses its extent and step, ray casts and all its fits included."
)
HEAD = ["method", "planes", "error", "within", "ms"]


def draw(scores, seconds, automatic):
    """Draws and saves the chart of touches with a given extent, and of automatic ones.

    scores : {scan: {(planes, extent): {method: Score}}}; seconds : {(method, planes): [seconds]}
    automatic : (mean error in ‰ of the radius, milliseconds) of automatic touches
    """
    methods = list(next(iter(next(iter(scores.values())).values())))
    counts = sorted({cell[0] for of in scores.values() for cell in of})
    rows = []
    for method, (name, _, _) in zip(methods, STYLES, strict=True):
        for planes in counts:
            mean = _mean(scores, method, planes)
            rows.append([name, planes, mean.error, mean.covered, 1e3 * median(seconds[method, planes])])
    rows.append([AUTOMATIC, 3, automatic[0], "", automatic[1]])
    draw_rows(rows, f"{len(scores)} {CAPTION} On {machine('numpy', 'scipy')}.")


def draw_rows(rows, caption):
    """Draws and saves the chart of the rows of its table."""
    figure, axes = plot.plt.subplots(1, 3, figsize=(9.5, 3.8), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.12)
    counts = sorted({int(row[1]) for row in rows})
    for name, color, mark in STYLES:
        errors, covered, times = (np.array([row[i] for row in rows if row[0] == name]) for i in (2, 3, 4))
        look = {"color": color, "marker": mark, "ms": 4.5, "lw": 1.2, "label": name}
        axes[0].plot(counts, errors, **look)
        axes[2].plot(times, errors, **look)
        if np.isfinite(covered).all():
            axes[1].plot(counts, covered, **look)
    (automatic,) = (row for row in rows if row[0] == AUTOMATIC)
    axes[2].plot(automatic[4], automatic[2], "*", color=plot.BLUE, ms=11, label=AUTOMATIC)
    axes[1].axhline(0.9, color=plot.BLACK, lw=0.8, ls=":")
    titles = "Error by planes", "Points within the 90 % interval", "Error by time"
    for ax, title in zip(axes, titles, strict=True):
        ax.set(title=title, xlabel="sampling planes", ylabel="error, ‰ of the radius")
    axes[1].set_ylabel("share of the points")
    for ax in axes[:2]:
        ax.set_xticks(counts)
    axes[1].set_ylim(0.4, 1.0)
    axes[2].set(xlabel="time, ms", xscale="log")
    axes[2].set_xlim(0.5, 100.0)
    axes[2].xaxis.set_major_formatter("{x:g}")
    axes[2].xaxis.set_minor_formatter("")
    for ax in axes[::2]:
        ax.set_ylim(bottom=0.0)
    handles, labels = axes[2].get_legend_handles_labels()
    title = "Real surfaces: how near, and how true the intervals"
    look = {"ncols": 6, "fontsize": plot.LABEL_SIZE, "title_fontproperties": {"size": 12, "weight": "bold"}}
    figure.legend(handles, labels, loc="outside upper center", title=title, **look)
    plot.save(figure, "real_surfaces", caption, HEAD, rows)


def _mean(scores, method, planes):
    """The mean Score over scans and extents."""
    there = [of[method] for cells in scores.values() for cell, of in cells.items() if cell[0] == planes]
    return type(there[0])(*np.mean(there, axis=0))
