"""Any damage: never a hang or a traceback, and no lost event without a word."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from random import Random
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.ctf_layouts import Style, TraceMaker
from support.mutations import ANYWHERE, MUTATIONS, Mutation
from support.same_batches import read
from support.thorough import examples

from msgflow.errors import TraceError

EXAMPLES = int(os.environ.get("MSGFLOW_EXAMPLES", examples(5, 15)))
SECONDS = 20
STYLES = st.builds(Style, st.booleans(), st.booleans(), st.booleans(), st.booleans())


@contextmanager
def limited_time() -> Iterator[None]:
    """Fail instead of hanging."""

    def fail(signal_number: int, frame: object) -> None:
        raise AssertionError(f"still reading after {SECONDS} s")

    before = signal.signal(signal.SIGALRM, fail)
    signal.setitimer(signal.ITIMER_REAL, SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.__name__)
@settings(
    deadline=None,
    max_examples=EXAMPLES,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(style=STYLES, random=st.randoms(use_true_random=True))
def test_is_reported(
    mutation: Mutation, style: Style, random: Random, tmp_path_factory: Any
) -> None:
    trace = TraceMaker(style, random).write(tmp_path_factory.mktemp("damaged") / "trace")
    before = sum(read(trace).event_counts.values())
    mutation(trace, random)
    with limited_time():
        try:
            content = read(trace)
        except TraceError:
            return
    after = sum(content.event_counts.values())
    assert mutation in ANYWHERE or content.damages or after == before
    for damage in content.damages:
        assert damage.file.parent == trace
        assert 0 <= damage.offset <= damage.file.stat().st_size
