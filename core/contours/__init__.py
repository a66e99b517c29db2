# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sampling planes, the contours tracked in them, and the geometry at the point (paper, II and III)."""
