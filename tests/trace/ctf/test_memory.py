"""Memory does not grow with the trace."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

from ctf_writer import Event, Packet, TraceContent, write_trace

import msgflow.trace


def test_longer_trace_takes_no_more(tmp_path: Path) -> None:
    def peak(name: str, packets: int) -> int:
        streams = {
            stream: [
                Packet([Event(begin + n, "ros2:x", (n,)) for n in range(100)])
                for begin in range(0, packets * 100, 100)
            ]
            for stream in range(2)
        }
        content = TraceContent({"ros2:x": {"n": "u64"}}, streams)
        with msgflow.trace.open([write_trace(tmp_path / name, content)]) as traces:
            tracemalloc.start()
            try:
                for item in traces.batches(batch_rows=400):
                    assert item.batch.num_rows <= 400
                return tracemalloc.get_traced_memory()[1]
            finally:
                tracemalloc.stop()

    peak("warm", 10)
    assert peak("long", 320) < 1.4 * peak("short", 80)
