"""Runs a robot of rclpy until it is ended.

    python launch.py ROBOT READY SECONDS [PROBLEM]…

It makes the file READY when all nodes spin. SECONDS is how long they will run from then on: what is
planted to happen half-way does so then. Needs no package of msgflow.
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


@dataclass(frozen=True)
class Robot:
    """A robot.

    Attributes:
        processes: those who hear come first.
        restarted: the process that is killed half-way, and started again.
        late: the process that is started after the others.
        hogs: how `hog.py` is called, one for each.
    """

    processes: tuple[str, ...]
    restarted: str = ""
    late: str = ""
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
}  # fmt: skip


def main() -> None:
    """Start all processes, then what is planted beside them."""
    name, ready, seconds, *problems = sys.argv[1:]
    robot = ROBOTS[name]

    def start(process: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, str(_HERE / f"{name}.py"), process, *problems]
        return subprocess.Popen(command, stdout=subprocess.PIPE)

    late = robot.late if "late" in problems else ""
    running = {process: start(process) for process in robot.processes if process != late}
    for process in running.values():
        process.stdout.readline()
    Path(ready).touch()
    if "hog" in problems:
        for words in robot.hogs:
            subprocess.Popen([sys.executable, str(_HERE / "hog.py"), *words])
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
