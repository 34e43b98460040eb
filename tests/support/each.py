"""One test of many things: it checks each of them, and its message names all that are wrong."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable
from typing import Any

import pytest

Check = Callable[..., None]


def each(things: Iterable[Any], *, name: Callable[[Any], str] = str) -> Callable[[Check], Check]:
    """Call a check with each thing, its first argument, in place of a test for each of them.

    Thousands of tests take longer to collect, hand out and report than to run.
    """
    things = list(things)
    assert things

    def of_all(check: Check) -> Check:
        @functools.wraps(check)
        def test(**fixtures: Any) -> None:
            wrong = []
            for thing in things:
                try:
                    check(thing, **fixtures)
                except (Exception, pytest.fail.Exception) as error:
                    wrong.append(f"{name(thing)}: {type(error).__name__}: {error}")
            if wrong:
                pytest.fail("\n".join(wrong), pytrace=False)

        _, *fixtures = inspect.signature(check).parameters.values()
        test.__signature__ = inspect.Signature(fixtures)  # type: ignore[attr-defined]
        return test

    return of_all
