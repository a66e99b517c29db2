# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The geometry of a patch, stored once: Monge patch, residual, domain, triangles."""
