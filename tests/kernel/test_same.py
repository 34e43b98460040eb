"""The compiled kernel and numpy make the same batches, whatever the layout and the damage."""

from __future__ import annotations

from pathlib import Path
from random import Random
from typing import Any

import pyarrow as pa
import pytest
from ctf_layouts import Style, TraceMaker
from ctf_writer import Event, Packet, TraceContent, write_trace
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from kernels import needs_kernel, without_kernel
from mutations import MUTATIONS
from thorough import examples, few

import msgflow.trace
from msgflow.errors import TraceError
from msgflow.ingest.catalogue import load
from msgflow.ingest.load import ImplausibleValues, _placed
from msgflow.ingest.sequences import Placed, Sequences
from msgflow.trace.ctf import compiled, compiled_columns, events

pytestmark = needs_kernel

STYLES = st.builds(Style, st.booleans(), st.booleans(), st.booleans(), st.booleans())


def batches(trace: Path, *, placed: bool = False) -> list[Any]:
    """Return all batches, then counts and damages; or the error."""
    found: list[Any] = []
    try:
        with msgflow.trace.open([trace]) as traces:
            if placed:
                sequences = Sequences(load(), [0] * len(traces.traces))
                read = traces.batches(load().arrow_schemas())
                for item in _placed(read, sequences, None, ImplausibleValues()):
                    found += [item] if isinstance(item, tuple) else _tables(item)
            else:
                found += [(item.name, item.batch) for item in traces.batches()]
            return [*found, dict(traces.event_counts), list(traces.damages)]
    except TraceError as error:
        return [*found, str(error)]


def assert_same(trace: Path, *, placed: bool = False) -> None:
    fast = batches(trace, placed=placed)
    with without_kernel():
        slow = batches(trace, placed=placed)
    assert len(fast) == len(slow)
    for one, other in zip(fast, slow, strict=True):
        if not isinstance(one, tuple):
            assert one == other
            continue
        assert one[0] == other[0]
        one[1].validate(full=True)
        assert one[1].schema == other[1].schema
        assert one[1].equals(other[1]) or _texts(one[1]) == _texts(other[1]), one[0]


def _tables(placed: Placed) -> list[tuple[str, pa.RecordBatch]]:
    names = [("thread", placed.threads), ("thread_name", placed.thread_names)]
    return [*names, *placed.batches]


def _texts(batch: pa.RecordBatch) -> list[str]:
    """Return what a NaN is equal in, too."""
    return [repr(column.to_pylist()) for column in batch.columns]


@settings(
    deadline=None,
    max_examples=examples(40, 150),
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    style=STYLES,
    random=st.randoms(use_true_random=True),
    damage=st.sampled_from([None, *MUTATIONS]),
)
def test_random_layouts(style: Style, random: Random, damage: Any, tmp_path_factory: Any) -> None:
    trace = TraceMaker(style, random).write(tmp_path_factory.mktemp("trace") / "trace", 4, 6)
    if damage is not None:
        damage(trace, random)
    assert_same(trace)


@pytest.mark.parametrize("pattern", few(["*", "sync_1_1"], "sync_1_1"))
def test_recorded_traces(shared_traces: Path, pattern: str) -> None:
    traces = sorted(path for path in shared_traces.glob(pattern) if path.is_dir())
    assert traces
    for trace in traces:
        assert_same(trace, placed=True)


def test_the_kernel_reads_a_usual_trace(tmp_path: Path, monkeypatch: Any) -> None:
    """So that the comparisons above mean something."""
    for name in ("scan_lockstep", "read_headers"):
        monkeypatch.delattr(events, name)
    kinds = {"ros2:n": {"n": "u64", "text": "str", "many": "u16[]"}}
    happened = [Event(n, "ros2:n", (n, b"x" * (n % 9), (n, n))) for n in range(100)]
    content = TraceContent(kinds, {0: [Packet(happened)]})
    found = batches(write_trace(tmp_path / "trace", content))
    assert found[0][1].num_rows == 100


def test_more_names_than_the_kernel_keeps(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr(compiled_columns, "_MOST_TEXTS", 2)
    random = Random(5)
    for number in range(20):
        style = Style(*(bool(random.getrandbits(1)) for _ in range(4)))
        assert_same(TraceMaker(style, random).write(tmp_path / str(number) / "trace", 4, 6))


def test_few_events_at_once(tmp_path: Path, monkeypatch: Any) -> None:
    """The kernel goes on where its room ended."""
    monkeypatch.setattr(compiled, "_ROOM", 3)
    random = Random(6)
    for number in range(20):
        style = Style(*(bool(random.getrandbits(1)) for _ in range(4)))
        assert_same(TraceMaker(style, random).write(tmp_path / str(number) / "trace", 4, 6))
