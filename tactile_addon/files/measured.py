# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measured contacts from files, as a patch or a whole surface with a report; nothing in the scene changes."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from ... import core
from ...core.steps import part_of
from ..touch.touch_object import Touched, reference_axes, require_single
from ..touch.touch_report import TouchReport, measures, reconstruction_report, suggestion_report
from ..touch.types import Array, Point
from ..whole_object.whole_surface import WholeSurface
from . import contact_file

FLAT = 0.02  # A surface whose |k1 + k2| is less, in unit radius, bulges to no side.


def read(paths: Iterable[str | Path], unit: str, meters: float, whole: bool = False) -> core.Contacts:
    """The core.Contacts of files whose curves belong together.

    unit : of the numbers, as in core.UNIT_METERS; "FILE" for the unit that each file names; "NONE" to
        take numbers as they are, as is done for a file that names no unit
    meters : length of the world's unit in meters
    whole : whether they belong to one object and not to one patch, so that each may have its own point

    Raises ValueError if files name different reference points, and what contact_file.read raises.
    """
    contours, strokes, points, directions = [], [], [], []
    found = "" if unit in ("FILE", "NONE") else unit
    for path in paths:
        curves, named, point, outward, off_point = contact_file.read(path)
        named = {"FILE": named, "NONE": ""}.get(unit, unit)
        factor = core.UNIT_METERS[named] / meters if named else 1.0
        # Quotients such as 1 / 0.1 are not exact, but a file in the world's unit must stay as it is.
        factor = 1.0 if math.isclose(factor, 1.0, rel_tol=1e-6) else factor
        still = np.eye(3), np.zeros(3), np.zeros(3)
        contours += [curve.moved(factor, *still) for curve in curves]
        strokes += [stroke.moved(factor, *still) for stroke in off_point]
        points += [] if point is None else [[factor * x for x in point]]
        directions += [] if outward is None else [outward]
        found = named or found
    if not whole and any(not np.allclose(point, points[0], rtol=1e-12, atol=0.0) for point in points):
        raise ValueError("The files name different reference points: import them one by one")
    if any(np.dot(direction, directions[0]) <= 0.0 for direction in directions):
        directions = []  # They belong to different sides of the object.
    point, outward = (given[0] if given else None for given in (points, directions))
    return core.Contacts(contours, found, point, outward, tuple(strokes))


class MeasuredObject:
    """Measured contacts that are covered with patches and joined to a surface, step by step.

    whole : the WholeSurface, once the steps are done
    """

    def __init__(
        self,
        contacts: core.Contacts,
        *,
        outward: Sequence[float] | None,
        flip: bool,
        tolerance: float,
        noise: float,
    ) -> None:
        """Prepares core.Contacts.

        outward : a hint, a direction to the outer side where contacts have no normals; None for that of the
            files; `flip` takes the other side
        tolerance, noise : in the contours' unit; 0 has core.atlas_of choose, or the files

        Raises ValueError with a sentence for the user.
        """
        felt = [*contacts.contours, *contacts.strokes]
        outward = contacts.outward if outward is None else outward
        points = np.vstack([c.points for c in felt])
        sign, self._origin = -1.0 if flip else 1.0, np.mean(points, axis=0)
        reach = 0.5 * float(np.ptp(points, axis=0).max())
        if reach:  # If all contacts are in one place, core says that there are too few.
            require_single("surface", reach, self._origin)
        self._felt = [
            replace(
                c, points=c.points - self._origin, normals=None if c.normals is None else sign * c.normals
            )
            for c in felt
        ]
        self._outward = None if outward is None else sign * np.array(outward)
        self._tolerance, self._noise = tolerance, noise

    def steps(self) -> Iterator[float]:
        """Does everything, and yields the share that is done. Raises ValueError with a sentence."""
        steps = core.cover_contacts(
            self._felt,
            outward=self._outward,
            tolerance=self._tolerance or None,
            noise=self._noise or None,
        )
        self.whole = WholeSurface((yield from part_of(steps, 0.0, 0.5)), self._origin)
        yield from part_of(self.whole.steps(0.0), 0.5, 1.0)

    def report(self) -> dict[str, Any]:
        """What was found, as a dict of plain values."""
        return {
            "contacts": sum(len(contour.points) for contour in self._felt),
            **self.whole.report(),
            "tolerance": self._tolerance,
            "noise": self._noise,
        }


