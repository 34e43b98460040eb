"""Records a system of real ROS 2 nodes with LTTng, with what is true of it."""

from __future__ import annotations

import contextlib
import fcntl
import functools
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from msgflow import trace
from msgflow.record.daemon import session_daemon
from msgflow.record.program import PYTHON_NODES
from msgflow.record.session import Channel, recording_session
from recording.quota import cgroup_with_quota
from recording.tracetools import build_program, build_tracetools

_NODES = Path(__file__).with_name("nodes.py")
# Those who hear go last. Seconds.
_APART = 0.2
_LONGEST = 60
# Systems whose process ends half-way and begins anew, that run before their session begins, and
# with processes whose callbacks are not traced in any case.
_RESTARTED = {"restarts": "filter"}
_LATE = {"late"}
_UNTRACED = {"mixed": {"filter"}}
_UNTIL_LATE = 2.0
_LAUNCH = _NODES.parents[1] / "robot" / "launch.py"
QUOTA = "quota"
"""A problem of a robot: one of its processes has a quota of CPU time."""


class NotPossibleError(Exception):
    """Something that a recording needs is missing; the text says what."""


def systems(python: Path) -> dict[str, list[str]]:
    """Return the processes of each system."""
    code = "import json, nodes; print(json.dumps({k: [*v] for k, v in nodes.SYSTEMS.items()}))"
    run = subprocess.run(
        [python, "-c", code],
        env=ros_environment(python) | {"PYTHONPATH": str(_NODES.parent)},
        capture_output=True,
        text=True,
        check=True,
    )
    named: dict[str, list[str]] = json.loads(run.stdout)
    return named


def require_lttng() -> None:
    """Raise a `NotPossibleError` unless LTTng and a compiler are there."""
    for program in ("lttng", "lttng-sessiond", "gcc"):
        if shutil.which(program) is None:
            raise NotPossibleError(f"no {program}")


@functools.cache
def require(python: Path) -> None:
    """Raise a `NotPossibleError` unless LTTng, a compiler and rclpy are there."""
    require_lttng()
    needed = [str(python), "-c", "import rclpy.action, std_msgs.msg, test_msgs.action"]
    if not python.exists() or subprocess.run(needed, capture_output=True).returncode:
        raise NotPossibleError(f"no Python with rclpy and test_msgs — {python}")


def record(
    python: Path, system: str, seconds: float, directory: Path, *, python_nodes: bool = False
) -> tuple[Path, Path]:
    """Record a system for some seconds.

    Args:
        python: of the environment with rclpy.
        system: one of `systems`.
        seconds: for how long it runs.
        directory: an empty directory to write to.
        python_nodes: callbacks and executors of rclpy are traced, too.

    Returns:
        The directory of the trace, and the file of the truth.

    Raises:
        NotPossibleError: see `require`.
        subprocess.CalledProcessError: a node failed.
        RecordingError: LTTng failed.
    """
    require(python)
    library = build_tracetools(_made(directory / "library"))
    environment = ros_environment(python) | {"LD_PRELOAD": str(library)}
    parts = _made(directory / "truth")
    recorded = directory / "trace"

    def start(process: str) -> subprocess.Popen[bytes]:
        traced = python_nodes and process not in _UNTRACED.get(system, ())
        return subprocess.Popen(
            [str(word) for word in (python, _NODES, system, process, parts / process)],
            env=environment | ({"PYTHONPATH": str(PYTHON_NODES)} if traced else {}),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )

    with contextlib.ExitStack() as stack:
        if system in _LATE:
            # Processes that run already would connect to a new one later.
            stack.enter_context(session_daemon(with_kernel=False, note=print))
        else:
            stack.enter_context(session(recorded))
        running: dict[str, subprocess.Popen[bytes]] = {}
        try:
            for process in systems(python)[system]:
                running[process] = start(process)
            for one in running.values():
                _wait_until_ready(one)
            if system in _LATE:
                time.sleep(_UNTIL_LATE)
                stack.enter_context(session(recorded))
            time.sleep(seconds / 2)
            if (restarted := _RESTARTED.get(system)) is not None:
                _end(running[restarted])
                running[restarted] = start(restarted)
                _wait_until_ready(running[restarted])
            time.sleep(seconds / 2)
            for one in reversed(running.values()):
                _end(one)
        finally:
            for one in running.values():
                one.kill()
    with trace.open([recorded]) as traces:
        (offset,) = {one.clock_offset_ns for one in traces.traces}
    truth = directory / "truth.jsonl"
    meta = json.dumps({"k": "meta", "name": system, "clock_offset_ns": offset})
    rows = "".join(part.read_text() for part in sorted(parts.iterdir()))
    truth.write_text(f"{meta}\n{rows}")
    return recorded, truth


