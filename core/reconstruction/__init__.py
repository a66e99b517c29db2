# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The way from contours to a reconstruction, its results and their status, and where to touch next."""
