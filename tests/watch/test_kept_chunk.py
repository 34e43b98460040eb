"""A chunk as it is kept in memory."""

from __future__ import annotations

from pathlib import Path

import pyarrow as pa

from msgflow.trace import Continuation
from msgflow.watch import finished_chunks
from msgflow.watch.kept_chunk import read_chunk

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
