"""`msgflow record` with the real LTTng: what it records, what it says, and that nothing stays."""

from __future__ import annotations

import errno
import os
import re
import signal
import socket
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from support.lttng_program import Record, lttng
from support.terminal import Terminal
from typer.testing import CliRunner, Result

from msgflow.cli.app import app
from msgflow.database import Database
from msgflow.record.perf import SCHEDULER_OPTIONS, why_not
from msgflow.record.program import Program
from msgflow.record.session import can_trace_kernel


@pytest.fixture
def refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Result]:
    """Runs the command where nothing starts, in an empty directory and in this process."""
    monkeypatch.chdir(tmp_path)
    return lambda *words: CliRunner().invoke(app, ["record", *words])


@pytest.fixture
def sleeping() -> Iterator[list[str]]:
    """A program that runs for long, which no other test starts; at the end it does not run."""
    words = ["sleep", f"1000.{uuid.uuid4().int}"]
    yield words
    found = ["-r", "D,R,S", "-f", f"^{' '.join(words)}$"]
    runs = subprocess.run(["pgrep", *found]).returncode == 0
    subprocess.run(["pkill", "-KILL", *found])
    assert not runs


def test_from_a_robot_to_an_answer(record: Record, robot: list[str], tmp_path: Path) -> None:
    (tmp_path / "clocks.yaml").write_text(f"{socket.gethostname()}: -12500")
    ended = record(
        *("--duration", "6", "--name", "drive", "-o", "trace", "--clock-sync", "clocks.yaml"),
        *("--", *robot, "0.05"),
    )
    assert ended.exit_code == 0, ended.err
    # Callbacks of rclpy are traced, too.
    assert "/camera → /image → /detector" in ended.out
    assert "process_without_rclcpp" not in ended.out
    assert "run: drive (1)" in ended.err
    assert "tracing took about " in ended.err
    assert "of the latencies, tracing is about " in ended.err
    assert " 0 discarded" in ended.err
    # What LTTng wrote, and the samples of the system.
    found = sorted(path.name for path in (tmp_path / "trace").iterdir())
    assert found == ["cpu", "usage.gz", "ust"]
    assert "usage_left_out" not in ended.err + ended.out
    with Database(tmp_path / "msgflow.duckdb") as database:
        slept = database.sql(
            "SELECT n.name FROM thread_usage JOIN thread USING (thread_id) JOIN node AS n"
            " USING (process_id) GROUP BY ALL HAVING sum(running_ns) BETWEEN 1e6 AND 5e9"
        )
        assert {row["name"] for row in slept.to_arrow().to_pylist()} >= {"camera", "detector"}
        (clock,) = database.query("clocks").to_arrow().to_pylist()
        (first, *_) = database.why().verdict.table.to_pylist()
    assert clock["offset_ns"] == -12_500
    # What is slow, then the paths.
    shown = " ".join(ended.out.split())
    assert shown.index(first["headline"]) < shown.index("/camera → /image → /detector")


@pytest.mark.thorough
class TestKernel:
    """The scheduler, with perf: no LTTng of a virtual machine has its kernel modules."""

    @pytest.fixture(autouse=True)
    def _perf(self) -> None:
        if can_trace_kernel():
            pytest.skip("LTTng can trace this kernel")
        if reason := why_not(SCHEDULER_OPTIONS):
            pytest.skip(reason)

    def test_states_of_threads_are_on_the_clock_of_messages(
        self, record: Record, robot: list[str], tmp_path: Path
    ) -> None:
        ended = record("--kernel", "--duration", "5", "-o", "trace", "--", *robot, "0.05")
        assert ended.exit_code == 0, ended.err
        assert sorted(path.name for path in (tmp_path / "trace").iterdir()) == [
            "cpu",
            "perf",
            "usage.gz",
            "ust",
        ]
        with Database(tmp_path / "msgflow.duckdb") as database:
            # In some virtual machines perf lacks the switches of a CPU that idles: then the states
            # there are unknown.
            found = database.sql(
                "SELECT s.state FROM thread_state AS s JOIN thread USING (thread_id)"
                " JOIN node AS n USING (process_id) WHERE n.name = 'camera' AND s.start_ns"
                " BETWEEN (SELECT min(taken_ns) FROM take) AND (SELECT max(taken_ns) FROM take)"
            )
        assert len(found) > 20

    @pytest.mark.parametrize(("how", "left"), [("INT", "perf"), ("KILL", "perf.scheduler")])
    def test_a_perf_that_ends_early_is_said(
        self, record: Record, robot: list[str], tmp_path: Path, how: str, left: str
    ) -> None:
        """What was recorded stays, and is read."""
        kills = f"sleep 2; pkill -{how} -x -P $PPID perf"
        ended = record(
            *("--kernel", "--duration", "5", "-o", "trace"),
            *("--", "sh", "-c", f'{kills}; exec "$@"', "sh", *robot, "0.05"),
        )
        assert ended.exit_code == 0, ended.err
        assert "perf ended before the recording" in ended.err
        assert ("is not read: perf data convert" in " ".join(ended.err.split())) == (how == "KILL")
        found = sorted(path.name for path in (tmp_path / "trace").iterdir())
        assert found == ["cpu", left, "usage.gz", "ust"]
        assert "/camera → /image → /detector" in ended.out


