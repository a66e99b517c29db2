# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The default fit: a sextic under a prior that evidence chooses, and a process where evidence favors one."""
