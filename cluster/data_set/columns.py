# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The columns of a data set: types, units and meanings, which are also in the metadata of each file."""

import pyarrow as pa

NUMBER, NUMBERS, WORD = pa.float64(), pa.list_(pa.float64()), pa.string()
REPEATED = pa.dictionary(pa.int32(), pa.string())
# Lengths are in the unit of the object's file, whatever that is.
LENGTH, PER_LENGTH = "object's unit", "1 / object's unit"
COUNTS = ("ok", "in_doubt", "refused", "error")

TOUCHES = (
    ("object", REPEATED, "", "name of the object"),
    ("hash", REPEATED, "", "hash of its geometry, which links rows to objects"),
    ("block", pa.int32(), "", "number of the task that made the row"),
    ("touch", pa.int64(), "", "number of the touch on its object, from 0"),
    ("seed", pa.int64(), "", "seed of the data set, which with hash and block determines places and noise"),
    ("status", REPEATED, "", "ok, uncertain or not_converged; refused: no patch there; error: no touch"),
    ("message", REPEATED, "", "the status in a sentence"),
    ("location", NUMBERS, LENGTH, "x, y, z of the reference point; all points are in the file's coordinates"),
    ("outward", NUMBERS, "", "unit normal of the face there"),
    ("origin", NUMBERS, LENGTH, "x, y, z of the origin of the patch's frame"),
    ("axes", NUMBERS, "", "d1, d2 and normal of the frame, three numbers each"),
    ("radius", NUMBER, LENGTH, "L, the largest distance of a contact from the origin in the tangent plane"),
    ("k1", NUMBER, PER_LENGTH, "smaller principal curvature, along d1; negative where convex"),
    ("k2", NUMBER, PER_LENGTH, "larger principal curvature, along d2"),
    ("k1_std", NUMBER, PER_LENGTH, "standard deviation of k1"),
    ("k2_std", NUMBER, PER_LENGTH, "standard deviation of k2"),
    ("height_std", NUMBER, LENGTH, "standard deviation of the heights, mean over the domain"),
    (
        "coefficients",
        NUMBERS,
        "1 / unit^(degree - 1)",
        "those of x^3, x^2 y, x y^2, y^3, x^4, ... of the patch",
    ),
    ("domain", NUMBERS, LENGTH, "x, y in the frame of the curves' ends, through which the rim runs"),
    ("contacts", NUMBERS, LENGTH, "x, y, z of each contact, curve after curve"),
    ("normals", pa.list_(pa.float32()), "", "x, y, z of the mesh's unit normal at each contact"),
    ("curves", pa.list_(pa.int32()), "", "number of contacts of each curve"),
    ("azimuths", NUMBERS, "rad", "azimuths of the sampling planes"),
    ("tilts", NUMBERS, "rad", "tilts of the sampling planes"),
    ("stops", pa.list_(REPEATED), "", "reason why each curve ended, at its start and at its end"),
    ("extent", NUMBER, LENGTH, "length of the longest half curve"),
    ("step", NUMBER, LENGTH, "distance between contacts"),
    ("noise", NUMBER, LENGTH, "standard deviation of the simulated sensor"),
    ("mesh_error", NUMBER, LENGTH, "mean distance in height of mesh and patch; null where there is none"),
)
OBJECTS = (
    ("object", WORD, "", "name of the mesh object in a .blend or .obj, or else of the file"),
    ("hash", WORD, "", "hash of its geometry; null where it could not be read"),
    ("file", WORD, "", "path of the file it was read from"),
    ("size", NUMBER, LENGTH, "longest edge of its bounding box"),
    ("unit", NUMBER, "m", "length of the object's unit; null where the file does not name one"),
    ("vertices", pa.int64(), "", "number of vertices of its evaluated mesh"),
    ("triangles", pa.int64(), "", "number of triangles of its evaluated mesh"),
    ("touches", pa.int64(), "", "number of touches on it; 1 where there is only an error"),
    *((name, pa.int64(), "", f"number of its touches that count as {name}") for name in COUNTS),
    ("seconds", NUMBER, "s", "processor time of its touches"),
    ("message", WORD, "", "message of its first error"),
)
INTEGERS = pa.list_(pa.int32())
FOUND = (
    ("tolerance", NUMBER, LENGTH, "standard deviation to reach for the height of each patch"),
    ("uncovered", pa.int64(), "", "number of places on rims beyond which the object goes on unfelt"),
    ("is_closed", pa.bool_(), "", "whether the surface is closed all round, with no rim left"),
    ("height_std", NUMBER, LENGTH, "standard deviation of the surface, mean over its vertices"),
    ("deviation_mean", NUMBER, LENGTH, "mean distance of surface and mesh, both ways"),
    ("deviation_max", NUMBER, LENGTH, "largest distance of surface and mesh, either way"),
)
SURFACES = (
    *TOUCHES[:2],
    ("seed", pa.int64(), "", "seed of the whole data set; with hash it determines beginning and noise"),
    ("status", WORD, "", "ok or uncertain; error: no surface"),
    ("message", WORD, "", "the status in a sentence"),
    ("noise", NUMBER, LENGTH, "standard deviation of the simulated sensor"),
    ("touches", pa.int64(), "", "number of touches that found a patch"),
    ("in_doubt", pa.int64(), "", "number of the patches that are in doubt"),
    *FOUND,
    ("vertices", NUMBERS, LENGTH, "x, y, z of each vertex of the surface, in the file's coordinates"),
    ("triangles", INTEGERS, "", "three vertices each, numbered from 0, counterclockwise from outside"),
    ("vertex_stds", NUMBERS, LENGTH, "standard deviation of the surface at each vertex"),
    ("vertex_deviations", NUMBERS, LENGTH, "distance of each vertex from the mesh, positive outside it"),
    ("vertex_nodes", INTEGERS, "", "node whose patch counts most at each vertex"),
    ("origins", NUMBERS, LENGTH, "x, y, z of the origin of each node's frame, in the file's coordinates"),
    ("axes", NUMBERS, "", "d1, d2 and normal of each node's frame, nine numbers each"),
    ("radii", NUMBERS, LENGTH, "L of each node's patch"),
    ("k1", NUMBERS, PER_LENGTH, "smaller principal curvature of each node"),
    ("k2", NUMBERS, PER_LENGTH, "larger principal curvature of each node"),
    ("k1_stds", NUMBERS, PER_LENGTH, "standard deviation of k1 of each node"),
    ("k2_stds", NUMBERS, PER_LENGTH, "standard deviation of k2 of each node"),
    ("height_stds", NUMBERS, LENGTH, "mean standard deviation of the height of each node's patch"),
    ("edges", INTEGERS, "", "edges of the graph: two nodes each, whose patches share a boundary"),
)


def _schema(columns: tuple[tuple[str, pa.DataType, str, str], ...]) -> pa.Schema:
    return pa.schema(
        pa.field(name, kind, metadata={"unit": unit, "description": meaning})
        for name, kind, unit, meaning in columns
    )


TOUCH_SCHEMA = _schema(TOUCHES)
# The schemas of the files in a folder, and of the file of objects next to it, by the folder's name.
SCHEMAS = {
    "touches": (TOUCH_SCHEMA, _schema(OBJECTS)),
    "surfaces": (_schema(SURFACES), _schema((*OBJECTS, *FOUND))),
}


def kind_of(status: str) -> str:
    """The count that a status belongs to."""
    return status if status in COUNTS else "in_doubt"
