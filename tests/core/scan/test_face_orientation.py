# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which meshes have faces that point inward or lie on others, and where meshes are open."""

import tracemalloc

import numpy as np
import pytest

from core.scan import face_orientation
from core.scan.face_orientation import DOUBLED, INWARD, open_edge_distance, orientation_fault

BOX = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def mesh(*parts):
    """The arguments for all parts, (points, faces), as one mesh."""
    points, corners, lengths, count = [], [], [], 0
    for places, faces in parts:
        points.append(places)
        corners += [count + i for face in faces for i in face]
        lengths += map(len, faces)
        count += len(places)
    return np.vstack(points), np.array(corners), np.cumsum([0, *lengths[:-1]])


def fault(*parts):
    return orientation_fault(*mesh(*parts))


def turned(faces):
    return [face[::-1] for face in faces]


def soup(points, faces):
    """The faces without common vertices, as an STL file has them."""
    return points[np.concatenate(faces)], [
        (4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3) for i in range(len(faces))
    ]


def ball(n=24):
    """A unit sphere of quads that spans its poles, a part of which rows of faces are."""
    latitude, azimuth = np.pi * np.arange(n + 1) / n, 2.0 * np.pi * np.arange(2 * n) / (2 * n)
    points = np.array([
        (np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v)) for v in latitude for u in azimuth
    ])  # fmt: skip
    points[np.abs(points) < 1e-12] = 0.0
    faces = [
        (
            2 * n * i + j,
            2 * n * (i + 1) + j,
            2 * n * (i + 1) + (j + 1) % (2 * n),
            2 * n * i + (j + 1) % (2 * n),
        )
        for i in range(n)
        for j in range(2 * n)
    ]
    return points, faces


SOUP = soup(BOX, QUADS)
SPHERE, FACES = ball()
SHEET = np.array([(x, y, 0.1 * np.sin(3.0 * x * y)) for x in range(5) for y in range(5)])
SQUARES = [(5 * i + j, 5 * i + j + 5, 5 * i + j + 6, 5 * i + j + 1) for i in range(4) for j in range(4)]


@pytest.mark.parametrize("shift", [0.0, 1e4])
@pytest.mark.parametrize(
    "parts",
    [
        [(BOX, QUADS)],
        [SOUP],
        [(SPHERE, FACES)],
        [(SPHERE, FACES[: len(FACES) // 2])],
        [(SHEET, SQUARES)],
        [(SHEET, turned(SQUARES))],
        [(BOX, QUADS), (4.0 + 0.5 * BOX, QUADS)],
        [(BOX, QUADS), (0.5 * BOX, turned(QUADS))],
        [(BOX, QUADS), (0.9 + 0.5 * BOX, QUADS)],
        [(BOX, QUADS), (0.5 * BOX, turned(QUADS)), (0.2 * BOX, QUADS)],
        [(BOX, QUADS), (SPHERE, FACES[::3])],
        [(np.zeros((3, 3)), [(0, 1, 2)])],
    ],
    ids=[
        "box",
        "soup",
        "ball",
        "bowl",
        "sheet",
        "below",
        "apart",
        "cavity",
        "across",
        "nested",
        "loose",
        "point",
    ],
)
def test_right_faces_are_no_fault(parts, shift):
    assert fault(*((shift + points, faces) for points, faces in parts)) == ""


@pytest.mark.parametrize(
    "parts",
    [
        [(BOX, turned(QUADS))],
        [soup(BOX, turned(QUADS))],
        [(SPHERE, turned(FACES))],
        [(SPHERE, turned(FACES[48:]))],
        [(BOX, QUADS), (4.0 + 0.5 * BOX, turned(QUADS))],
        [(BOX, turned(QUADS)), (0.5 * BOX, QUADS)],
        [(BOX, [*QUADS[:5], QUADS[5][::-1]])],
        [(SPHERE, FACES[:500] + turned(FACES[500:]))],
        [(SHEET, SQUARES[:7] + turned(SQUARES[7:8]) + SQUARES[8:])],
    ],
    ids=["box", "soup", "ball", "hole", "apart", "cavity", "one", "half", "sheet"],
)
def test_faces_that_point_inward_are_found(parts):
    assert fault(*parts) == INWARD


@pytest.mark.parametrize("points", [BOX, BOX[np.arange(8)] + 3.0])
def test_faces_on_others_are_found(points):
    assert fault((points, QUADS), (points, turned(QUADS))) == DOUBLED
    assert fault((points, QUADS + turned(QUADS))) == DOUBLED


def test_faces_on_others_that_face_the_same_way_are_felt_as_one():
    assert fault((BOX, QUADS), (BOX, QUADS)) == ""


def test_a_few_faces_on_others_are_no_doubled_mesh():
    few = len(FACES) // 200
    assert fault((SPHERE, FACES + turned(FACES[300 : 300 + few]))) == ""


def test_edges_of_one_face_are_open():
    assert np.isinf(open_edge_distance(*mesh(SOUP), (0.0, 0.0, 2.0)))
    open_box = mesh((BOX, QUADS[:5]))
    assert open_edge_distance(*open_box, (0.25, 0.0, 1.0)) == 0.75
    assert open_edge_distance(*open_box, (4.0, 5.0, 1.0)) == 5.0


@pytest.mark.parametrize(
    ("parts", "found"),
    [
        ([(BOX, QUADS), (0.5 * BOX, turned(QUADS))], ""),
        ([(BOX, QUADS), (4.0 + 0.5 * BOX, turned(QUADS))], INWARD),
        ([(SPHERE, turned(FACES[48:]))], INWARD),
        ([(BOX, QUADS), (BOX, turned(QUADS))], DOUBLED),
    ],
)
def test_sides_in_parts_are_looked_at_as_all_together(monkeypatch, parts, found):
    for at_once in (1, 5, 24):
        monkeypatch.setattr(face_orientation, "SIDES_AT_ONCE", at_once)
        assert fault(*parts) == found


def test_edges_of_a_million_vertices_are_told_apart():
    """In 32 bits, 4096 times the number of vertices is 0."""
    points = np.random.default_rng(0).uniform(size=(2**20, 3))
    corners = np.array([0, 5000, 5001, 4096, 5001, 5000], dtype=np.int32)
    sides = face_orientation._sides_of(points, corners, np.array([0, 3], dtype=np.int32))
    assert (len(sides.rims), len(sides.pairs)) == (4, 1)


def test_a_look_at_many_faces_takes_little_memory(monkeypatch):
    """Ten million faces took 12 GB, three times what Blender needs to touch them."""
    monkeypatch.setattr(face_orientation, "SIDES_AT_ONCE", 10_000)
    x, y = np.meshgrid(*[np.linspace(-1.0, 1.0, 301, dtype=np.float32)] * 2)
    points = np.column_stack([x.ravel(), y.ravel(), (9.0 - x**2 - y**2).ravel()])
    first = (301 * np.arange(300)[:, None] + np.arange(300)).ravel()
    corners = (first[:, None] + np.array([0, 1, 302, 301])).ravel().astype(np.int32)
    assert fault((BOX, QUADS)) == ""  # Imports take memory, too.
    tracemalloc.start()
    try:
        assert orientation_fault(points, corners, np.arange(0, len(corners), 4, dtype=np.int32)) == ""
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 300 * len(first)
