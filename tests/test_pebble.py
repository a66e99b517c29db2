# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The example's files are those that its script makes, and its contacts and normals are those of its mesh."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import core

EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    subprocess.run([sys.executable, EXAMPLES / "pebble.py", folder], check=True)
    return folder


def mesh(path):
    """Vertices (n, 3) and triangles (m, 3) of a mesh that pebble.py has written."""
    head, _, data = path.read_bytes().partition(b"end_header\n")
    counts = [int(line.split()[2]) for line in head.decode().splitlines() if line.startswith("element")]
    vertices = np.frombuffer(data, "<f4", 3 * counts[0]).reshape(-1, 3)
    faces = np.frombuffer(data[vertices.nbytes :], [("count", "u1"), ("corners", "<i4", 3)])
    assert len(faces) == counts[1]
    return vertices.astype(float), faces["corners"]


def test_the_files_are_those_that_the_script_makes(made):
    assert (made / "contacts.csv").read_text() == (EXAMPLES / "contacts.csv").read_text()
    found, wanted = (mesh(folder / "pebble.ply") for folder in (made, EXAMPLES))
    assert found[0] == pytest.approx(wanted[0], abs=1e-8)
    assert np.array_equal(found[1], wanted[1])
    assert (EXAMPLES / "pebble.ply").stat().st_size < 100_000


def test_the_mesh_is_closed_and_faces_outward():
    vertices, triangles = mesh(EXAMPLES / "pebble.ply")
    sides = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    assert len(np.unique(sides, axis=0)) == len(sides)
    assert {tuple(side) for side in sides} == {tuple(side) for side in sides[:, ::-1]}
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) > 0.0).all()


def test_contacts_are_on_the_mesh_within_their_noise():
    contacts = core.contacts_from_csv((EXAMPLES / "contacts.csv").read_text())
    assert (len(contacts.contours), len(contacts.strokes), contacts.unit) == (3, 5, "mm")
    vertices, triangles = mesh(EXAMPLES / "pebble.ply")
    a, b, c = 1e3 * vertices[triangles].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    gaps, turns = [], []
    for curve in (*contacts.contours, *contacts.strokes):
        nearest = np.argmin(np.linalg.norm(curve.points[:, None] - (a + b + c) / 3.0, axis=2), axis=1)
        gaps.append(np.einsum("ij,ij->i", curve.points - a[nearest], normals[nearest]))
        turns.append(np.einsum("ij,ij->i", curve.normals, normals[nearest]))
    # The mesh is up to 0.05 mm within the pebble.
    assert np.sqrt(np.mean(np.concatenate(gaps) ** 2)) < 0.08
    assert np.concatenate(turns).min() > np.cos(0.15)
