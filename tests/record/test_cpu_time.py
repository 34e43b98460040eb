"""The session that reads the clocks of threads: the real LTTng, and a process that may not."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from recording.recorder import NotPossibleError, require_lttng
from recording.tracetools import build_tracetools

from msgflow import trace
from msgflow.errors import RecordingError
from msgflow.ingest.readings import of_readings_alone
from msgflow.record import cpu_time, session
from msgflow.record.cpu_time import EVENTS, recorded_cpu_time, why_not
from msgflow.record.lttng import Session
from msgflow.record.session import Channel
from msgflow.trace.model import TraceInfo
from msgflow.watch import watched_sessions

REFUSE_PERF = Path(__file__).with_name("refuse_perf.py")
# Callbacks that compute for a millisecond, or sleep so long; each is one turn of an executor.
ROUNDS = 200
PROGRAM = f"""
import ctypes, sys, time
tracetools = ctypes.CDLL(sys.argv[1])
def computing():
    begin = time.thread_time_ns()
    while time.thread_time_ns() - begin < 1_000_000:
        pass
for number in range({ROUNDS}):
    tracetools.ros_trace_rclcpp_executor_execute(None)
    tracetools.ros_trace_callback_start(None, 0)
    computing() if number % 2 else time.sleep(0.001)
    tracetools.ros_trace_callback_end(None)
    tracetools.ros_trace_rclcpp_callback_register(None, b"not read there")
    tracetools.ros_trace_rclcpp_executor_wait_for_work(ctypes.c_int64(-1))
