# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A pebble 64 mm long to try things on: pebble.ply, its mesh in meters, and contacts.csv, in millimeters.

    python examples/pebble.py [FOLDER]

The contacts are those of three curves through the pebble's top and of five strokes that do not pass through
it. They and their normals are noisy. FOLDER is that of this script if it is not given.
"""

import sys
from pathlib import Path

import numpy as np

HALF_AXES = np.array([32.0, 24.0, 17.0])  # mm
# Each bump: its direction, its height as a share of the radius, and its width in radians.
BUMPS = (((0.8, 0.3, 0.5), 0.10, 0.7), ((-0.5, 0.6, 0.4), -0.08, 0.7), ((-0.2, -0.8, -0.5), 0.12, 0.7))
NOISE, NORMAL_STD = 0.05, 0.02  # mm and radians
SUBDIVISIONS = 4


def surface(directions):
    """The points (n, 3) of the pebble in unit directions (n, 3) from its center, in mm."""
    shares = np.ones(len(directions))
    for center, height, width in BUMPS:
        cosines = directions @ (np.array(center) / np.linalg.norm(center))
        shares += height * np.exp((cosines - 1.0) / width**2)
    radii = shares / np.linalg.norm(directions / HALF_AXES, axis=1)
    return radii[:, None] * directions


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def normals_at(directions, step=1e-5):
    """Outward unit normals (n, 3) of the pebble there, by central differences along two tangents."""
    one = unit(np.cross(directions, [0.3, 0.9, 0.1]))
    two = np.cross(directions, one)
    across = [surface(unit(directions + step * t)) - surface(unit(directions - step * t)) for t in (one, two)]
    return unit(np.cross(*across))


def icosphere():
    """Unit directions (n, 3) and triangles (m, 3): an icosahedron whose triangles are quartered."""
    golden = (1.0 + 5.0**0.5) / 2.0
    rectangle = np.array([[0.0, a, b] for a in (-1.0, 1.0) for b in (-golden, golden)])
    points = unit(np.vstack([np.roll(rectangle, shift, axis=1) for shift in range(3)]))
    i, j, k = (each.ravel() for each in np.indices((12, 12, 12)))
    gaps = [np.linalg.norm(points[a] - points[b], axis=1) for a, b in ((i, j), (j, k), (k, i))]
    near = (i < j) & (i < k) & (np.abs(np.array(gaps) - min(gaps[0][gaps[0] > 0])) < 1e-9).all(axis=0)
    triangles = np.column_stack([i, j, k])[near]
    a, b, c = points[triangles].transpose(1, 0, 2)
    triangles = triangles[np.einsum("ij,ij->i", np.cross(b - a, c - a), a) > 0.0]
    for _ in range(SUBDIVISIONS):
        points, triangles = quartered(points, triangles)
    return points, triangles


def quartered(points, triangles):
    sides = np.sort(
        np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1
    )
    edges, places = np.unique(sides, axis=0, return_inverse=True)
    a, b, c = triangles.T
    ab, bc, ca = places.reshape(3, -1) + len(points)
    corners = ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))
    points = np.vstack([points, unit(points[edges].sum(axis=1))])
    return points, np.vstack([np.column_stack(corner) for corner in corners])


def write_mesh(path):
    directions, triangles = icosphere()
    faces = np.empty(len(triangles), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(directions)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    vertices = (surface(directions) / 1000.0).astype("<f4")
    path.write_bytes(head.encode() + vertices.tobytes() + faces.tobytes())


def felt():
    """Yields the name and the directions of each curve: three through the top, and five strokes."""
    angles = np.linspace(-0.5, 0.5, 25)
    for name, azimuth in enumerate(np.radians([0.0, 60.0, 120.0]), 1):
        way = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        yield name, np.cos(angles)[:, None] * [0.0, 0.0, 1.0] + np.sin(angles)[:, None] * way
    for name, across in enumerate(np.linspace(-0.4, 0.4, 5), 1):
        along = np.linspace(-0.5, 0.5, 33)
        yield (
            f"stroke {name}",
            unit(np.column_stack([along, np.full(33, across + 0.02), np.ones(33)])),
        )


def write_contacts(path, seed=1):
    rng = np.random.default_rng(seed)
    lines = [
        "# Tactile Patch contacts, version 3, lengths in mm",
        f"# noise {NOISE}",
        "curve,x [mm],y [mm],z [mm],nx,ny,nz",
    ]
    for name, directions in felt():
        points = surface(directions) + rng.normal(0.0, NOISE, directions.shape)
        normals = unit(normals_at(directions) + rng.normal(0.0, NORMAL_STD, directions.shape))
        for point, normal in zip(points, normals, strict=True):
            numbers = [*(f"{x:.3f}" for x in point), *(f"{x:.3f}" for x in normal)]
            lines.append(",".join([str(name), *numbers]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    write_mesh(folder / "pebble.ply")
    write_contacts(folder / "contacts.csv")
