# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""`python -m cluster`; the guard is for processes that are spawned, which import this module again."""

import sys

if __name__ == "__main__":
    from .command_line import main

    sys.exit(main())
