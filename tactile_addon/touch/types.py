# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The names of types in annotations: of arrays and places, and of what Blender's stubs do not know."""

from typing import TYPE_CHECKING, Any, TypeAlias

import bpy
from numpy.typing import NDArray

Array: TypeAlias = NDArray[Any]
# A place, direction or normal: three numbers in a list, an array or a mathutils.Vector.
Point: TypeAlias = Any
Triple: TypeAlias = tuple[float, float, float]
Outcome: TypeAlias = set[Any]  # What an operator returns, such as {"FINISHED"}.
# A bpy.types.Object. The stubs know neither the custom properties of objects nor those that add-ons register,
# and they let no object's data be taken for a mesh.
Object: TypeAlias = Any

# The bases of what operators and panels inherit besides Blender's types, which only the type checker sees.
if TYPE_CHECKING:
    OperatorMixin = bpy.types.Operator
    PanelMixin = bpy.types.Panel
else:
    OperatorMixin = PanelMixin = object
