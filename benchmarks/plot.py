# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the charts have in common: a look that fits a README column, colours for all eyes, PNG and CSV."""

import csv

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from . import ROOT

OUTPUT = ROOT / "build" / "charts"
# Okabe and Ito's colours, told apart by colour-blind readers; marks and labels tell the same again.
BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, VERMILION, PURPLE = (
    "#000000", "#e69f00", "#56b4e9", "#009e73", "#f0e442", "#0072b2", "#d55e00", "#cc79a7",
)  # fmt: skip
plt.rcParams.update({
    "figure.dpi": 110, "font.size": 9, "axes.titlesize": 10, "axes.grid": True, "axes.grid.which": "major",
    "grid.color": "#e5e5e5", "axes.axisbelow": True, "axes.spines.top": False, "axes.spines.right": False,
    "legend.frameon": False,
})  # fmt: skip


def save(figure, name, caption, header, rows):
    """Writes build/charts/NAME.png, with the caption below, and NAME.csv, the table behind it."""
    OUTPUT.mkdir(parents=True, exist_ok=True)
    figure.text(0.01, 0.0, caption, ha="left", va="top", fontsize=7, color="#555555", wrap=True)
    figure.savefig(OUTPUT / f"{name}.png", bbox_inches="tight", pad_inches=0.15)
    with open(OUTPUT / f"{name}.csv", "w", newline="") as file:
        csv.writer(file).writerows([header, *rows])
    print(f"{OUTPUT / name}.png and .csv")
