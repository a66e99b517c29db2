# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's own fits (paper IV): least squares, quadratic variation, total absolute Gaussian curvature."""
