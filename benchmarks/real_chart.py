# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The chart of benchmarks.real: error and coverage against the number of planes, and error against time."""

from statistics import median

import numpy as np

from . import machine, plot

STYLES = (  # These are in the order of benchmarks.real's methods.
    ("bayes", plot.BLUE, "o"),
    ("without process", plot.SKY, "s"),
    ("RBF thin plate", plot.GREEN, "^"),
    ("RBF cubic", plot.VERMILION, "v"),
    ("Matérn process", plot.PURPLE, "D"),
)


def draw(scores, seconds, automatic):
    """Draws and saves the chart of touches with a given extent, and of automatic ones.

    scores : {scan: {(planes, extent): {method: Score}}}; seconds : {(method, planes): [seconds]}
    automatic : (mean error in ‰ of the radius, milliseconds) of automatic touches
    """
    methods = list(next(iter(next(iter(scores.values())).values())))
    counts = sorted({cell[0] for of in scores.values() for cell in of})
    figure, axes = plot.plt.subplots(1, 3, figsize=(9.5, 3.8), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.12)
    rows = []
    for method, (name, color, mark) in zip(methods, STYLES, strict=True):
        means = [_mean(scores, method, planes) for planes in counts]
        errors, covered = [score.error for score in means], [score.covered for score in means]
        times = [1e3 * median(seconds[method, planes]) for planes in counts]
        look = {"color": color, "marker": mark, "ms": 4.5, "lw": 1.2, "label": name}
        axes[0].plot(counts, errors, **look)
        axes[2].plot(times, errors, **look)
        if np.isfinite(covered).all():
            axes[1].plot(counts, covered, **look)
        rows += [[name, *row] for row in zip(counts, errors, covered, times, strict=True)]
    axes[2].plot(automatic[1], automatic[0], "*", color=plot.BLUE, ms=11, label="automatic touch")
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
    caption = (
        f"{len(scores)} scans, half curves of 1/32, 1/16 and 1/8 of the object, without noise. The times are "
        "medians of processor time for a fit and 300 heights with three to six planes; the star is a touch "
        "with three planes that chooses its extent and step, ray casts and all its fits included. "
        f"On {machine('numpy', 'scipy')}."
    )
    rows.append(["automatic touch", 3, automatic[0], "", automatic[1]])
    plot.save(figure, "real_surfaces", caption, ["method", "planes", "error", "within", "ms"], rows)


def _mean(scores, method, planes):
    """The mean Score over scans and extents."""
    there = [of[method] for cells in scores.values() for cell, of in cells.items() if cell[0] == planes]
    return type(there[0])(*np.mean(there, axis=0))
