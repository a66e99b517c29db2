# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface patches from tracked contours, after Jia and Tian: numpy and scipy, no Blender.

Points are rows (n, 3), frames are columns (d1, d2, n), lengths are in the caller's unit, and a
convex body has negative curvatures under its outward normal.
"""

from .coefficients import SOLVERS
from .common_point import common_point, in_running_order
from .contour import CREASE, EXTENT, NO_CONTACT, NOT_MONGE, UNEXPLAINED, Contour, SamplingPlane
from .deviations import mean_height_stds, with_height_stds
from .domain import Domain
from .exploration import Exploration, explore
from .geometry import Geometry, distances, fit_error, overlapped
from .local_geometry import DegenerateCurvesError, Frame
from .monge import MongePatch
from .next_plane import azimuth_of, suggest_plane
from .reconstruction import METHODS, reconstruct, reconstruct_many
from .registration import Pose, register
from .result import Reconstruction
from .sampling import spaced
from .serialization import from_dict, to_dict
from .tracking import Surface, track
from .verification import reachable, verify

__all__ = [
    "CREASE",
    "EXTENT",
    "METHODS",
    "NOT_MONGE",
    "NO_CONTACT",
    "SOLVERS",
    "UNEXPLAINED",
    "Contour",
    "DegenerateCurvesError",
    "Domain",
    "Exploration",
    "Frame",
    "Geometry",
    "MongePatch",
    "Pose",
    "Reconstruction",
    "SamplingPlane",
    "Surface",
    "azimuth_of",
    "common_point",
    "distances",
    "explore",
    "fit_error",
    "from_dict",
    "in_running_order",
    "mean_height_stds",
    "overlapped",
    "reachable",
    "reconstruct",
    "reconstruct_many",
    "register",
    "spaced",
    "suggest_plane",
    "to_dict",
    "track",
    "verify",
    "with_height_stds",
]
