# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The probe, an Empty that keeps a patch; what notices that its inputs have changed; and its operators."""
