# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The examples in the docstrings do what they say."""

import doctest
import importlib

import pytest


@pytest.mark.parametrize("module", ["reconstruction.from_contours", "exploration.touches"])
def test_examples_in_docstrings(module):
    failed, tried = doctest.testmod(importlib.import_module(f"core.{module}"))
    assert tried > 0
    assert failed == 0
