"""The two ways to find events agree, whatever the layout and the damage."""

from __future__ import annotations

from functools import partial
from random import Random
from typing import Any

import pytest
from ctf_layouts import Style, TraceMaker
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mutations import flip_header, flip_stream, overwrite
from same_batches import differences, read

from msgflow.errors import TraceError
from msgflow.trace.ctf import events, lockstep

STYLES = st.builds(Style, st.booleans(), st.booleans(), st.booleans(), st.booleans())


@settings(
    deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    style=STYLES,
    random=st.randoms(use_true_random=True),
    damage=st.sampled_from([None, flip_stream, flip_header, overwrite]),
)
def test_side_by_side_as_one_by_one(
    style: Style, random: Random, damage: Any, tmp_path_factory: Any
) -> None:
    trace = TraceMaker(style, random).write(tmp_path_factory.mktemp("trace") / "trace", packets=12)
    if damage is not None:
        damage(trace, random)
    contents = []
    for narrowest in (1, 3, 1 << 30):
        kernel = partial(lockstep.scan_lockstep, narrowest=narrowest)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(events, "scan_lockstep", kernel)
            try:
                contents.append(read(trace))
            except TraceError:
                return
    one_by_one = contents.pop()
    for content in contents:
        assert not differences(content, one_by_one)
        assert content.damages == one_by_one.damages


def test_many_packets_are_read_side_by_side(tmp_path: Any, monkeypatch: Any) -> None:
    """So that the default takes the fast way and the comparison above means something."""
    random = Random(1)
    maker = TraceMaker(Style(False, False, False, False), random)
    trace = maker.write(tmp_path / "trace", packets=400)
    steps = 0
    step_sizes = lockstep._Lockstep._step_sizes

    def counted(self: Any, position: Any) -> Any:
        nonlocal steps
        steps += 1
        return step_sizes(self, position)

    monkeypatch.setattr(lockstep._Lockstep, "_step_sizes", counted)
    fast = read(trace)
    assert steps > 0
    monkeypatch.setattr(events, "scan_lockstep", partial(lockstep.scan_lockstep, narrowest=1 << 30))
    assert not differences(fast, read(trace))
