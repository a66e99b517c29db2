# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole object (paper, VI): patches as nodes of a graph, where to touch next, one surface of all."""