@pytest.mark.parametrize("option", ["--links", "--clock-sync"])
def test_a_file_that_is_missing_is_said_before_anything_starts(
    refused: Callable[..., Result], option: str, tmp_path: Path
) -> None:
    ended = refused(option, "no-such.yaml", "--", "touch", "started")
    assert ended.exit_code == 2
    assert "no-such.yaml" in ended.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.thorough
@pytest.mark.parametrize("program", [[], ["--", "sleep", "60"]])
def test_a_terminal_shows_how_the_recording_goes(tmp_path: Path, program: list[str]) -> None:
    """In one line; beside a program, which writes there as well, in a line now and then."""
    words = ("--duration", "11", "--no-ingest", *program)
    with Terminal([sys.executable, "-m", "msgflow", "record", *words], tmp_path) as terminal:
        assert terminal.wait() == 3
    seconds = re.findall(
        r"recording \(Ctrl-C ends it\): (\d+) s, some 0 events written \(0/s\), 0 discarded,",
        terminal.shown,
    )
    assert set(seconds) >= ({"10"} if program else {"1", "5", "10"})
    assert ("starting LTTng" in terminal.shown) != bool(program)


@pytest.mark.thorough
def test_discarded_events_are_said_at_once(record: Record, robot: list[str]) -> None:
    """A consumer that stands still for a second is too slow on any machine."""
    stalls = "sleep 1; pkill -STOP -x lttng-consumerd; sleep 1; pkill -CONT -x lttng-consumerd"
    ended = record(
        *("--duration", "5", "--subbuf-size", "4K", "--num-subbuf", "2", "--no-ingest"),
        *("--", "sh", "-c", f'({stalls}) & exec "$@"', "sh", *robot, "0.0005"),
    )
    assert ended.exit_code == 0, ended.err
    assert "--subbuf-size several times as large as 4K" in ended.err


@pytest.mark.thorough
def test_a_program_without_tracepoints_is_noticed(record: Record, tmp_path: Path) -> None:
    """Also one that has loaded a library without any."""
    ended = record("--duration", "6", "--no-ingest", "-o", "first", "--", "sleep", "60")
    assert ended.exit_code == 3
    assert "no event of ROS 2 was recorded" in ended.err
    assert "no process has the tracepoints of ROS 2: nodes are still starting" in ended.err
    assert "is tracing built in" not in ended.err
    own, wheel = "libtracetools.so", "liblttng-ust-4ea8a5c7.so.0"
    for names, said in (
        ((own,), "uses ROS 2 without tracepoints: is tracing built in"),
        # It comes with an LTTng of its own.
        ((own, wheel), "has tracepoints of a wheel of PyPI, which cannot be recorded"),
    ):
        for name in names:
            (tmp_path / name).write_bytes(b"none")
        loads = (
            f"import mmap, time; files = [open(name, 'r+b') for name in {names}];"
            " libraries = [mmap.mmap(file.fileno(), 0) for file in files]; time.sleep(60)"
        )
        words = ("--duration", "11", "--no-ingest", "-o", f"with-{len(names)}")
        ended = record(*words, "--", sys.executable, "-c", loads)
        assert ended.exit_code == 3
        assert said in " ".join(ended.err.split())


def test_what_a_program_prints_at_its_end_stands_before_the_answer(record: Record) -> None:
    """Such as the tracebacks of nodes that Ctrl-C ended."""
    ends = "trap 'sleep 1; echo KeyboardInterrupt >&2; exit' INT; while :; do sleep 0.1; done"
    ended = record("--duration", "1", "--no-ingest", "--", "sh", "-c", ends)
    printed, _, answer = ended.err.partition("recorded into ")
    assert answer
    assert "KeyboardInterrupt" in printed


