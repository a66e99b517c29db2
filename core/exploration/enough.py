# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How many contacts a touch begins with, and whether it should be felt again with a shorter step."""

import numpy as np
from numpy.typing import NDArray

from ..arguments import Array
from ..bayes.joint_fit import MISFIT
from ..bayes.process_fit import MOST_PLACES
from ..lapack import cholesky, solved
from ..reconstruction.result import Reconstruction

# benchmarks.amount chose these.
CONTACT_COUNTS = (12, 24, 48)  # The longest half curve has the first of these numbers that is enough.
SHORTEST = 4  # The shortest half curve has at least so many contacts.
# More contacts are worth feeling if twice as many would lower the mean
# deviation of the height by the share NOTICEABLE. They cannot, if noise is below QUIET times that deviation.
NOTICEABLE = 0.15
QUIET = 1.0


def is_enough(r: Reconstruction) -> bool:
    """Whether twice as many contacts would take less than NOTICEABLE off the mean deviation of the height.

    They would tell nothing if this deviation is less than any polynomial is off a surface, nor if it is
    larger than the noise: then it comes from directions that no contact of these curves tells of.
    """
    if r.mean_height_std <= MISFIT * r.radius or r.posterior.noise * r.radius <= QUIET * r.mean_height_std:
        return True
    (points, weights), contacts = r.domain.nodes, r.contacts[:, :2]
    some = r.posterior.places
    if not len(some):
        which = np.linspace(0, len(contacts) - 1, min(len(contacts), MOST_PLACES)).astype(np.intp)
        some = contacts[which] / r.radius
    over, m = points / r.radius, len(some)
    shared, seen = r.posterior.covariances_with(over)(some)
    # A patch by another method departs from the posterior's mean, and more contacts do not lower that.
    own = r.node_stds / r.radius if r.method == "bayes" else r.posterior.height_std(*over.T)
    variance = own**2
    seen.flat[:: m + 1] += r.posterior.noise**2 * m / len(contacts)
    told = solved(cholesky(seen), shared)
    lost = r.widening(r.domain.node_places) ** 2 * np.einsum("in,in->n", told, told)
    then = weights @ np.sqrt(np.maximum(variance - lost, 0.0))
    return bool(then >= (1.0 - NOTICEABLE) * (weights @ np.sqrt(variance)))


def stride_of(counts: NDArray[np.intp]) -> int:
    """The number of steps from one fitted contact to the next, of half curves of so many (c, 2)."""
    return max(1, int(spacing(counts, CONTACT_COUNTS[0])))


def spacing(reaches: Array | NDArray[np.intp], count: int) -> float:
    """The step at which the longest half curve (c, 2) has `count` contacts, the shortest SHORTEST or more."""
    longest = float(reaches.max())
    shortest = float(np.where(reaches > 0, reaches, longest).min())
    return min(longest / count, max(shortest / SHORTEST, longest / CONTACT_COUNTS[-1]))
