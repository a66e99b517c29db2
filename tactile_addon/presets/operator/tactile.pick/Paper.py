# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Jia and Tian's way: three upright planes, degree 4, (9) with 9.99/mm^2 at L = 10 mm, and their descent.

The paper does not state its extents, so these are automatic.
"""

from math import radians

import bpy

op = bpy.context.active_operator

op.plane_count = 3
op.azimuths = [radians(a) for a in (0, 60, 120, 30, 90, 150)]
op.tilts = [0.0] * 6
op.extent = 0.0
op.step = 0.0
op.noise = 0.0
op.method = "tagc"
op.degree = 4
op.weight = 1000.0
op.solver = "descent"