@pytest.mark.thorough
def test_all_that_a_program_started_ends_with_it(
    record: Record, sleeping: list[str], tmp_path: Path
) -> None:
    program = f"{' '.join(sleeping)} & echo $! > child; wait"
    ended = record("--duration", "1", "--no-ingest", "--", "sh", "-c", program)
    assert ended.exit_code == 3
    child = int((tmp_path / "child").read_text())
    assert not Path(f"/proc/{child}").exists()


@pytest.mark.thorough
def test_what_a_program_prints_is_not_among_the_tables(record: Record) -> None:
    ended = record("--no-ingest", "--", "sh", "-c", "echo [INFO] started")
    assert ended.out == ""
    assert "[INFO] started" in ended.err


def test_a_program_beside_a_screen_reads_no_keys(tmp_path: Path) -> None:
    """The screen reads them: with two readers, each would get some."""
    code = (
        "import sys, time; from msgflow.record.program import Program\n"
        "program = Program(['cat'], open(sys.argv[1], 'wb'))\n"
        "while program.exit_code is None: time.sleep(0.01)"
    )
    words = [sys.executable, "-c", code, str(tmp_path / "log")]
    with subprocess.Popen(words, stdin=subprocess.PIPE) as process:
        # Its stdin stays open meanwhile.
        assert process.wait(timeout=20) == 0


def test_a_program_of_another_user_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """As with sudo: we may not end it."""
    program = Program(["sleep", "60"], None)
    notes: list[str] = []

    def refused(group: int, number: int) -> None:
        raise PermissionError(errno.EPERM, "Operation not permitted")

    with monkeypatch.context() as patched:
        patched.setattr(os, "killpg", refused)
        program.end(notes.append)
    (note,) = notes
    assert note.startswith("sleep runs on, as it belongs to another user: sudo kill -INT -- -")
    os.kill(int(note.rpartition("-")[2]), signal.SIGKILL)
    program.end(notes.append)
    assert len(notes) == 1


@pytest.mark.thorough
@pytest.mark.parametrize("seconds", [0.2, 0.9, 1.4, 1.9, 3.5])
def test_ctrl_c_leaves_nothing(record: Record, sleeping: list[str], seconds: float) -> None:
    """Whether LTTng starts, the session begins, or events are recorded."""
    ended = record("--no-ingest", "--", *sleeping, after=seconds)
    assert ended.exit_code in (3, 130), ended.err


@pytest.mark.thorough
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_leaves_nothing(
    record: Record, sleeping: list[str], number: signal.Signals
) -> None:
    assert record("--", *sleeping, after=4, number=number).exit_code == 143


@pytest.mark.thorough
def test_a_wait_for_a_session_of_others_ends_at_the_first_signal(record: Record) -> None:
    begins = "lttng --no-sessiond create other; sleep 60"
    ended = record("--no-ingest", "--duration", "1", "--", "sh", "-c", begins, after=20, number=15)
    assert ended.exit_code == 143
    assert "it waits for: other" in ended.err


@pytest.mark.thorough
@pytest.mark.parametrize("then", ["", "; sleep 60"])
def test_a_directory_that_the_program_removes_is_named(
    record: Record, tmp_path: Path, then: str
) -> None:
    ended = record("-o", "drive", "--", "sh", "-c", f"rm -r drive{then}")
    assert ended.exit_code == 1
    assert f"the directory of the recording was removed — {tmp_path / 'drive'}" in ended.err


@pytest.mark.thorough
def test_sigkill_ends_the_daemon_too(record: Record) -> None:
    assert record(after=4, number=signal.SIGKILL).exit_code == -signal.SIGKILL


