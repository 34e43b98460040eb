"""A fixed slice of `make fuzz`: nothing that is damaged ends in anything but a clear answer."""

from __future__ import annotations

import fuzz

SEED = 1
CASES = range(20)


def test_a_slice_of_the_campaign() -> None:
    found = fuzz.campaign(CASES, SEED)
    assert sorted(outcome.number for outcome in found) == list(CASES)
    assert {outcome.ending for outcome in found} >= {"ended", "refused"}
    assert [(o.number, o.bad, o.change, o.said[-500:]) for o in found if o.bad] == []
