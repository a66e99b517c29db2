# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The touches of the last whole object, kept in memory: its mesh can be made again without new touches."""

from ..touch.types import Object
from .object_touches import ObjectTouches

# ObjectTouches by the session_uid of the object that they made; one at most.
_kept: dict[int, ObjectTouches] = {}


def keep(obj: Object, touches: ObjectTouches) -> None:
    """Keeps the touches that made an object, in place of those that were kept before."""
    _kept.clear()
    _kept[obj.session_uid] = touches


def touches_of(obj: Object | None) -> ObjectTouches | None:
    """The ObjectTouches that made an object, or None if they are no longer there."""
    return None if obj is None else _kept.get(obj.session_uid)


def forget() -> None:
    """Forgets the touches that are kept."""
    _kept.clear()