def record_launched(
    python: Path,
    robot: str,
    problems: Sequence[str],
    seconds: float,
    directory: Path,
    *,
    with_kernel: bool,
) -> Path:
    """Record a robot of `robot/launch.py` with `msgflow record`, as a user does.

    Args:
        python: of the environment with rclpy.
        robot: its name.
        problems: that are planted.
        seconds: for how long it runs once all its processes do.
        directory: a directory to write to.
        with_kernel: record the events of the kernel, too.

    Returns:
        The directory of the recording: `ust`, and what else is recorded beside it.

    Raises:
        NotPossibleError: see `require`.
        OSError: a cgroup with a quota cannot be made.
        subprocess.SubprocessError: the recording failed, or the robot did not start; `record.log`
            says why.
    """
    require(python)
    library = build_tracetools(_made(directory / "library"))
    if (source := _LAUNCH.with_name(f"{robot}.c")).exists():
        build_program(source, library.parent)
    ready = directory / "ready"
    recorded = directory / "trace"
    # Python of msgflow has no use for it.
    launched = ("env", f"LD_PRELOAD={library}", python, _LAUNCH, robot, ready, seconds, *problems)
    options = ["--name", directory.name, "-o", recorded, "--no-ingest"]
    if with_kernel:
        options.append("--kernel")
    command = [str(word) for word in (sys.executable, "-m", "msgflow", "record", *options)]
    with contextlib.ExitStack() as stack:
        stack.enter_context(one_at_a_time())
        log = stack.enter_context((directory / "record.log").open("w"))
        if QUOTA in problems:
            group = stack.enter_context(cgroup_with_quota())
            (directory / "group").symlink_to(group)
        recording = subprocess.Popen(
            [*command, "--", *(str(word) for word in launched)],
            env=ros_environment(python),
            cwd=directory,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
        )
        try:
            latest = time.monotonic() + _LONGEST
            while not ready.exists() and recording.poll() is None and time.monotonic() < latest:
                time.sleep(_APART)
            time.sleep(seconds)
            # As Ctrl-C does: the recording ends, then the robot.
            recording.send_signal(signal.SIGINT)
            code = recording.wait(_LONGEST)
        finally:
            recording.kill()
    if not (ready.exists() and (recorded / "ust").is_dir()):
        raise subprocess.CalledProcessError(code, command)
    return recorded


@contextlib.contextmanager
def session(directory: Path) -> Iterator[None]:
    """Trace what happens in the block.

    Raises:
        RecordingError: LTTng fails.
    """
    directory.mkdir(parents=True)
    channel = Channel(("ros2:*", "agnocast:*", "my_pkg:*"), "1M", 4)
    with (
        one_at_a_time(),
        session_daemon(with_kernel=False, note=print),
        recording_session("msgflow-real", directory, channel),
    ):
        yield


@contextlib.contextmanager
def one_at_a_time() -> Iterator[None]:
    """Wait for other blocks of this machine: it has one session daemon of the root user."""
    with (Path(tempfile.gettempdir()) / "msgflow-real.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def ros_environment(python: Path) -> dict[str, str]:
    """Return the environment in which nodes of rclpy run."""
    return os.environ | {
        "AMENT_PREFIX_PATH": str(python.parent.parent),
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        "ROS_LOCALHOST_ONLY": "1",
        # Processes wait for the first answer of the session daemon: no event is missed.
        "LTTNG_UST_REGISTER_TIMEOUT": "-1",
    }


def _wait_until_ready(process: subprocess.Popen[bytes]) -> None:
    assert process.stdout is not None
    process.stdout.readline()


def _end(process: subprocess.Popen[bytes]) -> None:
    assert process.stdin is not None
    process.stdin.close()
    time.sleep(_APART)
    if process.wait(_LONGEST):
        raise subprocess.CalledProcessError(process.returncode, process.args)


def _made(directory: Path) -> Path:
    directory.mkdir(parents=True)
    return directory