def fit(
    source: str,
    contacts: core.Contacts,
    *,
    point: Point | None = None,
    outward: Point | None = None,
    flip: bool = False,
    noise: float = 0.0,
    normal_std: float = 0.0,
    all_strokes: bool = False,
    radius: float = 0.0,
    **options: Any,
) -> Touched:
    """The patch that core.Contacts show, as a Touched without a surface.

    point : where the curves meet, exactly; None for the point of the file, or core.common_point. Without
        curves, a place among the strokes; None for the point of the file, or their mean
    all_strokes : whether curves count as strokes, too
    radius : without curves, contacts of strokes within this distance are used; 0 for all
    outward : None for the direction of the file or the mean of the normals. Without any, it is the side to
        which the surface bulges, or +z if it is flat; `flip` takes the other side
    noise, normal_std : in the contours' unit and in radians; 0 for those of the file. If the file has no
        normal_std either, normals are not fitted
    options : other arguments of core.reconstruct

    Raises ValueError with a sentence for the user.
    """
    start, options = perf_counter(), options | {"noise": noise or None, "radius": radius or None}
    contours, unit, of_file, up, strokes = _chosen(contacts, normal_std, all_strokes)
    point, outward = of_file if point is None else point, up if outward is None else outward
    distances: Array | None = None  # By how much curves miss the point.
    if point is None and contours:
        point, distances = core.common_point(contours)
    elif point is None:
        point = np.vstack([stroke.points for stroke in strokes]).mean(axis=0)
    contours, felt = [core.in_running_order(c, point) for c in contours], [*contours, *strokes]
    reconstruct = partial(core.reconstruct, point, contours, strokes=strokes, **options)
    unknown = outward is None and all(c.normals is None for c in felt)
    result = _on_a_side(reconstruct, outward, unknown, flip)
    require_single("patch", result.radius, result.frame.origin)
    axes = reference_axes(result.frame.axes[:, 2])
    report: TouchReport = {
        "source": source,
        "unit": unit,
        "curves": len(contours),
        "strokes": len(strokes),
        "given_contacts": sum(len(contour.points) for contour in felt),
        "method": options["method"],
        "degree": result.patch.degree,
        **reconstruction_report(result),
        "axes": axes.tolist(),
        "vertices": 0,
        **measures(result),
        "suggested_plane": suggestion_report(result, axes),
        **({} if distances is None else {"misses": distances.tolist()}),
    }
    return Touched(None, result, report | {"seconds": {"fit": perf_counter() - start}})


def _chosen(contacts: core.Contacts, normal_std: float, all_strokes: bool) -> core.Contacts:
    """The contacts of a fit, see there."""
    contours, strokes = contacts.contours, contacts.strokes
    if all_strokes:
        contours, strokes = [], (*contours, *strokes)
    if normal_std:
        contours = [c if c.normals is None else replace(c, normal_std=normal_std) for c in contours]
    return contacts._replace(contours=contours, strokes=strokes)


def _on_a_side(
    reconstruct: Callable[..., core.Reconstruction], outward: Point | None, unknown: bool, flip: bool
) -> core.Reconstruction:
    """The patch seen from `outward`, or, where the outer side is unknown, from where it bulges to."""
    result = reconstruct(outward=(0.0, 0.0, 1.0) if unknown else outward)
    bulges = (result.patch.k1 + result.patch.k2) * result.radius
    if flip is not (unknown and bulges > FLAT):
        result = reconstruct(outward=-result.frame.axes[:, 2])
    return result
