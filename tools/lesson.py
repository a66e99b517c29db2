# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of docs/lesson.md: one plane and its circle, curvature against its angle, Gaussian curvature.

`make lesson` draws them. The curvatures are those that core finds from three curves on each surface.
"""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Arc

import core

DOCS = Path(__file__).resolve().parents[1] / "docs"
REACH = 0.75  # The radius of the patches, in units of 1 / |k1|.
BLUE, RED, BLACK, GRAY = "#0072b2", "#d55e00", "#222222", "#999999"
SHAPES = {"cap (top of an egg)": (-1.0, -0.5), "pipe": (-1.0, 0.0), "saddle": (-1.0, 0.7)}


def main():
    plt.rcParams.update({"font.size": 10, "axes.spines.top": False, "axes.spines.right": False})
    found = {name: felt(*curvatures) for name, curvatures in SHAPES.items()}
    one(), turn(found), gauss(found)


def felt(k1, k2):
    """(k1, k2) that core finds at the top of z = (k1 x^2 + k2 y^2) / 2, from curves at 0, 60, 120 degrees."""
    s = np.linspace(-0.3, 0.3, 13)
    contours = []
    for azimuth in np.radians([0.0, 60.0, 120.0]):
        x, y = s * np.cos(azimuth), s * np.sin(azimuth)
        contours.append(core.Contour(np.column_stack([x, y, height(k1, k2, x, y)])))
    patch = core.reconstruct((0, 0, 0), contours, outward=(0, 0, 1)).patch
    return patch.k1, patch.k2


def height(k1, k2, x, y):
    return 0.5 * (k1 * x**2 + k2 * y**2)


def one():
    """Draws the curve of one plane, its circle, and the normal."""
    figure, axes = plt.subplots(figsize=(6.4, 3.2))
    x = np.linspace(-1.5, 1.5, 301)
    axes.plot(x, -0.5 * x**2 + 0.06 * x**4, color=BLACK, lw=2.5)
    axes.add_patch(Arc((0.0, -1.0), 2.0, 2.0, theta1=15, theta2=165, color=BLUE, lw=2, ls="--"))
    axes.plot([0.0], [-1.0], "o", color=BLUE)
    axes.plot([0.0, 0.72], [-1.0, -1.0 + np.sqrt(1 - 0.72**2)], color=BLUE, lw=1)
    axes.text(0.42, -0.72, "r", color=BLUE)
    axes.annotate("", (0.0, 0.75), (0.0, 0.0), arrowprops={"arrowstyle": "-|>", "color": RED, "lw": 2})
    axes.text(0.06, 0.5, "normal", color=RED)
    axes.text(-0.5, 0.3, "the surface, cut by the plane", color=BLACK, ha="right")
    axes.annotate("", (-0.75, -0.24), (-1.0, 0.26), arrowprops={"arrowstyle": "-", "color": GRAY})
    words = "the circle that fits best: κ = −1/r"
    axes.text(0.12, -1.1, words, color=BLUE)
    axes.set(xlim=(-2.4, 3.2), ylim=(-1.25, 0.85), aspect="equal")
    axes.axis("off")
    save(figure, "lesson_one")


def turn(found):
    """Draws normal curvature against the angle of the plane."""
    figure, row = plt.subplots(1, 3, figsize=(9.0, 2.8), sharey=True)
    angles = np.linspace(0.0, 180.0, 181)
    for axes, (name, (k1, k2)) in zip(row, found.items(), strict=True):
        c = np.cos(np.radians(angles)) ** 2
        axes.axhline(0.0, color=GRAY, lw=0.8)
        axes.plot(angles, k1 * c + k2 * (1.0 - c), color=BLACK, lw=2)
        for angle, value, words, color in ((0.0, k1, "κ1", BLUE), (90.0, k2, "κ2", RED)):
            axes.plot([angle], [value], "o", color=color, clip_on=False)
            text = f"{words} = {value:+.1f}".replace("-0.0", "0.0").replace("+0.0", "0.0").replace("-", "−")
            move = (8, -14) if words == "κ1" else (8, 7)
            axes.annotate(text, (angle, value), move, textcoords="offset points", color=color)
        axes.set(title=name, xticks=[0, 45, 90, 135, 180], ylim=(-1.3, 1.1))
        axes.set_xlabel("angle of the plane, degrees")
    row[0].set_ylabel("normal curvature κ")
    save(figure, "lesson_turn")


def gauss(found):
    """Draws the three patches in the colors of their Gaussian curvature."""
    figure = plt.figure(figsize=(9.0, 3.2))
    rho, phi = np.meshgrid(np.linspace(0.0, REACH, 30), np.linspace(0.0, 2.0 * np.pi, 73))
    x, y = rho * np.cos(phi), rho * np.sin(phi)
    for i, (name, (k1, k2)) in enumerate(found.items(), 1):
        axes = figure.add_subplot(1, 3, i, projection="3d")
        gaussian = k1 * k2 / (1.0 + (k1 * x) ** 2 + (k2 * y) ** 2) ** 2
        fine = {"rstride": 1, "cstride": 1, "linewidth": 0, "antialiased": False}
        colors = plt.get_cmap("RdBu_r")(0.5 + 0.5 * gaussian / 0.7)
        axes.plot_surface(x, y, height(k1, k2, x, y), facecolors=colors, shade=True, **fine)
        for azimuth in np.radians([0.0, 60.0, 120.0]):
            s = np.linspace(-REACH, REACH, 60)
            u, v = s * np.cos(azimuth), s * np.sin(azimuth)
            axes.plot(u, v, height(k1, k2, u, v) + 0.01, color=BLACK, lw=1.2, zorder=10)
        sign = "K > 0" if gaussian.max() > 0.05 else "K < 0" if gaussian.min() < -0.05 else "K = 0"
        axes.set_title(f"{name}: {sign}", y=0.93)
        axes.set(xlim=(-REACH, REACH), ylim=(-REACH, REACH), zlim=(-0.4, 0.3))
        axes.set_box_aspect((2.0 * REACH, 2.0 * REACH, 0.7), zoom=1.25)
        axes.view_init(38, -55)
        axes.axis("off")
    figure.subplots_adjust(left=0.0, right=1.0, bottom=0.0, top=0.95, wspace=0.0)
    save(figure, "lesson_gauss")


def save(figure, name):
    figure.savefig(DOCS / f"{name}.jpg", dpi=110, bbox_inches="tight", pil_kwargs={"quality": 85})
    plt.close(figure)


if __name__ == "__main__":
    main()
