# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of a patch: pictures along its normal, and how far the mesh or the contacts are from it."""

from collections.abc import Iterator, Mapping
from typing import Any

import bpy
import numpy as np

from ... import core
from ..scene import patch_record
from ..scene.attributes import DEVIATION, POSITION
from ..scene.colors import shades, symmetric_range
from ..scene.mesh_data import corners_of, values
from ..touch import units
from ..touch.types import Array, Object
from ..touch.units import Unit
from ..touch.wording import readable_rows, verdict
from . import drawing, page, parts

OUTERMOST = "The outermost bars count all larger distances."
SHOWN = (
    ("gaussian_curvature", "Gaussian curvature", -2),
    ("height_std", "standard deviation of the height", 1),
    ("deviation", "deviation from the mesh, red where the patch is outside it", 1),
)


def patch_page(patch: Object, r: core.Reconstruction) -> str:
    """The page of a patch object and its core.Reconstruction."""
    record = patch[patch_record.RECORD].to_dict()
    unit = units.unit_of_report(bpy.context.scene, record)
    off, weights, words = _deviations(patch, r, record)
    bands = parts.bands(off, weights, r.mean_height_std, unit, parts.shares_of(r.radius, "radius"))
    sections = [
        page.verdict(f"{verdict(record, unit)}. {record['message']}", record["status"] == "ok"),
        page.section("Pictures", *_pictures(patch, r, record, unit)),
        page.section("Deviations", parts.spread(off, weights, unit, words)),
        page.section("Tolerance bands", bands),
        *parts.ending(readable_rows(record), record, unit),
    ]
    return page.page(f"{patch.name}: a patch of {record['source']}", sections)


def _pictures(patch: Object, r: core.Reconstruction, record: Mapping[str, Any], unit: Unit) -> Iterator[str]:
    points, corners = values(patch.data, POSITION), corners_of(patch.data)
    contacts = r.contacts[:, :2] * record["radius"] / r.radius  # The object's mesh has this scale.
    for attribute, title, power in SHOWN if _has_mesh(record) else SHOWN[:-1]:
        shown, low = values(patch.data, attribute), 0.0 if attribute in patch_record.POSITIVE else -1.0
        limit = symmetric_range(shown, parts.LEAST_RANGE)
        colors = shades(shown[corners].mean(axis=1), limit)
        picture = drawing.triangles(points[:, :2], corners, colors, contacts)
        scale = drawing.scale(limit, parts.label(power, unit), low)
        yield page.figure(f"{picture}<br>{scale}", f"{title}, along the normal, with the contacts")


def _has_mesh(record: Mapping[str, Any]) -> bool:
    return bool(record.get("vertices") or record.get("verification"))


def _deviations(patch: Object, r: core.Reconstruction, record: Mapping[str, Any]) -> tuple[Array, Array, str]:
    """Signed distances (n,) of the patch from mesh or contacts, their weights (n,), and words for them."""
    if _has_mesh(record):
        points, corners = values(patch.data, POSITION), corners_of(patch.data)
        words = "Shares of the patch's area by its distance from the mesh."
        return values(patch.data, DEVIATION), parts.vertex_areas(points, corners), f"{words} {OUTERMOST}"
    x, y, z = r.contacts.T
    words = "Shares of the contacts by the patch's height above them."
    return r.height(x, y) - z, np.ones(len(x)), f"{words} {OUTERMOST}"
