# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The comparison of a reconstruction with a scanned mesh (paper, V): distances, verification, pose search."""
