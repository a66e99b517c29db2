# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Systems of up to a hundred unknowns by scipy's LAPACK, which is faster than numpy for a single one.

The numpy and scipy of PyPI each have their own OpenBLAS with its own threads. If they are called by turns,
these wait for each other's processors, and a touch takes twice as long, or ten times on a busy machine
(benchmarks.threads, e20b52a). So everything here runs on one thread, and a touch never calls numpy's `solve`
and `inv`, which wake threads even for three unknowns.
"""

from collections.abc import Callable
from functools import cache, wraps
from threading import Lock
from typing import Any, ParamSpec, TypeVar

import numpy as np

from .arguments import Array

P = ParamSpec("P")
R = TypeVar("R")
# The numbers of threads before each call that is under way, in any thread of Python: the last of them to end
# puts back what was there before the first.
_BEFORE: list[int] = []
_LOCK = Lock()


def on_one_thread(run: Callable[P, R]) -> Callable[P, R]:
    """Decorates a function: while it runs, scipy's OpenBLAS has one thread."""

    @wraps(run)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        """Calls the function. The last call to end puts the number of threads back."""
        threads = _threads()
        if threads is None:
            return run(*args, **kwargs)
        get, set_to = threads
        with _LOCK:
            _BEFORE.append(get())
            set_to(1)
        try:
            return run(*args, **kwargs)
        finally:
            with _LOCK:
                set_to(_BEFORE.pop())

    return limited


@cache
def _lapack() -> Any:
    """scipy's LAPACK, which is imported by the first call, because that takes a tenth of a second."""
    import scipy.linalg.lapack

    return scipy.linalg.lapack


@cache
def _threads() -> tuple[Any, Any] | None:
    """The functions that get and set the threads of scipy's own OpenBLAS, or None if it has none."""
    import ctypes
    from pathlib import Path

    home = Path(_lapack().__file__).parents[1]  # This loads the library, if there is one.
    for path in (*home.parent.glob("scipy.libs/*openblas*"), *home.glob(".dylibs/*openblas*")):
        library = ctypes.CDLL(str(path))
        # A later scipy may call these otherwise; then fits go on with as many threads as it has.
        get, set_to = (getattr(library, f"scipy_openblas_{do}_num_threads", None) for do in ("get", "set"))
        if get and set_to:
            return get, set_to
    return None


@on_one_thread
def cholesky(matrix: Array) -> Array:
    """The lower triangular factor of a matrix (m, m), which is used up."""
    factor, failed = _lapack().dpotrf(matrix.T, lower=0, clean=1, overwrite_a=1)
    if failed:
        raise np.linalg.LinAlgError("the matrix is not positive definite")
    return factor.T


def cholesky_diagonal(matrix: Array) -> Array:
    """The diagonal (m,) of the Cholesky factor of a positive definite matrix (m, m).

    The matrix, C-contiguous and of double precision, is used up. Where the matrix is not positive definite
    the factor ends early, which no error reports. Callers limit the threads themselves, with `on_one_thread`,
    because they call it many times.
    """
    _lapack().dpotrf(matrix.T, lower=1, clean=0, overwrite_a=1)
    return matrix.diagonal()


@on_one_thread
def solved_definite(matrix: Array, right: Array) -> Array:
    """matrix^-1 @ right (m,), for a positive definite matrix (m, m), whose lower triangle is used up."""
    _, solution, failed = _lapack().dposv(matrix.T, right, lower=0, overwrite_a=1)
    if failed:
        raise np.linalg.LinAlgError("the matrix is not positive definite")
    return solution


@on_one_thread
def solved_square(matrix: Array, right: Array) -> Array:
    """matrix^-1 @ right, for an invertible matrix (m, m) and right (m, n)."""
    *_, solution, failed = _lapack().dgesv(matrix, right)
    if failed:
        raise np.linalg.LinAlgError("the matrix is singular")
    return solution


@on_one_thread
def inverse_lower(factor: Array) -> Array:
    """The inverse of a lower triangular matrix (m, m), which is used up."""
    return _lapack().dtrtri(factor.T, lower=0, overwrite_c=1)[0].T


@on_one_thread
def solved(factor: Array, right: Array, transposed: bool = False) -> Array:
    """factor^-1 @ right, or factor'^-1 @ right, for a lower triangular matrix (m, m)."""
    return _lapack().dtrtrs(factor.T, right, lower=0, trans=0 if transposed else 1)[0]
