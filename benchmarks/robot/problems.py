"""The problems that can be planted in the robot, and who is to blame for each."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Problem:
    """A problem, as it is planted.

    Attributes:
        kind: how `msgflow why` calls it.
        culprit: the node, or the process without ROS, that a verdict has to name.
        sentence: a pattern of what it has to say of it, with a number.
        least, most: what that number may be, in the unit that the sentence has.
        without_kernel: the node that suffers, if nothing but a trace of the kernel shows who is to
            blame.
    """

    kind: str
    culprit: str
    sentence: str
    least: float
    most: float
    without_kernel: str | None = None


PROBLEMS = {
    "slow": Problem(
        "callback", "/filter", r"Subscription\(/scan\) takes ([\d.]+) ms of", 45, 75
    ),
    "busy": Problem(
        "executor", "/monitor",
        r"Timer\(190 ms\) \([\d.]+ ms\) keeps Subscription\(/points\) of /localizer waiting in"
        r" their executor, for ([\d.]+) ms of", 45, 100,
    ),
    "queue": Problem(
        "queue", "/detector", r"its queue of 1 overwrote (\d+) of \d+ messages on /image", 20, 120
    ),
    "hog": Problem(
        "cpu", "compressor", r"takes the CPU from /localizer, .* for ([\d.]+) ms of", 45, 110,
        without_kernel="/localizer",
    ),
    "late": Problem(
        "late_start", "/planner", r"started ([\d.]+) s after the others and missed", 3, 6
    ),
    "stale": Problem(
        "stale", "/controller", r"Timer\(600 ms\) .* on /plan .* for up to ([\d.]+) ms", 600, 600
    ),
    "service": Problem(
        "service", "/map_server", r"/get_map keeps a callback of /planner waiting for ([\d.]+) ms",
        110, 170,
    ),
}  # fmt: skip
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
