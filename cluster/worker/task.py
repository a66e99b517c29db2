# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The task that Dask runs. Each thread of a worker has a hand of its own, and what fails is tried twice."""

import threading
from typing import Any

from .process import FAILED, STOP, HandProcess, LostError, NotStartedError

TRIES = 2
_own = threading.local()


def perform(label: str, limit: float, name: str, *arguments: Any) -> tuple[str, Any, list[str]]:
    """How an order went, its result, and what went wrong before; `label` names object and block."""
    troubles: list[str] = []
    for _ in range(TRIES):
        last = FAILED
        try:
            how, value = _hand().ask(limit, name, *arguments)
        except LostError as error:
            how, value = FAILED, str(error)
            last = STOP if isinstance(error, NotStartedError) else FAILED
        if how != FAILED:
            return how, value, troubles
        troubles.append(f"{label}: {value}")
    return last, value.partition("\n")[0], troubles


def _hand() -> HandProcess:
    """The hand of this thread, or a new one if that is gone or worn."""
    hand = getattr(_own, "hand", None)
    if hand is not None and hand.is_worn:
        hand.close()
        hand = None
    _own.hand = hand or HandProcess()
    return _own.hand
