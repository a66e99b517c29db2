# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Small objects to touch, and what is in the folder of a data set."""

from pathlib import Path

import numpy as np

# A block takes half a second on these objects, so that something can happen in the middle.
FEW = ("--touches", "30", "--block", "10", "--limit", "120")


def write_ball(path, radii=(1.0, 1.0, 1.0), rings=24):
    """An ellipsoid as .ply."""
    azimuth, polar = np.meshgrid(
        2.0 * np.pi * np.arange(2 * rings) / (2 * rings), np.pi * (np.arange(rings) + 0.5) / rings
    )
    ball = np.stack(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1
    ).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(2 * rings), np.arange(rings - 1))
    return _write_grid(path, ball * radii, i, j, 2 * rings, rings)


def write_torus(path, large=1.0, small=0.4, n=48):
    """A torus around z as .ply."""
    u, v = np.meshgrid(2.0 * np.pi * np.arange(2 * n) / (2 * n), 2.0 * np.pi * np.arange(n) / n)
    out = large + small * np.cos(v)
    points = np.stack([out * np.cos(u), out * np.sin(u), small * np.sin(-v)], axis=-1).reshape(-1, 3)
    return _write_grid(path, points, *np.meshgrid(np.arange(2 * n), np.arange(n)), 2 * n, n)


def _write_grid(path, points, i, j, n, rings):
    corners = [(j + down) % rings * n + (i + right) % n for down, right in ((0, 0), (1, 0), (1, 1), (0, 1))]
    quads = np.stack(corners, axis=-1).reshape(-1, 4)
    head = ["ply", "format ascii 1.0", f"element vertex {len(points)}"]
    head += [f"property float {axis}" for axis in "xyz"]
    head += [f"element face {len(quads)}", "property list uchar int vertex_indices", "end_header"]
    lines = [" ".join(f"{v:.7g}" for v in row) for row in points]
    lines += ["4 " + " ".join(map(str, row)) for row in quads]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join([*head, *lines]) + "\n")
    return path


def blocks_of(folder, parts="touches"):
    """The files of touches, or of surfaces, sorted by name."""
    return sorted((Path(folder) / parts).glob("[!.]*.parquet"))


def rows_of(folder, parts="touches"):
    """All rows in order, as bytes."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    stored = pa.concat_tables(
        pq.read_table(path).replace_schema_metadata(None) for path in blocks_of(folder, parts)
    )
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, stored.schema) as writer:
        writer.write_table(stored.combine_chunks())
    return sink.getvalue().to_pybytes()


def nothing_is_aside(folder):
    return not list((Path(folder) / "touches").glob(".*"))
