# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The places of scans that benchmarks.paper touches, and the planes of a touch."""

import math
from typing import NamedTuple

AZIMUTHS = (0.0, 60.0, 120.0)


class Scan(NamedTuple):
    """A touch, with lengths in the file's unit; they are printed in `unit`, of which that has `scale`."""

    name: str
    file: str
    location: tuple[float, float, float]
    extent: float
    steps: int  # The number of steps of a half curve, which makes about as many contacts as in the paper.
    noise: float
    unit: str
    scale: float


# Renders and mesh curvature led to these places: the pear's belly, the lemon's side, the hollow shoulder
# under the bottle's cap (a saddle, like the paper's), and the great saddle of Eros (an extent of 2 km was
# tried as well). The shell's base is its widest place without ribs: at six points tried before, curves of
# 8 mm were lost to ribs.
SCANS = (
    Scan("shell", "shell_gastropod.stl", (-19.0, 1.0, 17.0), 8.0, 16, 0.05, "mm", 1.0),
    Scan("pear", "pear.ply", (-0.033, 0.0, 0.0652), 0.012, 10, 5e-5, "mm", 1e3),
    Scan("lemon (pebble)", "lemon.ply", (-0.0105, 0.0217, 0.0527), 0.012, 13, 5e-5, "mm", 1e3),
    Scan("bottle neck", "bottle_bleach.ply", (-0.0341, 0.0128, 0.2233), 0.010, 9, 5e-5, "mm", 1e3),
    Scan("Eros", "asteroid_eros.ply", (2.87, 4.68, 0.09), 3.0, 10, 0.0163, "km", 1.0),
)


def sampling_planes(extension):
    return [extension.core.SamplingPlane(math.radians(azimuth)) for azimuth in AZIMUTHS]
