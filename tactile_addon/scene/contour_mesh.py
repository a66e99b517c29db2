# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh that shows contours as tubes, contacts (those of strokes, too), and the rim of the patch."""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import bpy
import numpy as np

from ... import core
from ..touch.touch_object import Touched
from ..touch.types import Array
from .attributes import CONTACT, CONTOUR
from .mesh_data import fill

THICKNESS = 0.009  # That of a contour, as a share of the radius.
RIM_CORNERS, RIM_THICKNESS = 96, 0.6  # The number of points of the rim; its share of a contour's thickness.
TIP = 3.6  # The distance of a contact's tips from it is this multiple of a contour's thickness,
LEAST_TIP, GAP = 1.6, 0.4  # or this share of the way to the next one, if they would run together.
FLAT = 0.35  # They are flatter by this factor, so that they rise little above the patch.
CONTACT_TIPS = np.vstack([np.diag([1.0, 1.0, FLAT]), -np.diag([1.0, 1.0, FLAT])])
FACES = np.array([(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)])
SIDES = np.array([(1, 1), (1, -1), (-1, -1), (-1, 1)])  # The corners of a square tube.


class _Form(NamedTuple):
    """What all meshes with the same numbers of contacts have in common.

    before, after : for each point of all paths, the indices of the points between which its tube runs
    """

    before: Array
    after: Array
    triangles: Array
    contour: Array
    contact: Array


def fill_contours(mesh: bpy.types.Mesh, touched: Touched) -> None:
    """Tubes along the contours and an octahedron at each contact, in the Darboux frame.

    Point attributes number them: `contour` is the number of the contour, and -1 for strokes and the rim;
    `contact` is the number of the contact along it, and -1 on tubes and the rim. All of this only shows what
    the patch keeps in its reconstruction.
    """
    result = touched.result
    frame, thickness = result.frame, THICKNESS * result.radius
    contours, strokes = [frame.to_local(each.points) for each in result.contours], result.strokes
    across = [
        _across(path) if contour.plane_normal is None else frame.axes.T @ contour.plane_normal
        for path, contour in zip(contours, result.contours, strict=True)
    ]
    paths = [*contours, rim(result)]  # The rim sets a flat patch off from a flat face below it.
    lengths = [len(path) for path in paths]
    form = _form(tuple(lengths), len(strokes))
    sizes = np.repeat(thickness * np.array([*(1.0 for _ in contours), RIM_THICKNESS]), lengths)
    tubes = _tubes(np.vstack(paths), np.repeat([*across, (0.0, 0.0, 1.0)], lengths, axis=0), sizes, form)
    points = np.vstack([tubes, _octahedra(contours, frame.to_local(strokes), thickness)])
    fill(mesh, points, form.triangles, [(CONTOUR, form.contour), (CONTACT, form.contact)])


def _octahedra(contours: Sequence[Array], strokes: Array, thickness: float) -> Array:
    """The tips (6n, 3) of the octahedra at the contacts of contours and at those of strokes (m, 3)."""
    reaches = [_reach(path, thickness) for path in contours] + [TIP * thickness]
    reach = np.repeat(reaches, [*map(len, contours), len(strokes)])
    contacts = np.vstack([*contours, strokes])
    return (contacts[:, None] + reach[:, None, None] * CONTACT_TIPS).reshape(-1, 3)


def _reach(path: Array, thickness: float) -> float:
    """How far the tips of the contacts of a path (n, 3) are from it: less where many are close together."""
    if len(path) < 2:
        return TIP * thickness
    apart = float(np.median(np.linalg.norm(np.diff(path, axis=0), axis=1)))
    return min(max(GAP * apart, LEAST_TIP * thickness), TIP * thickness)


def rim(result: core.Reconstruction) -> Array:
    """The closed path (n, 3) around a patch, in its Darboux frame."""
    edge = result.domain.boundary(RIM_CORNERS)
    edge = np.vstack([edge, edge[:1]])
    return np.column_stack([edge, result.height(*edge.T)])


def _across(path: Array) -> Array:
    """A direction in the tangent plane across a path (n, 3), for a contour without a sampling plane."""
    x, y, _ = path[-1] - path[0]
    return np.array([-y, x, 0.0]) / max(np.hypot(x, y), 1e-30)


def _tubes(paths: Array, across: Array, sizes: Array, form: _Form) -> Array:
    """The corners (4n, 3) of square tubes along paths (n, 3), in the planes normal to `across` (n, 3)."""
    ahead = paths[form.after] - paths[form.before]
    up = np.cross(across, ahead)
    up *= (sizes / np.maximum(np.linalg.norm(up, axis=1), 1e-30))[:, None]
    aside = sizes[:, None] * across
    return (paths[:, None] + SIDES[:, :1] * up[:, None] + SIDES[:, 1:] * aside[:, None]).reshape(-1, 3)


@lru_cache(maxsize=8)
def _form(lengths: tuple[int, ...], strokes: int) -> _Form:
    """The form of a mesh of paths with these lengths, the rim being the last, and of contacts of strokes."""
    paths = [slice(end - n, end) for n, end in zip(lengths, np.cumsum(lengths), strict=True)]
    at, felt = np.arange(sum(lengths)), lengths[:-1]
    before, after, quads = at - 1, at + 1, []
    for path in paths:
        before[path.start], after[path.stop - 1] = path.start, path.stop - 1
        a = 4 * at[path][:-1, None] + np.arange(4)
        b = 4 * at[path][:-1, None] + np.roll(np.arange(4), -1)
        quads += [np.stack([a, b, b + 4], axis=-1), np.stack([a, b + 4, a + 4], axis=-1)]
    count = sum(felt) + strokes
    octahedra = 4 * len(at) + 6 * np.arange(count)[:, None, None] + FACES
    of_felt = np.repeat(np.arange(len(felt)), np.array(felt, dtype=np.intp))
    of_tubes = np.concatenate([of_felt, np.full(lengths[-1], -1)])
    of_contacts = np.concatenate([of_felt, np.full(strokes, -1)])
    number = np.concatenate([np.arange(n) for n in (*felt, strokes)])
    return _Form(
        before,
        after,
        np.vstack([each.reshape(-1, 3) for each in (*quads, octahedra)]),
        np.concatenate([np.repeat(of_tubes, 4), np.repeat(of_contacts, 6)]),
        np.concatenate([np.full(4 * len(at), -1), np.repeat(number, 6)]),
    )
