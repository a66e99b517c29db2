# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is asked for, and the files it is written to; no Blender, no Dask."""
