"""`msgflow watch` with the real LTTng, while nodes run: what it shows, and that it ends."""

from __future__ import annotations

import itertools
import json
import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import pytest
from support.lttng_program import lttng
from support.terminal import Terminal

PATH = "/camera → /image → /detector"
Watch = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def watch(tmp_path: Path) -> Iterator[Watch]:
    """Starts the command in an empty directory, with windows of a second, as JSON."""
    started = []

    def run(*words: object) -> subprocess.Popen[str]:
        options = ("--json", "--window", "1s", "--step", "1s")
        process = subprocess.Popen(
            [sys.executable, "-m", "msgflow", "watch", *options, *map(str, words)],
            cwd=tmp_path,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        return process

    yield run
    for process in started:
        # It ends its program as well, which a kill would leave.
        process.send_signal(signal.SIGINT)
        try:
            process.wait(30)
        finally:
            process.kill()
            process.wait()


def windows(process: subprocess.Popen[str]) -> tuple[list[dict[str, Any]], str]:
    """Return the windows of a command that ends, and what it said."""
    out, err = process.communicate(timeout=200)
    assert process.returncode == 0, err
    return [json.loads(line) for line in out.splitlines()], err


def require_whole(found: list[dict[str, Any]]) -> None:
    """Require windows without a hole, and messages on their way to the end."""
    for before, after in itertools.pairwise(found):
        assert before["end_ns"] == after["start_ns"]
    assert sum(path["reached"] for window in found for path in window["paths"]) > 30
    assert not any(window["losses"] for window in found)


@pytest.mark.thorough
def test_a_program_is_recorded_and_watched(watch: Watch, robot: list[str], tmp_path: Path) -> None:
    # It ends the program, and says so by its exit code, which would be that of the view.
    ended = 'timeout -s INT 8 "$@" || test $? = 124'
    found, _ = windows(watch("--", "sh", "-c", ended, "sh", *robot, "0.05"))
    assert len(found) > 1
    require_whole(found)
    # The recording was temporary.
    assert [path.name for path in tmp_path.iterdir()] == ["library"]


@pytest.mark.thorough
def test_a_program_ends_with_the_reader_of_the_view(watch: Watch, robot: list[str]) -> None:
    """As with `| head -1`."""
    process = watch("--", *robot, "0.05")
    wait_for_window(process)
    assert process.stdout is not None
    process.stdout.close()
    assert process.wait(20) == 0


def test_a_closed_stdout_is_refused_before_anything_starts(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "msgflow", "watch", "--", "touch", "started"]
    ended = subprocess.run(
        ["sh", "-c", f"exec {shlex.join(words)} >&-"], cwd=tmp_path, capture_output=True, text=True
    )
    assert ended.returncode == 2
    assert "cannot write to stdout: it is closed" in ended.stderr
    assert not list(tmp_path.iterdir())


SPEAKS = ["sh", "-c", "echo [INFO] started; echo [ERROR] failed >&2; sleep 9; exit 3"]


@pytest.mark.thorough
def test_what_a_program_prints_is_no_window(watch: Watch) -> None:
    out, err = watch("--", *SPEAKS).communicate(timeout=60)
    assert out == ""
    assert "[INFO] started\n[ERROR] failed\n" in err


@pytest.mark.thorough
def test_what_a_program_prints_does_not_tear_the_screen(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "msgflow", "watch", "--", *SPEAKS]
    with Terminal(command, tmp_path) as terminal:
        # The program fails.
        assert terminal.wait() == 1
    assert "[INFO]" not in terminal.shown
    assert "[ERROR]" not in terminal.shown
    (log,) = tmp_path.iterdir()
    assert log.read_text() == "[INFO] started\n[ERROR] failed\n"
    # In a terminal of 80 columns, these take more than a line.
    said = " ".join(terminal.shown.split())
    assert f"what sh prints goes to {log.name}" in said
    assert f"sh ended with exit code 3: {log.name} has what it printed" in said


@pytest.mark.thorough
def test_a_recording_with_a_name_has_what_the_program_printed_beside_it(tmp_path: Path) -> None:
    """In a new file: not in one that is there, nor where a link leads to."""
    (tmp_path / "drive.log").write_text("matters")
    (tmp_path / "drive-2.log").symlink_to(tmp_path / "elsewhere")
    speaks = ["sh", "-c", "echo spoken; sleep 1"]
    command = [sys.executable, "-m", "msgflow", "watch", "-o", "drive", "--", *speaks]
    with Terminal(command, tmp_path) as terminal:
        terminal.wait()
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"drive", "drive.log", "drive-2.log", "drive-3.log"}
    assert (tmp_path / "drive.log").read_text() == "matters"
    assert (tmp_path / "drive-3.log").read_text() == "spoken\n"


