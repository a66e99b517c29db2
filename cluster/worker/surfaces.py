# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An object that is touched all over, as a row, which is the same wherever it is made."""

from time import process_time
from typing import Any

import bpy
import numpy as np

from ..data_set.columns import FOUND
from ..data_set.options import WholeOptions
from ..extension import addon
from .objects import Touchable

object_touches = addon("whole_object.object_touches")


def surface(target: Touchable, options: WholeOptions) -> tuple[dict[str, Any], float]:
    """The row of an object of the open file, and the seconds of processor time that it took.

    Raises ValueError, with a sentence, if it cannot be touched with these options.
    """
    start, facts = process_time(), target.facts
    touches = object_touches.ObjectTouches(
        target.obj,
        bpy.context.evaluated_depsgraph_get(),
        location=None,
        tolerance=options.length("tolerance", facts["size"]) or 0.0,
        accuracy="normal",
        noise=options.length("noise", facts["size"]),
        seed=[options.seed, int(facts["hash"], 16)],
        most=options.most,
        edge=0.0,
    )
    for _ in touches.steps():
        pass
    common = {"object": facts["name"], "hash": facts["hash"], "seed": options.seed}
    return common | _found(touches) | _mesh(touches.whole, target) | _graph(touches.whole.atlas, target), (
        process_time() - start
    )


def _found(touches: Any) -> dict[str, Any]:
    report = touches.report()
    names = ("noise", "touches", "in_doubt", *(name for name, *_ in FOUND))
    return {name: report[name] for name in ("status", "message", *names)}


def _mesh(whole: Any, target: Touchable) -> dict[str, Any]:
    mesh = whole.mesh
    return {
        "vertices": (mesh.vertices + target.offset).ravel(),
        "triangles": mesh.triangles.ravel(),
        "vertex_stds": mesh.std,
        "vertex_deviations": whole.deviation,
        "vertex_nodes": mesh.patch,
    }


def _graph(atlas: Any, target: Touchable) -> dict[str, Any]:
    patches = atlas.patches
    return {
        "origins": np.ravel([r.frame.origin + target.offset for r in patches]),
        "axes": np.ravel([r.frame.axes.T for r in patches]),
        "radii": [r.radius for r in patches],
        "k1": [r.patch.k1 for r in patches],
        "k2": [r.patch.k2 for r in patches],
        "k1_stds": [r.k1_std for r in patches],
        "k2_stds": [r.k2_std for r in patches],
        "height_stds": [r.mean_height_std for r in patches],
        "edges": np.ravel([edge.nodes for edge in atlas.edges]),
    }
