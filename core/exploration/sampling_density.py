# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How many contacts half curves of a given extent begin with, and whether a shorter step would help."""

from ..bayes.joint_fit import MISFIT
from ..bayes.roughness import EXPLAINED_TERMS
from ..reconstruction.result import Reconstruction

# benchmarks.amount of e20b52a chose these.
CONTACTS = 12  # A half curve of a given extent has this many contacts,
DENSER = (1, 2, 4)  # and any the first of these multiples that suffices.


def suffices(r: Reconstruction) -> bool:
    """Whether noise makes at most half of the mean variance of the height, which more contacts would lower.

    The other half comes from directions in which these curves have no contacts. More contacts do not help
    either if the deviation is less than any polynomial is off a surface.
    """
    by_noise = EXPLAINED_TERMS * float(r.posterior.noise * r.radius) ** 2 / len(r.contacts)
    return r.mean_height_std <= MISFIT * r.radius or by_noise <= 0.5 * r.mean_height_std**2
