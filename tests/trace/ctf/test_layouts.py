"""Any layout is read as bt2 reads it."""

from __future__ import annotations

import os
from itertools import product
from random import Random
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.ctf2_metadata import translate
from support.ctf_layouts import Style, TraceMaker
from support.same_batches import differences, read
from support.thorough import examples, few

from msgflow.trace.ctf import batches

EXAMPLES = int(os.environ.get("MSGFLOW_EXAMPLES", examples(3, 6)))
STYLES = [Style(*flags) for flags in product((False, True), repeat=4)]


@pytest.mark.parametrize("style", few(STYLES, STYLES[0], STYLES[-1]), ids=str)
@settings(
    deadline=None,
    max_examples=EXAMPLES,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(random=st.randoms(use_true_random=False))
def test_as_bt2(style: Style, random: Random, tmp_path_factory: Any, bt2_bindings: Any) -> None:
    trace = TraceMaker(style, random).write(tmp_path_factory.mktemp("layout") / "trace")
    ours, theirs = read(trace), read(trace, reader="bt2")
    assert not ours.damages
    assert not differences(ours, theirs)


@settings(
    deadline=None,
    max_examples=EXAMPLES,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    style=st.sampled_from(STYLES),
    random=st.randoms(use_true_random=True),
)
def test_as_ctf2(style: Style, random: Random, tmp_path_factory: Any) -> None:
    trace = TraceMaker(style, random).write(tmp_path_factory.mktemp("layout") / "trace")
    before = read(trace)
    translate(trace)
    assert not differences(before, read(trace))


@settings(
    deadline=None,
    max_examples=5 * EXAMPLES,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(style=st.sampled_from(STYLES), random=st.randoms(use_true_random=True))
def test_size_of_batches_changes_nothing(
    style: Style, random: Random, tmp_path_factory: Any
) -> None:
    """Packets stay in memory through many batches, at another place in each."""
    trace = TraceMaker(style, random).write(
        tmp_path_factory.mktemp("layout") / "trace", streams=4, packets=6, latest_begin=1000
    )
    whole = read(trace)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(batches, "SMALLEST_BATCH", 1)
        small = read(trace, batch_rows=1)
    assert not differences(whole, small)
    assert whole.damages == small.damages == ()
