# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The attributes of the meshes that touches make: their names, types and domain."""

from typing import Any

import bpy

DOMAIN: Any = "POINT"  # Each vertex has a value.
CORNERS: Any = "CORNER"  # Each corner of a face has a color: on whole objects walls meet at creases.
POSITION = "position"  # Blender's own.
CURVATURES = ("gaussian_curvature", "mean_curvature", "shape_index", "curvedness")
# Those of a whole object have deviations, too, which are infinite where its curvatures are unknown.
GAUSSIAN_STD, CURVATURE_STD = "gaussian_curvature_std", "mean_curvature_std"
DEVIATION = "deviation"  # Signed distances from the mesh that was touched, positive outside it.
HEIGHT_STD = "height_std"
COLOR = "curvature_color"
NORMAL, PLACE = "custom_normal", "domain_place"  # Normals for shading; places on the unit disk.
NODE = "patch"  # The node of a whole object's graph whose patch counts most.
MEASURES = ("error", HEIGHT_STD, "reach", "condition_number", "blind_share")  # Of a stability map,
REASON, TOUCH, MAP_COLOR = "reason", "touch", "stability_color"  # and so are these.
TYPES: dict[str, Any] = {
    **dict.fromkeys((*CURVATURES, GAUSSIAN_STD, CURVATURE_STD, DEVIATION, HEIGHT_STD, *MEASURES), "FLOAT"),
    **dict.fromkeys((POSITION, NORMAL, PLACE), "FLOAT_VECTOR"),
    **dict.fromkeys((COLOR, MAP_COLOR), "FLOAT_COLOR"),
    **dict.fromkeys((NODE, REASON, TOUCH), "INT"),
}
# The property of an attribute's data that has its values, by the attribute's type.
KEYS = {
    "FLOAT": "value",
    "INT": "value",
    "FLOAT_VECTOR": "vector",
    "FLOAT_COLOR": "color",
}


def attribute_of(mesh: bpy.types.Mesh, name: str, domain: Any = DOMAIN) -> Any:
    """The attribute of this name, or None if there is none with its type and this domain."""
    found: Any = mesh.attributes.get(name)
    is_one = found is not None and (found.data_type, found.domain) == (TYPES[name], domain)
    return found if is_one else None