@pytest.mark.thorough
@pytest.mark.parametrize("program", [["true"], ["sh", "-c", "echo spoken; rm watch-*.log"]])
def test_a_program_that_prints_nothing_leaves_nothing(tmp_path: Path, program: list[str]) -> None:
    """Nor does one that removes what it printed."""
    command = [sys.executable, "-m", "msgflow", "watch", "--", *program]
    with Terminal(command, tmp_path) as terminal:
        assert terminal.wait() == 0
    assert not list(tmp_path.iterdir())


@pytest.fixture
def temporary(tmp_path: Path) -> Path:
    """A directory for temporary files."""
    path = tmp_path / "temporary"
    path.mkdir()
    return path


@pytest.fixture
def programs(tmp_path: Path) -> Iterator[Path]:
    """The file in which SLEEPS has its numbers; at the end none of them runs."""
    path = tmp_path / "programs"
    yield path
    for number in path.read_text().split() if path.exists() else ():
        with suppress(ProcessLookupError):
            os.kill(int(number), signal.SIGKILL)


SLEEPS = ["sh", "-c", "echo $$ >> programs; exec sleep 1000"]
WATCH = [sys.executable, "-m", "msgflow", "watch", "--", *SLEEPS]


def wait_for_words(terminal: Terminal) -> None:
    terminal.wait_for(lambda: "no process has the tracepoints" in terminal.shown)


@pytest.mark.thorough
def test_a_terminal_that_goes_away_ends_all(
    tmp_path: Path, temporary: Path, programs: Path
) -> None:
    with Terminal(WATCH, tmp_path, TMPDIR=str(temporary)) as terminal:
        wait_for_words(terminal)
        assert [path.name[:14] for path in temporary.iterdir()] == ["msgflow-watch-"]
        terminal.hang_up()
        terminal.process.wait(30)
    assert not list(temporary.iterdir())
    assert not Path("/proc", programs.read_text().strip()).exists()


@pytest.mark.thorough
def test_what_a_killed_view_leaves_is_removed(
    daemon: None, tmp_path: Path, temporary: Path, programs: Path
) -> None:
    """Its session, and its temporary directories; not those of a view that runs."""
    words = [sys.executable, "-m", "msgflow", "record", "--no-ingest", "--duration", "0.5"]
    with_pages = [*WATCH[:4], "--ui", "0", *WATCH[4:]]
    with ExitStack() as stack:
        terminals = []
        for view in (with_pages, WATCH):
            terminal = stack.enter_context(Terminal(view, tmp_path, TMPDIR=str(temporary)))
            wait_for_words(terminal)
            terminals.append(terminal)
        first, second = terminals
        # That of the recording, and that of the window that the pages show.
        made = [path.name for path in temporary.iterdir()]
        assert len([name for name in made if f"-{first.process.pid}-" in name]) == 2
        first.process.kill()
        first.process.wait()
        with Terminal(words, tmp_path, TMPDIR=str(temporary)) as third:
            assert third.wait() == 0
        (left,) = temporary.iterdir()
        assert f"-{second.process.pid}-" in left.name
        second.process.send_signal(signal.SIGINT)
        assert second.wait() == 0
    # The program of the one that was killed goes on.
    numbers = programs.read_text().split()
    (_,) = (number for number in numbers if Path(f"/proc/{number}").exists())
    assert "watch-" not in lttng("list").stdout


@pytest.fixture
def session(daemon: None, tmp_path: Path) -> Iterator[Path]:
    """Session `drive` of someone else, which is not rotated yet."""
    directory = tmp_path / "drive"
    lttng("create", "drive", f"--output={directory}")
    lttng("enable-event", "--userspace", "ros2:*", "--session=drive")
    types = [f"--type={name}" for name in ("vpid", "vtid", "procname")]
    lttng("add-context", "--userspace", "--session=drive", *types)
    lttng("start", "drive")
    yield directory
    lttng("destroy", "drive")


