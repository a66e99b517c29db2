# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A patch or a stability map as one page for a browser, with nothing beside it."""
