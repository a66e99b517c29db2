# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is felt: sampling planes, tracked contours, and the geometry at the point (paper III)."""
