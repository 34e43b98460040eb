"""Items made ahead of their use: the same items, the same errors, no thread left behind."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_trace
from support.reading_threads import reading_threads

import msgflow.trace
from msgflow.trace.ctf import batches, event_order
from msgflow.trace.prefetch import prefetched

_OTHER_THREAD = """
import threading
from msgflow.trace.prefetch import prefetched

def read():
    threading.main_thread().join()
    print(list(prefetched((number for number in range(3)), 1)))

threading.Thread(target=read).start()
"""
# The item that the thread makes when the program ends is never made.
_ABANDONED = """
import threading
from msgflow.trace.prefetch import prefetched

def make():
    yield 0
    threading.Event().wait()

items = prefetched(make(), 1)
print(next(items))
"""


def test_all_items_in_order() -> None:
    items = prefetched((number for number in range(1000)), 3)
    assert list(items) == list(range(1000))
    assert reading_threads() == 0


def test_error_comes_after_the_items_before_it() -> None:
    def make() -> Generator[int, None, None]:
        yield 1
        raise KeyError("gone")

    items = prefetched(make(), 1)
    assert next(items) == 1
    with pytest.raises(KeyError, match="gone"):
        next(items)
    assert reading_threads() == 0


def test_no_more_than_allowed_are_made_ahead() -> None:
    made = []

    def make() -> Generator[int, None, None]:
        for n in range(100):
            made.append(n)
            yield n

    items = prefetched(make(), 2)
    next(items)
    time.sleep(0.3)
    # One taken, two waiting, one in hand.
    assert len(made) == 4
    items.close()


def test_closing_ends_the_iterator() -> None:
    closed = threading.Event()

    def make() -> Generator[int, None, None]:
        try:
            while True:
                yield 0
        finally:
            closed.set()

    items = prefetched(make(), 1)
    next(items)
    items.close()
    assert closed.is_set()
    assert reading_threads() == 0


def outlived(program: str) -> str:
    """Run a program whose main thread ends first; return what it prints."""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stderr == ""
    return done.stdout


def test_other_threads_read_when_the_main_thread_has_ended() -> None:
    assert outlived(_OTHER_THREAD) == "[0, 1, 2]\n"


def test_an_abandoned_iteration_does_not_keep_the_program() -> None:
    assert outlived(_ABANDONED) == "0\n"


class TestReading:
    @pytest.fixture
    def trace(self, tmp_path: Path) -> Path:
        packets = [Packet([Event(t + n, "ros2:x") for n in range(50)]) for t in range(0, 9999, 50)]
        return write_trace(tmp_path / "trace", TraceContent({"ros2:x": {}}, {0: packets}))

    def test_breaking_off_leaves_no_thread(self, trace: Path) -> None:
        with msgflow.trace.open([trace]) as traces:
            for _ in traces.batches(batch_rows=1):
                break
        assert reading_threads() == 0

    def test_interrupt_leaves_no_thread(self, trace: Path) -> None:
        def interrupted() -> None:
            for _ in traces.batches(batch_rows=1):
                raise KeyboardInterrupt

        with msgflow.trace.open([trace]) as traces:
            with pytest.raises(KeyboardInterrupt):
                interrupted()
            assert reading_threads() == 0
            assert sum(1 for _ in traces.batches()) > 0

    def test_memory_of_a_batch_is_left_alone(
        self, trace: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """While it is in use, the next ones are loaded elsewhere."""
        monkeypatch.setattr(batches, "SMALLEST_BATCH", 1000)
        in_use: list[tuple[event_order.Batch, bytes]] = []
        with msgflow.trace.open([trace]) as traces:
            events = batches.Iteration.events

            def slowly(self: Any, batch: event_order.Batch, number: int) -> Iterator[Any]:
                before = bytes(batch.memory.data)
                yield from events(self, batch, number)
                time.sleep(0.002)
                in_use.append((batch, before))
                assert bytes(batch.memory.data) == before

            monkeypatch.setattr(batches.Iteration, "events", slowly)
            list(traces.batches(batch_rows=4))
        assert len(in_use) > 10
