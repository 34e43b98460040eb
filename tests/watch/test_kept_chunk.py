"""A chunk as it is kept in memory."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from functools import reduce
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from msgflow.clocks.clocks_file import ClockSync
from msgflow.ingest.repeated_in_memory import database_in_memory, ingest_again
from msgflow.trace import Continuation
from msgflow.trace.columns import CONTEXT
from msgflow.watch.chunk import finished_chunks
from msgflow.watch.kept_chunk import KeptChunk, KeptTraces, read_chunk
from msgflow_sim import Recording, simulate

STREAM = ["trace_index", "stream_index"]


def test_every_stream_lasts_until_the_end_of_its_chunk(shared_traces: Path) -> None:
    """A rotation writes no packet for a CPU that was idle, which is no loss."""
    after = Continuation()
    added = 0
    for chunk in finished_chunks(shared_traces / "real_rotate"):
        kept = read_chunk(chunk, after)
        assert kept is not None
        packets = pa.Table.from_batches(kept.packets)
        ends = packets.group_by(STREAM).aggregate([("end_ns", "max")])["end_ns_max"].to_pylist()
        assert set(ends) == {kept.end_ns}
        # What is added has lost nothing, and follows the others.
        *_, last = kept.packets
        added += last.num_rows
        for row in last.to_pylist():
            assert (row["event_count"], row["discarded_event_count"]) == (0, 0)
            assert row["begin_ns"] < row["end_ns"]
    assert added > 0


def test_what_lasts_of_several_chunks_is_one_part(tmp_path: Path) -> None:
    """Nodes that come and go leave objects in many chunks."""
    rotations = tuple(200_000_000 * number for number in range(1, 9))
    simulate("restarts", tmp_path / "trace", recording=Recording(rotations=rotations))
    after = Continuation()
    read = [read_chunk(chunk, after) for chunk in finished_chunks(tmp_path / "trace")]
    *earlier, last = [chunk for chunk in read if chunk is not None]
    parts = [lasting for chunk in earlier if (lasting := chunk.lasting()) is not None]
    assert len(parts) > 2
    one = reduce(KeptChunk.followed_by, parts)
    assert one.times_ns.size == sum(part.times_ns.size for part in parts)
    whole, single = (
        {batch.name: batch.batch.to_pylist() for batch in KeptTraces(lasting, [last]).batches()}
        for lasting in (parts, [one])
    )
    assert single == whole


def test_a_window_has_what_a_second_session_read_of_the_clocks_of_threads(tmp_path: Path) -> None:
    """Beside its events, which count once."""
    simulate("pipeline", tmp_path / "trace", factor=0.1, recording=Recording(rotations=(10**9,)))
    chunk, *_ = finished_chunks(tmp_path / "trace")
    kept = read_chunk(chunk, Continuation())
    assert kept is not None
    clock = pa.field("perf_thread_task_clock", pa.int64(), metadata={CONTEXT: b""})
    # As if each thread did nothing but compute.
    read = {
        name: kept.events[name].append_column(clock, kept.events[name]["ts_ns"])
        for name in ("ros2:callback_start", "ros2:callback_end")
    }
    reader = {"counters": (clock.name,), "event_names": tuple(read)}
    clocks = replace(
        kept,
        events=read,
        packets=(),
        traces=tuple(replace(trace, **reader) for trace in kept.traces),
    )
    with closing(database_in_memory()) as con:
        ingest_again(
            con,
            KeptTraces([], [kept, clocks]),
            "watch",
            links=None,
            clocks=ClockSync("none"),
            leave_out=lambda link, error: pytest.fail(str(error)),
        )
        ran = con.execute(
            "SELECT count(*), count(*) FILTER (cpu_ns = end_ns - start_ns) FROM callback_instance"
            " WHERE end_ns IS NOT NULL"
        ).fetchall()
    count = kept.events["ros2:callback_end"].num_rows
    assert count > 0
    assert ran == [(count, count)]


def test_what_a_callback_of_python_took_does_not_last() -> None:
    """The names of its function and thread do."""
    name = "ros2:rclcpp_callback_register"
    said = ["cpu", "function cpu", "collect 2", "thread collect", "cpu"]
    columns = {
        "event_id": range(5),
        "ts_ns": range(10, 15),
        "symbol": [f"#msgflow {each}" for each in said],
    }
    chunk = KeptChunk(
        source=Path("drive"),
        path=Path("drive/archives/0"),
        traces=(),
        events={name: pa.record_batch(columns)},
        times_ns=np.arange(10, 15),
        packets=(),
        event_counts={},
        damages=(),
        begin_ns=10,
        end_ns=15,
    )
    lasting = chunk.lasting()
    assert lasting is not None
    assert lasting.events[name].to_pydict() == {
        "event_id": [0, 1],
        "ts_ns": [11, 13],
        "symbol": ["#msgflow function cpu", "#msgflow thread collect"],
    }
    assert lasting.times_ns.tolist() == [11, 13]


def test_what_this_process_recorded_is_left_out(
    shared_traces: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not what another machine's process of the same number recorded."""
    chunk = finished_chunks(shared_traces / "real_rotate")[0]

    def pids(*, without_own: bool = True) -> set[int]:
        kept = read_chunk(chunk, Continuation(), without_own=without_own)
        assert kept is not None
        return {pid for batch in kept.events.values() for pid in batch["vpid"].to_pylist()}

    kept = read_chunk(chunk, Continuation())
    assert kept is not None
    (hostname,) = {trace.hostname for trace in kept.traces}
    every = pids()
    monkeypatch.setattr("os.getpid", lambda: min(every))
    monkeypatch.setattr("socket.gethostname", lambda: "another")
    assert pids() == every
    monkeypatch.setattr("socket.gethostname", lambda: hostname)
    assert pids() == every - {min(every)}
    # Without a node of its own, one of the robot may have had its number.
    assert pids(without_own=False) == every
