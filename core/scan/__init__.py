# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A reconstruction against a scanned mesh (paper V): distances, verification, pose search."""
