# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The comparison of a patch with a mesh: it is verified where it is, or put where it belongs."""
