# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contours whose place is unknown, put onto scans: core.register compared with the paper's exhaustive search.

`python -m benchmarks.registration`, from the root of a checkout, with the Python that `make chart` has
prepared. At random points (seeded, by area) of each scan, scaled to 100 mm, three contours of a fifth of its
size to either side are tracked with 0.1 mm of noise, moved by a random rigid motion, reconstructed and
registered. A pose is right within 1 mm and 2 degrees.

The exhaustive search puts the reference point on every vertex, aligns the tangent planes, turns the contours
in steps of 10 degrees (their ends then move by no more than the scans' vertices are apart) and measures to
the planes of the nearest vertices; its best poses are refined as those of core.register are. It also decides
which cases are ambiguous: those where it finds a pose that is not right and has less than 1.5 times the
residual of the true one.

The command takes an hour, nearly all of it for the exhaustive search, which needs twenty seconds a case and
two minutes on the femur; `--cases 2` takes six minutes.
"""

import argparse
import math
import sys
from pathlib import Path
from statistics import median

import bpy  # noqa: F401  # It brings mathutils.
import numpy as np
import trimesh
from mathutils.bvhtree import BVHTree
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import core
from core.scan import pose_search, scanned_mesh
from tests import surfaces

from . import SCANS_FOLDER, machine, table, timed

SCANS = ("pear.ply", "bottle_bleach.ply", "asteroid_eros.ply", "bone_femur_proximal.stl")
SIZE, NOISE = 100.0, 0.1  # mm
SHARE = 0.2  # The extent as a share of the size.
STEPS = 12
PLANES = surfaces.planes((0, 60, 120))
NEAR, TURN = 1.0, math.radians(2.0)  # mm, radians
AMBIGUOUS = 1.5
FINE_TURNS = 36
FIRST, KEPT = 6, 300  # The number of contacts that judge all poses first, and of poses that are refined.
REFINED = 50  # The number of these poses that are refined further, to the nearest triangles.


class Scan:
    """A scan, scaled to 100 mm and centered, that can be touched."""

    def __init__(self, name):
        mesh = trimesh.load(SCANS_FOLDER / name)
        self.vertices = np.array(mesh.vertices - mesh.bounds.mean(axis=0)) * (SIZE / mesh.extents.max())
        self.faces = np.array(mesh.faces)
        self.tree = BVHTree.FromPolygons(self.vertices.tolist(), self.faces.tolist())

    def ray_cast(self, origin, direction, distance):
        point, normal, _, _ = self.tree.ray_cast(origin, direction, distance)
        return None if point is None or not any(normal) else (point, normal)

    def cases(self, count):
        """[(moved reconstruction, rotation (3, 3), shift (3,))], with the motions that bring them back."""
        rng = np.random.default_rng(0)
        corners = self.vertices[self.faces]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas = np.linalg.norm(across, axis=1)
        found = []
        while len(found) < count:
            face = rng.choice(len(areas), p=areas / areas.sum())
            point, normal = corners[face].mean(axis=0), across[face] / areas[face]
            turn, shift = Rotation.random(None, rng).as_matrix(), rng.uniform(-200.0, 200.0, 3)
            lengths = {"extent": SHARE * SIZE, "step": SHARE * SIZE / STEPS, "noise": NOISE}
            try:
                contours = core.track(self, point, normal, PLANES, **lengths, rng=rng)
                moved = [core.Contour((c.points - shift) @ turn, noise=NOISE) for c in contours]
                r = core.reconstruct((point - shift) @ turn, moved, outward=normal @ turn)
            except ValueError:  # There is an edge or a hole.
                continue
            found.append((r, turn, shift))
        return found


def is_right(r, truth, pose):
    (turn, shift), (rotation, translation), p = truth, pose, r.frame.origin
    angle = np.arccos(np.clip((np.sum(turn * rotation) - 1.0) / 2.0, -1.0, 1.0))
    return np.linalg.norm(rotation @ p + translation - turn @ p - shift) <= NEAR and angle <= TURN


def true_residual(r, turn, shift, scan):
    """The RMS distance of the contacts from the mesh, in the true pose."""
    points = r.frame.to_world(r.contacts) @ turn.T + shift
    return math.sqrt(np.mean([scan.tree.find_nearest(point)[3] ** 2 for point in points]))


class Exhaustive:
    """The paper's search, on one scan."""

    def __init__(self, scan):
        mesh = trimesh.Trimesh(scan.vertices, scan.faces, process=False)
        self.vertices, self.normals, self.faces = scan.vertices, np.array(mesh.vertex_normals), scan.faces
        self.axes = pose_search._axes(self.normals)
        self.tree = cKDTree(self.vertices)

    def places(self, contacts):
        """The KEPT best poses of all vertices and turns: axes (KEPT, 3, 3) and origins (KEPT, 3).

        A pose is dropped if a few contacts have a larger sum of squares than all contacts in the last of KEPT
        poses. No better pose is lost by that, because more contacts only add to the sum.
        """
        turn = 2.0 * np.pi / FINE_TURNS * np.arange(FINE_TURNS)
        about = Rotation.from_rotvec(turn[:, None] * [0.0, 0.0, 1.0]).as_matrix()
        few = np.linspace(0, len(contacts) - 1, FIRST).astype(int)
        vertex, turned = (i.ravel() for i in np.indices((len(self.vertices), FINE_TURNS)))
        first = self._squares(contacts[few], vertex, turned, about)
        best = np.argpartition(first, KEPT)[:KEPT]
        left = np.flatnonzero(first <= self._squares(contacts, vertex[best], turned[best], about).max())
        best = left[np.argsort(self._squares(contacts, vertex[left], turned[left], about))[:KEPT]]
        return self.axes[vertex[best]] @ about[turned[best]], self.vertices[vertex[best]]

    def _squares(self, contacts, vertex, turned, about):
        """Sums (n,) over contacts of squared distances to the planes of the nearest vertices, for n poses."""
        squares = []
        for start in range(0, len(vertex), 20000):
            v, t = vertex[start : start + 20000], turned[start : start + 20000]
            points = contacts @ (self.axes[v] @ about[t]).swapaxes(1, 2) + self.vertices[v, None]
            nearest = self.tree.query(points)[1]
            off = np.einsum("mni,mni->mn", points - self.vertices[nearest], self.normals[nearest])
            squares.append(np.sum(off**2, axis=1))
        return np.concatenate(squares)

    def search(self, r):
        """Poses, the best first, and their residuals."""
        axes, origins = self.places(r.contacts)
        touch = np.array([r.contacts / r.radius, r.patch.normal(*r.contacts[:, :2].T)])
        mesh = scanned_mesh.mesh_of(self.vertices / r.radius, self.faces.astype(np.intp), 1.0)
        places = np.concatenate([axes, origins[..., None] / r.radius], axis=2)
        for neighbors in (1, pose_search.NEAREST_TRIANGLES):
            places, residuals, _ = pose_search._registered(places, touch, mesh, neighbors, 10)
            kept = pose_search._distinct(places, residuals)[:REFINED]
            places, residuals = places[kept], residuals[kept]
        rotations = places[..., :3] @ r.frame.axes.T
        shifts = r.radius * places[..., 3] - rotations @ r.frame.origin
        return list(zip(rotations, shifts, strict=True)), r.radius * residuals


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=20, help="of each scan (%(default)s)")
    options = parser.parse_args()
    if not SCANS_FOLDER.is_dir():
        sys.exit(f"registration: there are no scans in {SCANS_FOLDER}")
    print("This takes about three minutes for each case of --cases.", file=sys.stderr)
    rows = [_row(name, options) for name in SCANS]
    head = (
        "scan, vertices|cases|right|s|slowest, s|exhaustive: right|s|better|ambiguous|right|exhaustive: right"
    )
    table([*head.split("|"), "said so", "said in vain"], rows)
    print(
        f"Half contours of {SHARE * SIZE:g} mm on objects of {SIZE:g} mm, noise {NOISE:g} mm. Both `right` "
        "before `ambiguous` count unambiguous cases, both after it ambiguous ones. `better` counts cases "
        "where the exhaustive search finds a residual that is 5 % less. `said so` and `said in vain` count "
        "the ambiguous and the unambiguous cases that core.register calls ambiguous. Times are medians, "
        f"{machine('numpy', 'scipy')}."
    )