@pytest.mark.thorough
@pytest.mark.usefixtures("daemon")
class TestForeignDaemon:
    """Another one owns the daemon: it stays, with the sessions of others."""

    @pytest.fixture(autouse=True)
    def _other_session(self, tmp_path: Path, daemon: None) -> Iterator[None]:
        lttng("create", "other", f"--output={tmp_path / 'other'}")
        yield
        assert "other" in lttng("list").stdout

    def test_a_session_of_a_killed_recording_is_removed(self, record: Record) -> None:
        record("--name", "first", after=4, number=signal.SIGKILL)
        assert "first [" in lttng("list").stdout
        assert "first-cpu [" in lttng("list").stdout
        ended = record("--name", "second", "--no-ingest", "--duration", "0.5")
        assert "the session of a recording that was killed is removed: first" in ended.err
        assert "first" not in lttng("list").stdout

    def test_dual_adds_the_names_of_nodes_that_run_already(
        self, record: Record, robot: list[str]
    ) -> None:
        lttng("create", "start", "--snapshot")
        lttng("enable-event", "--userspace", "ros2:*", "--session=start")
        types = [f"--type={name}" for name in ("vpid", "vtid", "procname")]
        lttng("add-context", "--userspace", "--session=start", *types)
        lttng("start", "start")
        with subprocess.Popen([*robot, "0.05"]) as node:
            try:
                time.sleep(4)
                without = record("--duration", "1", "--name", "first", "--db", "a.duckdb")
                ended = record(
                    "--duration", "2", "--name", "second", "--db", "b.duckdb", "--dual", "start"
                )
            finally:
                node.kill()
                lttng("destroy", "start")
        assert "--dual start has them" in without.err
        assert "/image" not in without.out
        assert "/camera → /image → /detector" in ended.out

    def test_a_session_that_another_program_destroyed_is_read(
        self, record: Record, robot: list[str], tmp_path: Path
    ) -> None:
        destroy = "sleep 6; lttng --no-sessiond destroy drive"
        with subprocess.Popen(["sh", "-c", destroy]):
            ended = record("--name", "drive", "--", *robot, "0.05")
        assert ended.exit_code == 0, ended.err
        assert "the session drive was destroyed by another program" in ended.err
        assert "/camera → /image → /detector" in ended.out
        found = sorted(path.name for path in (tmp_path / "drive").iterdir())
        assert found == ["cpu", "usage.gz", "ust"]

    def test_a_name_in_use_is_refused(self, record: Record, tmp_path: Path) -> None:
        ended = record("--name", "other", "--duration", "0.5")
        assert ended.exit_code == 1
        assert "lttng destroy other" in ended.err
        assert not list(tmp_path.glob("recording*"))


@pytest.mark.parametrize("is_link", [False, True])
def test_a_directory_in_use_is_refused(
    refused: Callable[..., Result], tmp_path: Path, is_link: bool
) -> None:
    if is_link:
        (tmp_path / "used").symlink_to("nowhere")
    else:
        (tmp_path / "used").mkdir()
        (tmp_path / "used" / "file").touch()
    ended = refused("-o", "used", "--duration", "0.5")
    assert (ended.exit_code, "the directory is in use" in ended.stderr) == (1, True)


def test_a_missing_program_is_refused_before_anything_starts(
    refused: Callable[..., Result],
) -> None:
    ended = refused("--", "no-such-program")
    assert ended.exit_code == 2
    assert "there is no such program — no-such-program" in ended.stderr


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("-o", "file/sub"), 1, "no directory"),
        (("--name", "a/b"), 2, "a session cannot have a name with a slash"),
        (("--name", "a\x1bb"), 2, "a session cannot have a name with a control character — 'a"),
        (("--events", ""), 2, "an event has no name"),
        (("--profile", "\u0669\u0669"), 2, "no rate of samples"),
        (("--dual", "nosuch"), 1, "LTTng has no snapshot session of this name — nosuch"),
        (("--db", "nosuch/a.duckdb"), 4, "no such directory — nosuch"),
        (("--db", "file"), 4, "file"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_starts(
    refused: Callable[..., Result], tmp_path: Path, words: tuple[str, ...], code: int, said: str
) -> None:
    (tmp_path / "file").write_text("taken")
    ended = refused(*words, "--", "touch", "started")
    assert ended.exit_code == code, ended.stderr
    assert said in ended.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.thorough
def test_a_program_that_fails_at_once_is_named(record: Record) -> None:
    ended = record("--", "false")
    assert ended.exit_code == 3
    assert "false ended with exit code 1" in ended.err
    assert "no event of ROS 2 was recorded" in ended.err


def test_without_lttng(
    refused: Callable[..., Result], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    ended = refused()
    assert ended.exit_code == 1
    assert "apt-get install lttng-tools" in ended.stderr


def test_a_daemon_that_cannot_start_says_why(record: Record, tmp_path: Path) -> None:
    program = tmp_path / "bin" / "lttng-sessiond"
    program.parent.mkdir()
    program.write_text("#!/bin/sh\necho 'Error: no room for buffers' >&2; exit 1\n")
    program.chmod(0o755)
    path = f"{program.parent}:{os.environ['PATH']}"
    ended = record("--duration", "1", env=os.environ | {"PATH": path})
    assert ended.exit_code == 1
    assert "the session daemon of LTTng does not start: no room for buffers" in ended.err
