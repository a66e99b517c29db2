# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How many contacts half curves of a given extent begin with, and whether a shorter step would help."""

import numpy as np

from ..bayes.joint_fit import MISFIT
from ..bayes.process_fit import MOST_PLACES
from ..lapack import cholesky, solved
from ..reconstruction.result import Reconstruction

# benchmarks.amount of e20b52a chose these.
CONTACTS = 12  # A half curve of a given extent has this many contacts,
DENSER = (1, 2, 4)  # and any the first of these multiples that suffices.
# More contacts help if twice as many would lower the mean deviation of the height by the share NOTICEABLE.
NOTICEABLE = 0.15


def suffices(r: Reconstruction) -> bool:
    """Whether twice as many contacts would take less than NOTICEABLE off the mean deviation of the height.

    They would not if this deviation is less than any polynomial is off a surface, nor if it is larger than
    the noise: then it comes from directions in which these curves have no contacts.
    """
    if r.mean_height_std <= MISFIT * r.radius or r.posterior.noise * r.radius <= r.mean_height_std:
        return True
    (points, weights), contacts = r.domain.nodes, r.contacts[:, :2]
    m = min(len(contacts), MOST_PLACES)
    places = contacts[np.linspace(0, len(contacts) - 1, m).astype(np.intp)] / r.radius
    nodes = points / r.radius
    shared, covariance = r.posterior.covariances_with(nodes)(places)
    # A patch by another method departs from the posterior's mean, and more contacts do not lower that.
    variance = (r.node_stds / r.radius if r.method == "bayes" else r.posterior.height_std(*nodes.T)) ** 2
    covariance.flat[:: m + 1] += r.posterior.noise**2 * m / len(contacts)
    whitened = solved(cholesky(covariance), shared)  # Rasmussen and Williams 2006, algorithm 2.1
    lost = r.widening(r.domain.node_places) ** 2 * np.einsum("in,in->n", whitened, whitened)
    mean_std = weights @ np.sqrt(np.maximum(variance - lost, 0.0))
    return bool(mean_std >= (1.0 - NOTICEABLE) * (weights @ np.sqrt(variance)))
