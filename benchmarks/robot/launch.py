"""Runs a robot of rclpy until it is ended.

    python launch.py ROBOT READY SECONDS [PROBLEM]…

It makes the file READY when all nodes spin. SECONDS is how long they will run from then on: what is
planted to happen half-way does so then. A robot that is no file of Python beside this one is
the program library/ROBOT of the current directory. Needs no package of msgflow.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

_HERE = Path(__file__).resolve().parent
_GONE_SECONDS = 2
_LATE_SECONDS = 4
_GROUP = Path("group")


@dataclass(frozen=True)
class Robot:
    """A robot.

    Attributes:
        processes: those who hear come first.
        restarted: the process that is killed half-way, and started again.
        late: the process that is started after the others.
        limited: the process in the cgroup that the directory `group` is, if there is one.
        hog: the file of the program that takes the CPU.
        hogs: how it is called, one for each.
    """

    processes: tuple[str, ...]
    restarted: str = ""
    late: str = ""
    limited: str = ""
    hog: str = "hog.py"
    hogs: tuple[tuple[str, ...], ...] = ((),) * (1 + (os.cpu_count() or 1))


ROBOTS = {
    "robot": Robot(
        ("control", "planner", "map_server", "localization", "detector", "filter", "camera",
         "lidar"),
        late="planner",
        hogs=(("0", "0.09", "0.13"),),
    ),
    "drone": Robot(
        ("diagnostics", "control", "map", "planner", "estimator", "vio", "imu", "camera"),
        restarted="vio",
    ),
    "picker": Robot(("tasks", "action", "arm", "safety", "fusion", "lidar", "joints")),
    "vehicle": Robot(
        ("watchdog", "driving", "maneuver", "router", "behavior", "tracker", "merger", "rear",
         "front"),
        restarted="tracker",
    ),
    "worker": Robot(("sink", "worker", "sensor"), limited="worker", hog="train.py"),
    "c_worker": Robot(("sink", "worker", "sensor"), limited="worker", hog="train.py"),
}  # fmt: skip


def main() -> None:
    """Start all processes, then what is planted beside them."""
    name, ready, seconds, *problems = sys.argv[1:]
    robot = ROBOTS[name]
    file = _HERE / f"{name}.py"
    program = [sys.executable, str(file)] if file.exists() else [f"library/{name}"]

    def start(process: str) -> subprocess.Popen[bytes]:
        started = subprocess.Popen([*program, process, *problems], stdout=subprocess.PIPE)
        if process == robot.limited and _GROUP.exists():
            (_GROUP / "cgroup.procs").write_text(str(started.pid))
        return started

    late = robot.late if "late" in problems else ""
    running = {process: start(process) for process in robot.processes if process != late}
    for process in running.values():
        process.stdout.readline()
    Path(ready).touch()
    if "hog" in problems:
        # They have no library with tracepoints.
        environment = {name: value for name, value in os.environ.items() if name != "LD_PRELOAD"}
        for words in robot.hogs:
            subprocess.Popen([sys.executable, str(_HERE / robot.hog), *words], env=environment)
    if late:
        time.sleep(_LATE_SECONDS)
        start(late)
    if "restart" in problems:
        time.sleep(float(seconds) / 2)
        running[robot.restarted].kill()
        running[robot.restarted].wait()
        time.sleep(_GONE_SECONDS)
        start(robot.restarted)
    running[robot.processes[0]].wait()


if __name__ == "__main__":
    # Ctrl-C is for all processes of the group.
    with suppress(KeyboardInterrupt):
        main()
