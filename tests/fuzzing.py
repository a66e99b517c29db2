# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the fuzz tests share."""

import functools
import signal

HANG = 120  # seconds, which no example comes near


def in_time(test):
    """Makes each example of a test fail where it hangs."""

    def give_up(*_):
        raise TimeoutError(f"not done after {HANG} s")

    @functools.wraps(test)
    def limited(*arguments, **named):
        signal.signal(signal.SIGALRM, give_up)
        signal.alarm(HANG)
        try:
            test(*arguments, **named)
        finally:
            signal.alarm(0)

    return limited
