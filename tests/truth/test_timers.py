"""The query timers against the timers of a simulated system whose executors are overloaded."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from support.ingested import ingest_one
from support.robots import alone, robot

from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow_sim import (
    Executor,
    Group,
    Node,
    Publisher,
    Recording,
    Subscription,
    Timer,
    Work,
    executor_thread,
    simulate,
)
from msgflow_sim.entity import MILLISECOND, SECOND
from msgflow_sim.objects import TimerObject

_SOURCE = Node(
    "source",
    publishers=(Publisher("/load"),),
    timers=(Timer(20 * MILLISECOND, ("/load",)),),
)
# Its message takes most of the period of /load, at times much longer.
_BUSY = Node(
    "busy",
    subscriptions=(
        Subscription("/load", work=Work(9 * MILLISECOND, 6 * MILLISECOND, 0.1, 90 * MILLISECOND)),
    ),
    timers=(
        Timer(10 * MILLISECOND),
        Timer(25 * MILLISECOND, work=Work(4 * MILLISECOND)),
        # Longer than its own period now and then.
        Timer(40 * MILLISECOND, work=Work(MILLISECOND, 0, 0.1, 60 * MILLISECOND)),
    ),
)
_SHARED = Node(
    "shared",
    groups=(Group("any_time", is_reentrant=True),),
    subscriptions=(
        Subscription("/load", work=Work(25 * MILLISECOND, 9 * MILLISECOND), group="any_time"),
    ),
    timers=(Timer(15 * MILLISECOND, group="any_time"),),
)
OVERLOADED = robot(
    _SOURCE,
    _BUSY,
    alone(_SHARED, 2001, executors=(Executor("multi_threaded", 2),)),
    name="overloaded",
    duration_ns=10 * SECOND,
)


@dataclass
class TrueTimer:
    """What rcl knows of a timer: for each call when it was due, and how many calls it left out."""

    node: str
    period: int
    dues: list[int] = field(default_factory=list)
    skipped: list[int] = field(default_factory=list)
    starts: list[int] = field(default_factory=list)
    threads: list[int] = field(default_factory=list)

    @property
    def lateness(self) -> list[int]:
        return [start - due for start, due in zip(self.starts, self.dues, strict=True)]


@pytest.fixture
def timers(monkeypatch: pytest.MonkeyPatch) -> dict[int, TrueTimer]:
    """The timers of a simulation by the address of their callback."""
    seen: dict[int, TrueTimer] = {}
    run_timer = executor_thread.HANDLERS[TimerObject]

    def called(thread: Any, middleware: Any, timer: TimerObject, time: int) -> Any:
        true = seen.setdefault(timer.callback, TrueTimer(timer.node, timer.period))
        due = timer.due
        true.dues.append(due + thread.machine.epoch)
        outcome = run_timer(thread, middleware, timer, time)
        true.skipped.append((timer.due - due) // timer.period - 1)
        return outcome

    handlers: dict[type, Callable[..., Any]] = {**executor_thread.HANDLERS, TimerObject: called}
    monkeypatch.setattr(executor_thread, "HANDLERS", handlers)
    return seen


def disc(values: Sequence[int], share: float) -> int:
    """The least value that so large a share does not exceed."""
    return next(x for x in sorted(values) if sum(y <= x for y in values) >= share * len(values))


def busy(runs: list[dict[str, Any]], tid: int, begin: int, end: int) -> Counter[str]:
    """How long a thread ran which callbacks of whose nodes between two moments."""
    time: Counter[str] = Counter()
    for run in runs:
        if run["tid"] == tid and run["end_ns"] > begin and run["start_ns"] < end:
            key = f"{run['node']} {run['callback_handle']}"
            time[key] += min(run["end_ns"], end) - max(run["start_ns"], begin)
    return time


def measure(
    directory: Path, recording: Recording | None = None
) -> tuple[dict[int, dict[str, Any]], list[dict[str, Any]]]:
    """Simulate and ask: the rows of the query by callback address, and the true callback runs."""
    more = {} if recording is None else {"recording": recording}
    simulation = simulate(OVERLOADED, directory / "trace", factor=0.3, **more)
    connection = ingest_one(simulation.directory, directory / "run.duckdb").connection
    handles = dict(
        connection.execute("SELECT callback_id, callback_handle FROM callback").fetchall()
    )
    rows = run_query(connection, load_query("timers"), {}).to_arrow().to_pylist()
    connection.close()
    runs = pq.read_table(simulation.truth["callback_instance"]).to_pylist()
    ended = [run for run in runs if run["end_ns"] is not None]
    return {handles[row["callback_id"]]: row for row in rows}, ended


def fill(timers: dict[int, TrueTimer], runs: list[dict[str, Any]]) -> None:
    for run in sorted(runs, key=lambda run: run["start_ns"]):
        if run["callback_handle"] in timers:
            timers[run["callback_handle"]].starts.append(run["start_ns"])
            timers[run["callback_handle"]].threads.append(run["tid"])
    for true in timers.values():
        # One that was called, and not seen to end, is the last.
        del true.dues[len(true.starts) :], true.skipped[len(true.starts) :]


@pytest.mark.thorough
def test_lateness_and_missed_calls_are_those_of_rcl(
    tmp_path: Path, timers: dict[int, TrueTimer]
) -> None:
    rows, runs = measure(tmp_path)
    fill(timers, runs)
    assert set(rows) == set(timers)
    for handle, true in timers.items():
        row = rows[handle]
        late = true.lateness[1:]
        jitter = [
            abs(later - earlier - true.period)
            for earlier, later in zip(true.starts, true.starts[1:], strict=False)
        ]
        sooner = [
            later - earlier < true.period / 2
            for earlier, later in zip(true.starts, true.starts[1:], strict=False)
        ]
        assert row["node"] == true.node
        assert row["period_ns"] == true.period
        assert row["count"] >= len(true.starts) >= row["count"] - 1
        assert row["unknown"] == 1
        assert row["loss_affected"] == 0
        if row["count"] > len(true.starts):
            continue
        assert row["missed"] == sum(true.skipped[1:])
        assert row["bunched"] == sum(sooner)
        for name, share in (("median", 0.5), ("p95", 0.95), ("p99", 0.99), ("max", 1)):
            assert row[f"lateness_{name}_ns"] == disc(late, share), name
            assert row[f"jitter_{name}_ns"] == disc(jitter, share), name
    assert sum(row["missed"] for row in rows.values()) > 20
    assert sum(row["bunched"] for row in rows.values()) > 5


@pytest.mark.thorough
def test_the_executor_is_busy_with_what_really_ran(
    tmp_path: Path, timers: dict[int, TrueTimer]
) -> None:
    """Of executors of one thread, where what ran can be counted exactly."""
    rows, runs = measure(tmp_path)
    fill(timers, runs)
    seen = 0
    for handle, true in timers.items():
        if true.node != "/busy":
            continue
        row = rows[handle]
        meanwhile: Counter[str] = Counter()
        for due, start, tid in list(zip(true.dues, true.starts, true.threads, strict=True))[1:]:
            meanwhile += busy(runs, tid, due, start)
        assert row["busy_share"] == pytest.approx(
            meanwhile.total() / sum(true.lateness[1:]), abs=0.001
        )
        shares = [f"{100 * time / meanwhile.total():.0f} %" for _, time in meanwhile.most_common(3)]
        named = [" ".join(part.split()[-2:]) for part in row["meanwhile"].split(", ")]
        assert named == [share for share in shares if share != "0 %"]
        assert row["meanwhile"].startswith("Subscription(/load)")
        seen += 1
    assert seen == 3


@pytest.mark.thorough
def test_calls_that_the_trace_lost_were_not_missed(
    tmp_path: Path, timers: dict[int, TrueTimer]
) -> None:
    lossy = Recording(lost_event_share=0.15, longest_loss=2_000, packet_bytes=16_384)
    rows, runs = measure(tmp_path, lossy)
    fill(timers, runs)
    for handle, true in timers.items():
        row = rows[handle]
        assert row["missed"] <= sum(true.skipped)
        assert row["lateness_max_ns"] <= max(true.lateness)
    assert sum(row["loss_affected"] for row in rows.values()) > 5


@pytest.mark.thorough
def test_without_its_creation_a_timer_has_no_lateness(
    tmp_path: Path, timers: dict[int, TrueTimer]
) -> None:
    rows, _ = measure(tmp_path, Recording(start_ns=SECOND))
    assert len(rows) == len(timers)
    for row in rows.values():
        assert row["count"] == row["unknown"] > 0
        assert row["period_ns"] is row["missed"] is row["lateness_median_ns"] is None
        assert row["jitter_max_ns"] > 0
