"""Which parameters of a test are for `make test-all` only."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest

# Simulated systems that have every kind of link and cause between them.
SHOWN = (
    "demo",
    "services",
    "partial_sync",
    "mixed_intra_process",
    "python",
)


def thorough(*values: Any, **options: Any) -> Any:
    """A set of parameters that shows what others of the test show already."""
    return pytest.param(*values, marks=pytest.mark.thorough, **options)


# Whether thorough tests are left out; told by conftest.py.
is_quick = False


def examples(quick: int, every: int) -> int:
    """How many random examples a test has: more where thorough tests are run."""
    return quick if is_quick else every


def few(values: Iterable[Any], *chosen: Any) -> list[Any]:
    """All values of one parameter, or sets of several: all but the chosen ones thorough."""
    values = list(values)
    assert all(value in values for value in chosen), chosen
    return [
        value if value in chosen else thorough(*(value if isinstance(value, tuple) else (value,)))
        for value in values
    ]
