"""Memory does not grow with the trace."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_trace

import msgflow.trace


@pytest.mark.thorough
def test_longer_trace_takes_no_more(tmp_path: Path) -> None:
    def peak(trace: Path) -> int:
        with msgflow.trace.open([trace]) as traces:
            tracemalloc.start()
            try:
                for item in traces.batches(batch_rows=400):
                    assert item.batch.num_rows <= 400
                return tracemalloc.get_traced_memory()[1]
            finally:
                tracemalloc.stop()

    def least(name: str, packets: int) -> int:
        """On a busy machine, more or less of a trace is read ahead."""
        streams = {
            stream: [
                Packet([Event(begin + n, "ros2:x", (n,)) for n in range(100)])
                for begin in range(0, packets * 100, 100)
            ]
            for stream in range(2)
        }
        content = TraceContent({"ros2:x": {"n": "u64"}}, streams)
        trace = write_trace(tmp_path / name, content)
        return min(peak(trace) for _ in range(3))

    least("warm", 10)
    assert least("long", 320) < 1.4 * least("short", 80)
