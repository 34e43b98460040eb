"""Whether the tracer of Python nodes harms a robot, and what a callback costs with it.

    python benchmarks/harm.py --python PYTHON [--seconds 5] [--rounds 20] [--calls 2000]

Ten nodes of rclpy are recorded without the tracer, with it, and with one that finds no library,
meets another rclpy, or raises: when it is loaded, and while callbacks run. Exit codes and the
number of callbacks have to be the same, and where it fails one line more is on stderr. Then
callbacks run as fast as they can, without the tracer, with it and no session, and with both, in
turn: the CPU that one takes, and how many run in a second. PYTHON has the wheels of ROS 2 (`make
ros`). The exit code is 1 if it harms.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from recording.recorder import require, ros_environment, session
from recording.tracetools import build_tracetools

from msgflow.record.program import PYTHON_NODES

_ROBOT = Path(__file__).parent / "recording" / "ten.py"
_TRACER = "_msgflow_rclpy.py"
# Text of the tracer, and what stands there instead.
_FAULTS = {
    "no library": ('"libtracetools.so"', '"libnothing.so"'),
    "another rclpy": ("executor._make_handler,", "executor._renamed,"),
    "raises at once": ("import ctypes\n", "import ctypes\n1 / 0\n"),
    "raises in callbacks": ("    _work_for(executor)\n", "    1 / 0\n"),
}
# Of callbacks in some seconds on a machine that does other things, too.
_TOLERANCE = 0.1


@dataclass(frozen=True)
class Ended:
    """How a robot ended."""

    exit_code: int
    callbacks: int
    errors: list[str]


def main() -> None:
    """Print a line for each, then the costs."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--python", type=Path, required=True, help="Python with rclpy")
    parser.add_argument("--seconds", type=float, default=5, help="how long each robot runs")
    parser.add_argument("--rounds", type=int, default=20, help="of callbacks")
    parser.add_argument("--calls", type=int, default=2000, help="callbacks in a round")
    given = parser.parse_args()
    require(given.python)
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        library = str(build_tracetools(directory))
        environment = ros_environment(given.python) | {"LD_PRELOAD": library}
        bad = 0
        with session(directory / "faults"):
            base = run(given, environment)
            print(f"{'without':20} {base.callbacks:6} callbacks, exit code {base.exit_code}")
            for fault in ("", *_FAULTS):
                ended = run(given, environment | {"PYTHONPATH": str(_broken(directory, fault))})
                said = [line for line in ended.errors if line not in base.errors]
                is_good = (
                    ended.exit_code == base.exit_code == 0
                    and abs(ended.callbacks / base.callbacks - 1) < _TOLERANCE
                    and len(said) == bool(fault)
                )
                bad += not is_good
                print(
                    f"{fault or 'with':20} {ended.callbacks:6} callbacks, exit code"
                    f" {ended.exit_code}, {len(said)} lines{'' if is_good else '  ✗'}"
                )
        costs(given, environment, directory)
    sys.exit(1 if bad else 0)


def run(given: argparse.Namespace, environment: dict[str, str]) -> Ended:
    """Run a robot for some seconds."""
    ended = subprocess.run(
        [given.python, _ROBOT, str(given.seconds), "1"],
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    callbacks = ended.stdout.splitlines()
    # What ROS logs begins with its level and a time.
    errors = [line for line in ended.stderr.splitlines() if not line.startswith("[")]
    return Ended(ended.returncode, int(callbacks[0]) if callbacks else 0, errors)


def costs(given: argparse.Namespace, environment: dict[str, str], directory: Path) -> None:
    """Let two robots run callbacks in turn, with and without a session."""
    traced = environment | {"PYTHONPATH": str(PYTHON_NODES)}
    with contextlib.ExitStack() as stack:
        robots = [
            stack.enter_context(
                subprocess.Popen(
                    [given.python, _ROBOT, "0", str(given.calls)],
                    env=each,
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    text=True,
                    stderr=subprocess.DEVNULL,
                )
            )
            for each in (environment, traced)
        ]
        for robot in robots:
            stack.callback(robot.kill)
            assert robot.stdout is not None
            while robot.stdout.readline() != "ready\n":
                pass
        for recorded in (False, True):
            with session(directory / "costs") if recorded else contextlib.nullcontext():
                took = [[_took(robot) for robot in robots] for _ in range(given.rounds)]
            without, with_it = (statistics.median(each) for each in zip(*took, strict=True))
            more = statistics.median(b - a for a, b in took)
            print(
                f"{'recorded' if recorded else 'no session':20} {without / 1000:.1f} us a callback"
                f" without the tracer, {more / 1000:+.2f} us with it: {1e9 / with_it:,.0f} a second"
            )


def _took(robot: subprocess.Popen[str]) -> int:
    assert robot.stdin is not None
    assert robot.stdout is not None
    print(file=robot.stdin, flush=True)
    return int(robot.stdout.readline())


def _broken(directory: Path, fault: str) -> Path:
    """Return a folder with the tracer, in which something is wrong."""
    if not fault:
        return PYTHON_NODES
    folder = directory / fault.replace(" ", os.sep)
    shutil.copytree(PYTHON_NODES, folder, ignore=shutil.ignore_patterns("__pycache__"))
    text = (folder / _TRACER).read_text()
    old, new = _FAULTS[fault]
    assert text.count(old) >= 1, old
    (folder / _TRACER).write_text(text.replace(old, new))
    return folder


if __name__ == "__main__":
    main()
