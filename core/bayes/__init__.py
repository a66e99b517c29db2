# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The default fit: a sextic under a prior, by the evidence, and a residual where the contacts ask for one."""