"""
Counts = dict[str, int]
Record = Callable[..., tuple[Counts, Counts, str]]


def counted(directory: Path) -> Counts:
    """Return how many events of each name were recorded."""
    counts: Counts = {}
    if directory.exists():
        with trace.open([directory]) as traces:
            for _ in traces.batches():
                pass
            for (_, name), count in traces.event_counts.items():
                counts[name] = counts.get(name, 0) + count
    return counts


@pytest.fixture
def record(tmp_path: Path) -> Record:
    """Records the program; returns events of both sessions, and what was said."""
    try:
        require_lttng()
        (tmp_path / "library").mkdir()
        library = build_tracetools(tmp_path / "library")
    except (NotPossibleError, subprocess.CalledProcessError) as error:
        pytest.skip(f"cannot record: {error}")

    def run(
        *options: str, around: Sequence[object] = (), before: Sequence[object] = ()
    ) -> tuple[Counts, Counts, str]:
        place = tmp_path / f"trace{len(list(tmp_path.iterdir()))}"
        msgflow = (sys.executable, "-m", "msgflow", "record", "--no-ingest", "-o", place)
        program = (sys.executable, "-c", PROGRAM, library)
        ended = subprocess.run(
            [str(word) for word in (*around, *msgflow, *options, "--", *before, *program)],
            cwd=tmp_path,
            env=os.environ | {"LTTNG_UST_REGISTER_TIMEOUT": "-1"},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert ended.returncode == 0, ended.stderr
        return counted(place / "ust"), counted(place / "cpu"), ended.stderr

    return run


def test_clocks_are_read_in_a_session_of_their_own(record: Record) -> None:
    if reason := why_not():
        pytest.skip(reason)
    events, readings, said = record()
    assert readings == dict.fromkeys(EVENTS, ROUNDS)
    assert events == readings | {"ros2:rclcpp_callback_register": ROUNDS}
    assert "CPU time" not in said
    assert record("--no-cpu-time")[:2] == (events, {})


@pytest.mark.thorough
def test_events_that_are_left_out_are_missing_in_both(record: Record) -> None:
    """The daemon of LTTng bears it."""
    if reason := why_not():
        pytest.skip(reason)
    events, readings, said = record("--without", "callback_*")
    assert readings == {name: ROUNDS for name in EVENTS if "executor" in name}
    assert events == readings | {"ros2:rclcpp_callback_register": ROUNDS}
    assert "destroyed" not in said


def test_a_process_that_may_not_keeps_all_its_events(record: Record) -> None:
    """In the session of the events, as without the option; it has no readings."""
    refused = (sys.executable, REFUSE_PERF)
    without, _, _ = record("--no-cpu-time", before=refused)
    events, readings, _ = record(before=refused)
    assert events == without
    assert events["ros2:callback_start"] == ROUNDS
    assert sum(readings.values()) == 0


@pytest.mark.thorough
def test_a_process_that_may_not_hinders_no_other(record: Record) -> None:
    """Whichever comes first."""
    if reason := why_not():
        pytest.skip(reason)
    both = f'{sys.executable} {REFUSE_PERF} "$@" & sleep {{}}; "$@" & wait'
    for seconds in (0, 1):
        events, readings, _ = record(before=("sh", "-c", both.format(seconds), "sh"))
        assert events["ros2:callback_start"] == 2 * ROUNDS
        assert readings == dict.fromkeys(EVENTS, ROUNDS)


def test_a_system_that_refuses_is_named(record: Record) -> None:
    events, readings, said = record(around=(sys.executable, REFUSE_PERF))
    assert (events["ros2:callback_start"], readings) == (ROUNDS, {})
    assert (
        "note: CPU time is recorded of callbacks of Python nodes only: perf_event_open: operation"
        " not permitted; it needs sysctl kernel.perf_event_paranoid=2"
    ) in " ".join(said.split())


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, ...]]:
    """What is said to an LTTng that is not there."""
    words: list[tuple[str, ...]] = []
    monkeypatch.setattr(session, "lttng", lambda *some: words.append(some))
    monkeypatch.setattr(session, "is_there", lambda name: True)
    monkeypatch.setattr(cpu_time, "why_not", lambda: None)
    return words


def test_processes_share_no_buffers(said: list[tuple[str, ...]], tmp_path: Path) -> None:
    """And what is left out of the recording is not read."""
    channel = Channel(sub_buffer_size="8M", without=("ros2:*_work",))
    with recorded_cpu_time("drive", tmp_path, channel, pytest.fail):
        pass
    words = {some[0]: some for some in said}
    assert words["create"] == ("create", "drive-cpu", f"--output={tmp_path / 'cpu'}")
    assert {"--buffers-pid", "--subbuf-size=64K"} < set(words["enable-channel"])
    assert words["enable-event"][-1] == (
        "ros2:callback_start,ros2:callback_end,ros2:rclcpp_executor_execute"
    )
    assert words["add-context"][-1] == "--type=perf:thread:task-clock"


def test_a_chunk_has_one_trace_of_all_processes(
    said: list[tuple[str, ...]], tmp_path: Path
) -> None:
    channel = Channel(sub_buffer_size="8M", rotation_ns=2_000_000_000)
    with recorded_cpu_time("drive", tmp_path, channel, pytest.fail):
        pass
    words = {some[0]: some for some in said}
    assert "--buffers-pid" not in words["enable-channel"]
    assert "--subbuf-size=8M" in words["enable-channel"]
    assert words["enable-rotation"][1:] == ("--session=drive-cpu", "--timer=2000000us")


def test_an_lttng_that_refuses_is_named(
    said: list[tuple[str, ...]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Such as one that was built without these contexts."""

    def refuse(*words: str) -> None:
        said.append(words)
        if words[0] == "add-context":
            raise RecordingError("lttng add-context failed: no such context", "another")

    monkeypatch.setattr(session, "lttng", refuse)
    notes: list[str] = []
    with recorded_cpu_time("drive", tmp_path, Channel(), notes.append):
        assert said[-1] == ("destroy", "drive-cpu")
        assert not list(tmp_path.iterdir())
    assert notes == [
        "CPU time is recorded of callbacks of Python nodes only: lttng add-context failed: no such"
        " context"
    ]


def test_machines_without_such_clocks_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platform, "machine", lambda: "riscv64")
    assert why_not() == "LTTng reads no clocks of threads on riscv64"


def test_a_view_of_the_only_recording_finds_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Although it has two sessions."""
    both = [Session("drive-cpu", tmp_path / "cpu", False), Session("drive", tmp_path, False)]
    monkeypatch.setattr(watched_sessions, "sessions", lambda: both)
    assert watched_sessions.watched_place(None) == tmp_path


def test_an_ingest_knows_its_session() -> None:
    """With the counter or, of a process that may not read it, without; but not alone."""
    read = ("perf_thread_task_clock",)
    events = tuple(sorted(EVENTS))
    clocks = TraceInfo(0, Path("cpu/a"), counters=read, event_names=events)
    refused = TraceInfo(1, Path("cpu/b"), event_names=events)
    robot = TraceInfo(2, Path("ust"), event_names=(*events, "ros2:rcl_init"))
    kernel = TraceInfo(3, Path("kernel"), domain="kernel", event_names=("sched_switch",))
    assert of_readings_alone([clocks, refused, robot, kernel]) == {0, 1}
    assert not of_readings_alone([clocks, refused, kernel])
    assert not of_readings_alone([refused, robot])
