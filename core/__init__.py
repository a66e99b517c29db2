# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface patches from tracked contours, after Jia and Tian: numpy and scipy, no Blender.

Points are rows (n, 3), frames are columns (d1, d2, n), and lengths are in the caller's unit. A convex body
has negative curvatures, because normals point outward.
"""

from .atlas.boundaries import Edge
from .atlas.curvature import vertices_shown
from .atlas.measured import atlas_of, cover_contacts
from .atlas.meshing import Mesh, shortest_edge
from .atlas.object_atlas import Atlas, NextTouch
from .atlas.samples import thinnest_wall
from .atlas.touching import Progress, covered_by, explore_object, touch_all_over
from .contact_data.comments import UNIT_METERS
from .contact_data.rows import Contacts
from .contact_data.table import contacts_from_csv, contacts_to_csv
from .contours.common_point import common_point, in_running_order
from .contours.contour import (
    CREASE,
    EXTENT,
    NO_CONTACT,
    NOT_MONGE,
    WHERE,
    Contour,
    SamplingPlane,
    stops_at,
)
from .contours.finger import Surface
from .contours.local_geometry import DegenerateCurvesError, Frame
from .contours.tracking import track
from .exploration.extent import Exploration
from .exploration.options import ExplorationOptions
from .exploration.taps import tapped
from .exploration.touches import explore, explore_many, exploring_many
from .paper.by_method import SOLVERS
from .patch.domain import Domain
from .patch.geometry import Geometry, distances, fit_error
from .patch.monge import MongePatch
from .reconstruction.deviations import gaussian_curvature_stds
from .reconstruction.facets import is_beside_bend, with_facets
from .reconstruction.from_contours import reconstruct, reconstruct_many
from .reconstruction.next_plane import suggest_plane
from .reconstruction.options import METHODS
from .reconstruction.result import Reconstruction
from .reconstruction.serialization import from_dict, to_dict
from .reconstruction.status import CONTRADICTING, DOUBTFUL_STD
from .scan.face_orientation import DOUBLED, INWARD, open_edge_distance, orientation_fault
from .scan.pose_search import Pose, register
from .scan.sampling import scattered, spaced, spaced_count
from .scan.verification import reachable, verify, verifying
from .verdict import FINER, SHORTER_EDGES, SUBDIVIDE, Doubt, status_of

__version__ = "0.1.0"  # That of blender_manifest.toml; python -m tools.release compares them.
# What a script may rely on, as docs/reference.md describes it. The other names are for the add-on.
__all__ = [
    "METHODS",
    "SOLVERS",
    "Atlas",
    "Contacts",
    "Contour",
    "DegenerateCurvesError",
    "Domain",
    "Doubt",
    "Edge",
    "Exploration",
    "Frame",
    "Geometry",
    "Mesh",
    "MongePatch",
    "NextTouch",
    "Pose",
    "Progress",
    "Reconstruction",
    "SamplingPlane",
    "Surface",
    "atlas_of",
    "common_point",
    "contacts_from_csv",
    "contacts_to_csv",
    "cover_contacts",
    "distances",
    "explore",
    "explore_many",
    "explore_object",
    "fit_error",
    "from_dict",
    "in_running_order",
    "reconstruct",
    "reconstruct_many",
    "register",
    "scattered",
    "spaced",
    "suggest_plane",
    "tapped",
    "to_dict",
    "touch_all_over",
    "track",
    "verify",
]
