# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Systems solved by LAPACK against numpy's, and the one thread that they run on."""

import ctypes
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np
import pytest
import surfaces

import core
from core import lapack

MATRIX = np.cov(np.random.default_rng(1).normal(size=(12, 40)))
RIGHT = np.arange(12.0)


def test_agrees_with_numpy():
    lower = np.linalg.cholesky(MATRIX)
    np.testing.assert_allclose(lapack.cholesky(MATRIX.copy()), lower, atol=1e-14)
    np.testing.assert_allclose(lapack.cholesky_diagonal(MATRIX.copy()), lower.diagonal(), atol=1e-14)
    np.testing.assert_allclose(lapack.solved(lower, RIGHT), np.linalg.solve(lower, RIGHT))
    np.testing.assert_allclose(lapack.solved(lower, RIGHT, transposed=True), np.linalg.solve(lower.T, RIGHT))
    np.testing.assert_allclose(lapack.solved_definite(MATRIX.copy(), RIGHT), np.linalg.solve(MATRIX, RIGHT))
    with pytest.raises(np.linalg.LinAlgError, match="the matrix is singular"):
        lapack.solved_square(np.ones((3, 3)), np.ones((3, 1)))
    np.testing.assert_allclose(lapack.solved_square(MATRIX, MATRIX[:, :2]), np.eye(12)[:, :2], atol=1e-12)
    np.testing.assert_allclose(lapack.inverse_lower(lower.copy()), np.linalg.inv(lower), atol=1e-12)


def test_refuses_what_is_not_positive_definite():
    with pytest.raises(np.linalg.LinAlgError, match="not positive definite"):
        lapack.cholesky(-np.eye(3))


def test_one_thread_during_a_call_and_as_many_as_before_afterwards():
    # pip's scipy, which releases ship, has an OpenBLAS of its own; only this test tells if it is renamed.
    get, set_to = lapack._threads()
    before = get()
    set_to(2)
    try:
        assert lapack.on_one_thread(get)() == 1
        assert get() == 2
        with pytest.raises(np.linalg.LinAlgError):
            lapack.cholesky(-np.eye(3))
        assert get() == 2
    finally:
        set_to(before)


def test_calls_in_several_threads_of_python_leave_as_many_threads_as_before():
    get, set_to = lapack._threads()
    before, count = get(), 4
    both, seen = Barrier(count), []

    @lapack.on_one_thread
    def overlapping(rank):
        both.wait()  # All calls have begun before the first ends, and they end one by one.
        for _ in range(rank):
            lapack.cholesky(MATRIX.copy())
        seen.append(get())

    set_to(2)
    try:
        for _ in range(20):
            with ThreadPoolExecutor(count) as pool:
                list(pool.map(overlapping, range(count)))
            assert get() == 2
        assert set(seen) == {1}
    finally:
        set_to(before)


def test_calls_go_on_where_the_library_has_other_names(monkeypatch):
    monkeypatch.setattr(ctypes, "CDLL", lambda path: object())
    lapack._threads.cache_clear()
    try:
        np.testing.assert_allclose(lapack.cholesky(MATRIX.copy()), np.linalg.cholesky(MATRIX), atol=1e-14)
    finally:
        lapack._threads.cache_clear()


def test_a_touch_calls_no_numpy_solver_which_has_threads_of_its_own(monkeypatch):
    place = surfaces.sphere(1.0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)
    before = core.explore(*place, farthest=1.0)  # This also fills what is computed once.
    for name in ("solve", "inv"):
        monkeypatch.setattr(np.linalg, name, None)
    after = core.explore(*place, farthest=1.0)
    assert (after.result.message, after.result.k1_std) == (before.result.message, before.result.k1_std)