def wait_for_window(process: subprocess.Popen[str]) -> dict[str, Any]:
    """Return the next window that has messages."""
    assert process.stdout is not None
    for line in process.stdout:
        window = json.loads(line)
        if any(path["reached"] for path in window["paths"]):
            return window
    raise AssertionError(process.stderr and process.stderr.read())


@pytest.mark.thorough
def test_a_session_is_rotated_and_its_end_noticed(
    watch: Watch, session: Path, robot: list[str]
) -> None:
    """A watcher that is killed does no harm; the next one knows the names of all nodes."""
    with subprocess.Popen([*robot, "0.05"]) as node:
        try:
            first = watch("drive")
            wait_for_window(first)
            first.kill()
            second = watch(session)
            window = wait_for_window(second)
            assert any(PATH in path["path"] for path in window["paths"])
            assert window["lag_s"] > 0
            lttng("destroy", "drive")
            found, _ = windows(second)
        finally:
            node.kill()
    assert found[-1]["lag_s"] is None
    assert found[-1]["end_ns"] > window["end_ns"]


@pytest.mark.thorough
def test_two_watchers_of_one_session(watch: Watch, session: Path, robot: list[str]) -> None:
    """The first one made it rotate, and ends; the session rotates until the second one does."""
    with subprocess.Popen([*robot, "0.05"]) as node:
        try:
            first = watch("drive")
            wait_for_window(first)
            second = watch("drive")
            wait_for_window(second)
            first.send_signal(signal.SIGINT)
            found, _ = windows(first)
            end = time.monotonic() + 30
            while "rotat" not in lttng("list", "drive").stdout:
                assert time.monotonic() < end
                time.sleep(0.1)
            while wait_for_window(second)["start_ns"] <= found[-1]["end_ns"]:
                pass
            second.send_signal(signal.SIGINT)
            windows(second)
        finally:
            node.kill()
    assert "rotat" not in lttng("list", "drive").stdout


@pytest.mark.thorough
def test_ctrl_c_ends_the_view_and_not_the_session(watch: Watch, session: Path) -> None:
    process = watch("drive")
    time.sleep(6)
    process.send_signal(signal.SIGINT)
    _, err = windows(process)
    assert "error" not in err
    assert "drive" in lttng("list").stdout
    # The watcher has switched off the rotation, as nobody reads the chunks now.
    assert "rotat" not in lttng("list", "drive").stdout
    assert os.path.isdir(session)


TARGETS = """
targets:
  - {from: /image, to: /detector, latency: p99 < 1 us}
"""
LISTENER = """
import sys
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node

def heard(message):
    for status in message.status:
        print(status.level[0], status.name, status.message, sorted(v.key for v in status.values))
    sys.stdout.flush()

rclpy.init()
node = Node("monitor")
node.create_subscription(DiagnosticArray, "/diagnostics", heard, 10)
rclpy.spin(node)
"""


@pytest.mark.thorough
def test_a_node_hears_verdicts_with_their_culprit(robot: list[str], tmp_path: Path) -> None:
    """The Python of ROS 2 runs the command, as it does where ROS 2 is installed."""
    environment = dict(word.split("=", 1) for word in robot[1 : robot.index("-c") - 1])
    environment = os.environ | environment
    del environment["LD_PRELOAD"]
    python = robot[robot.index("-c") - 1]
    if subprocess.run([python, "-c", "import diagnostic_msgs.msg"], env=environment).returncode:
        pytest.skip("no diagnostic_msgs")
    (tmp_path / "targets.yaml").write_text(TARGETS)
    heard = tmp_path / "heard"
    words = [
        "-m",
        "msgflow",
        "watch",
        "--window",
        "4s",
        "--step",
        "4s",
        "--targets",
        "targets.yaml",
        "--diagnostics",
        "--json",
        "--",
        "timeout",
        "-s",
        "INT",
        "30",
        *robot,
        "0.1",
    ]
    with heard.open("w") as file:
        listener = subprocess.Popen([python, "-c", LISTENER], env=environment, stdout=file)
    try:
        subprocess.run(
            [python, *words],
            cwd=tmp_path,
            capture_output=True,
            env=environment | {"PYTHONPATH": os.pathsep.join(sys.path)},
        )
    finally:
        listener.kill()
        listener.wait()
    (line, *_) = heard.read_text().splitlines()
    assert line.startswith("2 msgflow: /image → /detector /image → /image → /detector: latency ")
    assert "required p99 < 1 us: " in line
    assert line.endswith("['lag', 'lost', 'p50', 'p99']")
