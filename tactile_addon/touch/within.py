# SPDX-FileCopyrightText: 2026 Tactile Patch contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What holds only within a context, such as that a caller touches again and no handler has to."""

from collections.abc import Iterator
from contextlib import contextmanager


class Within:
    """A context, `with some_context():`, that tells others by `is_on` whether it is entered."""

    is_on = False

    @contextmanager
    def __call__(self) -> Iterator[None]:
        outer, self.is_on = self.is_on, True
        try:
            yield
        finally:
            self.is_on = outer
