# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tables of whole objects share: atlases of any touches, distances from a mesh, screened Poisson."""

import numpy as np

import core
from core.atlas.join import charts_of, refit
from core.atlas.object_atlas import Atlas, joined_surface
from core.steps import result_of

NOISE = 0.0005
LAYERS = 4
EDGE = 0.008  # The length of an edge of the mesh; those of Poisson at depth 8 are half as long.


def touched_all_over(thing, start, tolerance, **options):
    """(atlas, explorations, number of touches made) of core.touch_all_over, from (point, normal) on."""
    steps = core.touch_all_over(thing, *start, tolerance=tolerance, noise=NOISE, **options)
    found, done = [], 0
    try:
        while True:
            progress = next(steps)
            found, done = found + list(progress.found), progress.done
    except StopIteration as end:
        return end.value, found, done


def put_together(found, tolerance):
    """The atlas of explorations, joined as they are, without a search for places that were not felt."""
    results = [e.result for e in found]
    charts = charts_of(results, deviations=False)
    charts = result_of(refit([e.contours for e in found], results, charts, NOISE, {}))
    return Atlas(tuple(results), charts, result_of(joined_surface(results, charts, tolerance)), tolerance)


def contacts_of(found, taps=()):
    """The different contacts of explorations and of taps, and their normals, (n, 3) each."""
    contours = [*(c for e in found for c in e.contours), *taps]
    points = np.vstack([c.points for c in contours])
    normals = np.vstack([c.normals for c in contours])
    points, first = np.unique(points, axis=0, return_index=True)
    return points, normals[first]


def tree_of(vertices, triangles):
    """Blender's tree of the triangles of a mesh."""
    import bpy  # noqa: F401  # It brings mathutils.
    from mathutils.bvhtree import BVHTree

    return BVHTree.FromPolygons(
        np.asarray(vertices).tolist(), np.asarray(triangles).tolist(), all_triangles=True
    )


class Rays:
    """A mesh that answers rays."""

    def __init__(self, vertices, triangles):
        self.tree = tree_of(vertices, triangles)

    def ray_cast(self, origin, direction, distance):
        hit, normal, _, _ = self.tree.ray_cast(origin, direction, distance)
        return None if hit is None else (tuple(hit), tuple(normal))

    def above(self, r, flat):
        """Points (m, 3) of the mesh along the normal of r over the points `flat` (n, 2), where there are any.

        They are of the layers nearest to r whose outside is up.
        """
        up = r.frame.axes[:, 2]
        starts = r.frame.to_world(np.column_stack([flat, r.height(*flat.T)]))
        hits = [self._nearest(start, up, r.radius) for start in starts]
        return np.array([hit for hit in hits if hit is not None]).reshape(-1, 3)

    def _nearest(self, start, up, reach):
        """The hit of the layer nearest to `start` along `up` or -up whose outside is up, or None."""
        found = None
        for direction in (up, -up):
            gone = 0.0
            for _ in range(LAYERS):
                hit = self.ray_cast(start + gone * direction, direction, reach - gone)
                if hit is None:
                    break
                gone = abs(np.dot(np.subtract(hit[0], start), up))
                if np.dot(hit[1], up) > 0.0:
                    found, reach = hit[0], gone
                    break
                gone += 1e-4 * reach
                if gone >= reach:
                    break
        return found


def away(tree, points):
    """Distances (n,) of points (n, 3) from the triangles of a tree; 1 from one without triangles."""
    found = (tree.find_nearest(tuple(p))[3] for p in points)
    return np.array([1.0 if d is None else d for d in found])


def spread(points, count):
    """Indices of `count` of the points, each the farthest from those before it."""
    found, nearest = [0], np.linalg.norm(points - points[0], axis=1)
    while len(found) < count:
        found.append(int(np.argmax(nearest)))
        nearest = np.minimum(nearest, np.linalg.norm(points - points[found[-1]], axis=1))
    return found


def poisson(points, normals, depth, weight):
    """Vertices and triangles of the surface by screened Poisson reconstruction of pymeshlab."""
    meshes = cloud(points, normals)
    meshes.generate_surface_reconstruction_screened_poisson(
        depth=depth, fulldepth=5, pointweight=weight, threads=1
    )
    return matrices(meshes)


def cloud(points, normals):
    """A set of meshes of pymeshlab, with these points and normals as its only one."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=points, v_normals_matrix=normals))
    return meshes


def matrices(meshes):
    """Arrays of the mesh, taken before its set is gone."""
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix()
