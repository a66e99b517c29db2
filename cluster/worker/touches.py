# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The touches of a block as rows, which are the same wherever they are made."""

from collections.abc import Iterator
from time import process_time
from typing import Any

import numpy as np

from ..data_set.options import Options
from ..extension import addon, core
from .objects import Touchable

touch_object = addon("touch.touch_object")
BATCH = 50  # This many touches are felt and fitted side by side.


def touched(target: Touchable, options: Options, block: int) -> tuple[list[dict[str, Any]], float]:
    """The rows of a block of touches, and the seconds of processor time that they took.

    Raises ValueError, with a sentence, for lengths that no touch of the object can have.
    """
    start, facts = process_time(), target.facts
    _require_lengths(target, options)
    common = {"object": facts["name"], "hash": facts["hash"], "block": block, "seed": options.seed}
    rows = []
    for number, row in zip(options.numbers(block), _rows(target, options, block), strict=True):
        rows.append(common | {"touch": number} | row)
    return rows, process_time() - start


def _rows(target: Touchable, options: Options, block: int) -> Iterator[dict[str, Any]]:
    rng = np.random.default_rng([options.seed, int(target.facts["hash"], 16), block])
    size, count = target.facts["size"], len(options.numbers(block))
    noise = options.length("noise", size)
    points, outward = target.places(count, rng)
    for start in range(0, count, BATCH):
        batch = slice(start, start + BATCH)
        found = core.explore_many(
            target.surface,
            points[batch],
            outward[batch],
            options.planes(),
            farthest=touch_object.FARTHEST_SHARE * size,
            rng=rng,
            **options.exploration(size),
        )
        for point, up, each in zip(points[batch], outward[batch], found, strict=True):
            row = {"location": point + target.offset, "outward": up, "noise": noise}
            if isinstance(each, ValueError):
                yield row | {"status": "refused", "message": str(each)}
            else:
                yield row | _row(target, each)


def _row(target: Touchable, found: Any) -> dict[str, Any]:
    """What a touch has found, as a row."""
    r, contours = found.result, found.result.contours
    return {
        "status": r.status,
        "message": r.message,
        "origin": r.frame.origin + target.offset,
        "axes": r.frame.axes.T.ravel(),
        "k1": r.patch.k1,
        "k2": r.patch.k2,
        "coefficients": r.patch.coefficients,
        "domain": r.domain.ends.ravel(),
        "height_std": r.mean_height_std,
        **{name: getattr(r, name) for name in ("radius", "k1_std", "k2_std")},
        "contacts": (np.vstack([c.points for c in contours]) + target.offset).ravel(),
        "normals": np.vstack([c.normals for c in contours]).ravel().astype(np.float32),
        "curves": [len(c.points) for c in contours],
        "azimuths": [plane.azimuth for plane in found.planes],
        "tilts": [plane.tilt for plane in found.planes],
        "stops": [stop for c in contours for stop in c.stops],
        "extent": found.extent,
        "step": found.step,
        "mesh_error": r.taps.height,
    }


def _require_lengths(target: Touchable, options: Options) -> None:
    size = target.facts["size"]
    extent, step, noise = (options.length(name, size) or 0.0 for name in ("extent", "step", "noise"))
    touch_object.require_lengths(target.facts["name"], size, extent, step, noise)
    finest = step or extent / touch_object.LEAST_STEPS or touch_object.FINEST_STEP * size
    touch_object.require_fine(target.surface.spacing, finest)
