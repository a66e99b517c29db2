# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a touch has enough contacts, or should be felt again with a shorter step."""

import numpy as np

from ..bayes.joint_fit import MISFIT
from ..bayes.residual_evidence import MOST_PLACES
from ..patch.residual import cholesky, solved
from ..reconstruction.result import Reconstruction

# benchmarks.amount judges these.
NOTICEABLE = 0.15  # Share of the mean deviation of the height that twice as many contacts must take off.
QUIET = 1.0  # of it: if contacts scatter by less, twice as many take nothing noticeable off


def is_enough(r: Reconstruction) -> bool:
    """Whether twice as many contacts would take less than NOTICEABLE off the mean deviation of the height.

    They would tell nothing where that is less than a polynomial may be off, nor where it is more than
    contacts scatter: then it is what no contact tells that makes it large.
    """
    if r.mean_height_std <= MISFIT * r.radius or r.uncertainty.noise * r.radius <= QUIET * r.mean_height_std:
        return True
    (points, weights), contacts = r.domain.nodes, r.contacts[:, :2]
    if r.residual is None:
        which = np.linspace(0, len(contacts) - 1, min(len(contacts), MOST_PLACES)).astype(np.intp)
        some = contacts[which] / r.radius
    else:
        some = r.residual.places
    over, m = points / r.radius, len(some)
    shared, seen = r.uncertainty.covariances_with(over)(some)
    # A patch by another method departs from the posterior's mean, of which no contact takes anything off.
    own = r.node_stds / r.radius if r.joint_posterior is not None else r.uncertainty.height_std(*over.T)
    variance = own**2
    seen.flat[:: m + 1] += r.uncertainty.noise**2 * m / len(contacts)
    told = solved(cholesky(seen), shared)
    lost = r.geometry.node_widening**2 * np.einsum("in,in->n", told, told)
    then = weights @ np.sqrt(np.maximum(variance - lost, 0.0))
    return bool(then >= (1.0 - NOTICEABLE) * (weights @ np.sqrt(variance)))
