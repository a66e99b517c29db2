# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The contours as a mesh, tubes and contacts; the contacts of strokes; and the rim of the patch."""

import numpy as np

from .mesh_data import fill

CORNERS, RIM = 96, 0.6  # points around a patch, and how thick its rim is beside a contour


def fill_contours(mesh, touched):
    """Tubes along the contours and an octahedron at each contact, in the Darboux frame.

    Point attributes tell them apart: `contour` counts the contours and is -1 for strokes and the rim,
    `contact` the contacts along one, and is -1 on the tubes and the rim. They show what the
    patch keeps in its reconstruction.
    """
    frame, thickness = touched.result.frame, 0.009 * touched.result.radius
    parts = []  # (number of the contour, points, triangles, index of the contact)
    for number, contour in enumerate(touched.result.contours):
        path = frame.to_local(contour.points)
        across = frame.axes.T @ contour.plane_normal if contour.plane_normal is not None else _across(path)
        parts.append((number, *_tube(path, across, thickness), np.full(4 * len(path), -1)))
        parts.append((number, *_contacts(path, thickness)))
    if len(touched.result.strokes):
        parts.append((-1, *_contacts(frame.to_local(touched.result.strokes), thickness)))
    rim = _rim(touched.result)  # by which a flat patch is told from a flat face below it
    parts.append((-1, *_tube(rim, np.array([0.0, 0.0, 1.0]), RIM * thickness), np.full(4 * len(rim), -1)))
    points, triangles, contour_index, contact_index = [], [], [], []
    count = 0
    for number, mesh_points, mesh_triangles, contact in parts:
        points.append(mesh_points)
        triangles.append(mesh_triangles + count)
        contour_index.append(np.full(len(mesh_points), number))
        contact_index.append(contact)
        count += len(mesh_points)
    attributes = [
        ("contour", "INT", np.concatenate(contour_index)),
        ("contact", "INT", np.concatenate(contact_index)),
    ]
    fill(mesh, np.vstack(points), np.vstack(triangles), attributes)


def _rim(result):
    """The closed path (n, 3) around a patch, in its frame."""
    edge = result.domain.boundary(CORNERS)
    edge = np.vstack([edge, edge[:1]])
    return np.column_stack([edge, result.height(*edge.T)])


def _tube(path, across, thickness):
    """A square tube along a path (n, 3) in the plane normal to `across`: points (4n, 3) and triangles."""
    ahead = np.vstack([path[1:], path[-1:]]) - np.vstack([path[:1], path[:-1]])
    up = np.cross(across, ahead)
    up /= np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-30)
    corners = [path + thickness * (a * up + b * across) for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
    ring = np.arange(4)
    a = (4 * np.arange(len(path) - 1)[:, None] + ring).ravel()
    b = (4 * np.arange(len(path) - 1)[:, None] + (ring + 1) % 4).ravel()
    triangles = np.vstack([np.column_stack([a, b, b + 4]), np.column_stack([a, b + 4, a + 4])])
    return np.stack(corners, axis=1).reshape(-1, 3), triangles


def _across(path):
    """A direction in the tangent plane across a path (n, 3) that is in no plane."""
    x, y, _ = path[-1] - path[0]
    return np.array([-y, x, 0.0]) / max(np.hypot(x, y), 1e-30)


def _contacts(path, thickness):
    """Octahedra at contacts (n, 3): points, triangles, and which contact each point is of."""
    return *_octahedra(path, 3.6 * thickness), np.repeat(np.arange(len(path)), 6)


def _octahedra(centers, radius):
    """An octahedron at each of centers (n, 3): points (6n, 3) and triangles (8n, 3)."""
    tips = radius * np.vstack([np.eye(3), -np.eye(3)])
    faces = np.array([(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)])
    offsets = 6 * np.arange(len(centers))
    return (centers[:, None] + tips).reshape(-1, 3), (offsets[:, None, None] + faces).reshape(-1, 3)
