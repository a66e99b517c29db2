# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a touch leaves in the scene: the patch and its contours as objects, their attributes and colors."""
