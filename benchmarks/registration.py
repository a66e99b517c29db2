# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tracked contours whose place is unknown, put onto scans: core.register and the paper's exhaustive search.

`python -m benchmarks.registration [--cases N]`, from the root of a checkout, with the Python that `make chart`
has prepared. At random points (seeded, by area) of each scan, which is scaled to 100 mm, three contours of a
fifth of its size to either side are tracked with 0.1 mm of noise, moved by a random rigid motion,
reconstructed and registered. A place is right within 1 mm and 2 degrees.

The exhaustive search puts the reference point on every vertex, aligns the tangent planes, turns the contours
in steps of 5 degrees and takes the distances to the nearest vertices' planes; its best poses are then refined
as register's are. It judges what is ambiguous too: where a pose that is not right has less than 1.5 times
the residual of the true one.
"""

import argparse
import math
import sys
from statistics import median
from time import perf_counter

from . import SCANS_FOLDER, machine

import bpy  # noqa: F401  brings mathutils
import numpy as np
import trimesh
from mathutils.bvhtree import BVHTree
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import core
from core import registration

from .accuracy import table

SCANS = ("pear.ply", "bottle_bleach.ply", "asteroid_eros.ply", "bone_femur_proximal.stl")
SIZE, NOISE = 100.0, 0.1  # mm
SHARE = 0.2  # of the size, a half contour's extent
STEPS = 12
PLANES = [core.SamplingPlane(math.radians(azimuth)) for azimuth in (0.0, 60.0, 120.0)]
NEAR, TURN = 1.0, math.radians(2.0)  # mm
AMBIGUOUS = 1.5
FINE_TURNS = 72
FIRST, KEPT = 8, 500  # contacts that all poses are judged by first; poses that are refined


class Scan:
    """A scan of 100 mm, to touch."""

    def __init__(self, name):
        mesh = trimesh.load(SCANS_FOLDER / name)
        self.vertices = np.array(mesh.vertices - mesh.bounds.mean(axis=0)) * (SIZE / mesh.extents.max())
        self.faces = np.array(mesh.faces)
        self.tree = BVHTree.FromPolygons(self.vertices.tolist(), self.faces.tolist())

    def ray_cast(self, origin, direction, distance):
        point, normal, _, _ = self.tree.ray_cast(origin, direction, distance)
        return None if point is None or not any(normal) else (point, normal)

    def cases(self, count):
        """Reconstructions of touches, moved, with the rigid motions that bring them back."""
        rng = np.random.default_rng(0)
        corners = self.vertices[self.faces]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas = np.linalg.norm(across, axis=1)
        found = []
        while len(found) < count:
            face = rng.choice(len(areas), p=areas / areas.sum())
            point, normal = corners[face].mean(axis=0), across[face] / areas[face]
            turn, shift = Rotation.random(random_state=rng).as_matrix(), rng.uniform(-200.0, 200.0, 3)
            lengths = {"extent": SHARE * SIZE, "step": SHARE * SIZE / STEPS, "noise": NOISE}
            try:
                contours = core.track(self, point, normal, PLANES, **lengths, rng=rng)
                moved = [core.Contour((c.points - shift) @ turn, noise=NOISE) for c in contours]
                r = core.reconstruct((point - shift) @ turn, moved, outward=normal @ turn)
            except ValueError:  # an edge, a hole
                continue
            found.append((r, turn, shift))
        return found


def is_right(r, truth, pose):
    (turn, shift), (rotation, translation), p = truth, pose, r.frame.origin
    angle = np.arccos(np.clip((np.sum(turn * rotation) - 1.0) / 2.0, -1.0, 1.0))
    return np.linalg.norm(rotation @ p + translation - turn @ p - shift) <= NEAR and angle <= TURN


def true_residual(r, turn, shift, scan):
    """RMS distance of the contacts where they belong."""
    points = r.frame.to_world(r.contacts) @ turn.T + shift
    return math.sqrt(np.mean([scan.tree.find_nearest(point)[3] ** 2 for point in points]))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=20, help="of each scan (%(default)s)")
    options = parser.parse_args()
    for name in SCANS:
        scan = Scan(name)
        for i, (r, turn, shift) in enumerate(scan.cases(options.cases)):
            start = perf_counter()
            poses = core.register(r, scan.vertices, scan.faces)
            seconds = perf_counter() - start
            rights = [is_right(r, (turn, shift), (p.rotation, p.translation)) for p in poses]
            print(name, i, len(r.contacts), f"L {r.radius:.1f} true {true_residual(r, turn, shift, scan):.3f}", f"{seconds:.2f} s", rights.index(True) if any(rights) else "-",
                  poses[0].is_ambiguous, [f"{p.residual:.3f}" for p in poses], flush=True)


if __name__ == "__main__":
    main()
