# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A property of all items of a Blender collection, such as the vertices of a mesh, as one array."""

from typing import Any

import numpy as np

from .types import Array


def read_array(items: Any, key: str, width: int = 1, dtype: Any = np.float32) -> Array:
    """The property `key` of n items: (n,), or (n, width) for vectors."""
    values = np.empty(width * len(items), dtype=dtype)
    items.foreach_get(key, values)
    return values if width == 1 else values.reshape(-1, width)
