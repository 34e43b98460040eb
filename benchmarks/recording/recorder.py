"""Records a system of real ROS 2 nodes with LTTng, with what is true of it."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

from msgflow import trace
from recording.tracetools import build_tracetools

if TYPE_CHECKING:
    from collections.abc import Iterator

_NODES = Path(__file__).with_name("nodes.py")
_SESSION = "msgflow-real"
# Settings of ros2_tracing, with larger sub-buffers: nothing may be lost.
_SET_UP = (
    ("enable-channel", "--userspace", "--subbuf-size=1M", "--num-subbuf=4", "ros2"),
    ("enable-event", "--userspace", "--channel=ros2", "ros2:*"),
    ("enable-event", "--userspace", "--channel=ros2", "my_pkg:*"),
    ("add-context", "--userspace", "--type=vpid", "--type=vtid", "--type=procname"),
    ("start",),
)
# Those who hear go last. Seconds.
_APART = 0.2
_LONGEST = 60


class NotPossibleError(Exception):
    """Something that a recording needs is missing; the text says what."""


def systems(python: Path) -> dict[str, list[str]]:
    """Return the processes of each system."""
    code = "import json, nodes; print(json.dumps({k: [*v] for k, v in nodes.SYSTEMS.items()}))"
    run = subprocess.run(
        [python, "-c", code],
        cwd=_NODES.parent,
        env=_environment(python),
        capture_output=True,
        text=True,
        check=True,
    )
    named: dict[str, list[str]] = json.loads(run.stdout)
    return named


def require(python: Path) -> None:
    """Raise a `NotPossibleError` unless LTTng, a compiler and rclpy are there."""
    for program in ("lttng", "lttng-sessiond", "gcc"):
        if shutil.which(program) is None:
            raise NotPossibleError(f"no {program}")
    needed = [str(python), "-c", "import rclpy.action, std_msgs.msg, test_msgs.action"]
    if not python.exists() or subprocess.run(needed, capture_output=True).returncode:
        raise NotPossibleError(f"no Python with rclpy and test_msgs — {python}")


def record(python: Path, system: str, seconds: float, directory: Path) -> tuple[Path, Path]:
    """Record a system for some seconds.

    Args:
        python: of the environment with rclpy.
        system: one of `systems`.
        seconds: for how long it runs.
        directory: an empty directory to write to.

    Returns:
        The directory of the trace, and the file of the truth.

    Raises:
        NotPossibleError: see `require`.
        subprocess.CalledProcessError: LTTng or a node failed.
    """
    require(python)
    library = build_tracetools(_made(directory / "library"))
    environment = _environment(python) | {"LD_PRELOAD": str(library)}
    parts = _made(directory / "truth")
    recorded = directory / "trace"
    with session(recorded):
        running = []
        try:
            for process in systems(python)[system]:
                command = [str(word) for word in (python, _NODES, system, process, parts / process)]
                running.append(
                    subprocess.Popen(
                        command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE
                    )
                )
            for one in running:
                assert one.stdout is not None
                one.stdout.readline()
            time.sleep(seconds)
            for one in reversed(running):
                assert one.stdin is not None
                one.stdin.close()
                time.sleep(_APART)
                if one.wait(_LONGEST):
                    raise subprocess.CalledProcessError(one.returncode, one.args)
        finally:
            for one in running:
                one.kill()
    with trace.open([recorded]) as traces:
        (offset,) = {one.clock_offset_ns for one in traces.traces}
    truth = directory / "truth.jsonl"
    meta = json.dumps({"k": "meta", "name": system, "clock_offset_ns": offset})
    rows = "".join(part.read_text() for part in sorted(parts.iterdir()))
    truth.write_text(f"{meta}\n{rows}")
    return recorded, truth


@contextlib.contextmanager
def session(directory: Path) -> Iterator[None]:
    """Trace what happens in the block, and start a session daemon if none runs.

    A machine has one daemon of root: others wait.
    """
    lock = Path(tempfile.gettempdir()) / f"{_SESSION}.lock"
    with tempfile.TemporaryDirectory() as home, lock.open("w") as one_at_a_time:
        fcntl.flock(one_at_a_time, fcntl.LOCK_EX)
        environment = os.environ | {"LTTNG_HOME": home}
        command = ["lttng-sessiond", "--no-kernel", "--quiet"]
        daemon = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL)

        def lttng(*arguments: str) -> None:
            command = ["lttng", "--no-sessiond", *arguments]
            subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, check=True)

        try:
            _wait_for_daemon(environment)
            lttng("create", _SESSION, f"--output={directory}")
            try:
                for arguments in _SET_UP:
                    lttng(*arguments)
                yield
                lttng("stop")
            finally:
                lttng("destroy", _SESSION)
        finally:
            daemon.terminate()
            daemon.wait()


def _wait_for_daemon(environment: dict[str, str]) -> None:
    end = time.monotonic() + _LONGEST
    while time.monotonic() < end:
        command = ["lttng", "--no-sessiond", "list"]
        if not subprocess.run(command, env=environment, capture_output=True).returncode:
            return
        time.sleep(0.1)
    raise NotPossibleError("lttng-sessiond does not start")


def _environment(python: Path) -> dict[str, str]:
    return os.environ | {
        "AMENT_PREFIX_PATH": str(python.parent.parent),
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        "ROS_LOCALHOST_ONLY": "1",
        # Processes wait for the first answer of the session daemon: no event is missed.
        "LTTNG_UST_REGISTER_TIMEOUT": "-1",
    }


def _made(directory: Path) -> Path:
    directory.mkdir(parents=True)
    return directory
