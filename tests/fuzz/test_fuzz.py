"""A fixed slice of `make fuzz`: nothing that is damaged ends in anything but a clear answer."""

from __future__ import annotations

import pytest

fuzz = pytest.importorskip("fuzz")

SEED = 1
CASES = range(120)


def test_a_slice_of_the_campaign() -> None:
    found = fuzz.campaign(CASES, SEED, ("trace", "trace", "trace", "archive"))
    assert len(found) == len(CASES)
    assert {outcome.ending for outcome in found} >= {"ended", "refused"}
    assert [(o.number, o.bad, o.change, o.said[-500:]) for o in found if o.bad] == []


def test_a_case_is_the_same_again() -> None:
    once, again = (fuzz.campaign([7], SEED, ("trace",)) for _ in range(2))
    assert [(o.kind, o.change, o.bad) for o in once] == [(o.kind, o.change, o.bad) for o in again]
