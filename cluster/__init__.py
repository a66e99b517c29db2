# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Data sets of touches on thousands of objects: `python -m cluster`, at the root of a checkout."""
