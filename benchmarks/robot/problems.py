"""The problems that can be planted in the robot, and who is to blame for each."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Problem:
    """A problem, as it is planted.

    Attributes:
        kind: how `msgflow why` calls it.
        culprit: the node, or the process without ROS, that a verdict has to name.
        needs_kernel: nothing but a trace of the kernel shows it.
    """

    kind: str
    culprit: str
    needs_kernel: bool = False


PROBLEMS = {
    "slow": Problem("callback", "/filter"),
    "busy": Problem("executor", "/monitor"),
    "queue": Problem("queue", "/detector"),
    "hog": Problem("cpu", "compressor", needs_kernel=True),
    "late": Problem("late_start", "/planner"),
    "stale": Problem("stale", "/controller"),
    "service": Problem("service", "/map_server"),
}
# Two at once, the worse one first.
PAIRS = (
    ("service", "slow"),
    ("busy", "slow"),
    ("stale", "busy"),
    ("late", "queue"),
    ("late", "stale"),
    ("queue", "hog"),
    ("service", "hog"),
)