def _row(name, options):
    """A row of the table."""
    scan = Scan(name)
    exhaustive = Exhaustive(scan)
    found = [_outcome(scan, exhaustive, r, truth) for r, *truth in scan.cases(options.cases)]
    ambiguous, right, said, exhausted, better, seconds, long = map(np.array, zip(*found, strict=True))
    clear = ~ambiguous
    return [
        f"{Path(name).stem}, {len(scan.vertices)}",
        f"{len(found)}",
        f"{right[clear].sum()} of {clear.sum()}",
        f"{median(seconds):.2f}",
        f"{seconds.max():.2f}",
        f"{exhausted[clear].sum()} of {clear.sum()}",
        f"{median(long):.1f}",
        f"{better.sum()}",
        f"{ambiguous.sum()}",
        f"{right[ambiguous].sum()}",
        f"{exhausted[ambiguous].sum()}",
        f"{said[ambiguous].sum()}",
        f"{said[clear].sum()}",
    ]


def _outcome(scan, exhaustive, r, truth):
    """What comes of one case: five booleans, and the seconds of both searches.

    The booleans tell whether it is ambiguous, whether core.register is right and calls it ambiguous, and
    whether the exhaustive search is right and has a clearly smaller residual.
    """
    seconds, (pose, *_) = timed(core.register, r, scan.vertices, scan.faces)
    long, (others, residuals) = timed(exhaustive.search, r)
    rights = np.array([is_right(r, truth, other) for other in others])
    return (
        bool((residuals[~rights] < AMBIGUOUS * true_residual(r, *truth, scan)).any()),
        is_right(r, truth, (pose.rotation, pose.translation)),
        pose.is_ambiguous,
        bool(rights[0]),
        bool(residuals[0] < 0.95 * pose.residual),
        seconds,
        long,
    )


if __name__ == "__main__":
    main()
