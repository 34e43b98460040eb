"""A system recorded with CARET while a simulation runs, and a program without ROS that listens."""

from msgflow_sim.entity import (
    MILLISECOND,
    SECOND,
    Publisher,
    Subscription,
    TellTime,
    Timer,
    Work,
)
from msgflow_sim.system import Executor, Group, Host, Node, Process, Scenario

_CAMERA = Node(
    "camera",
    publishers=(Publisher("/image"),),
    timers=(Timer(50 * MILLISECOND, ("/image",), Work(MILLISECOND)),),
)
_DETECTOR = Node(
    "detector",
    publishers=(Publisher("/objects"), Publisher("/state")),
    groups=(Group("state"),),
    subscriptions=(Subscription("/image", ("/objects",), Work(3 * MILLISECOND)),),
    timers=(Timer(40 * MILLISECOND, ("/state",), Work(2 * MILLISECOND), group="state"),),
)
_PLANNER = Node(
    "planner",
    subscriptions=(Subscription("/objects", work=Work(MILLISECOND)), Subscription("/state")),
)
# It runs at half the pace.
_CLOCK = Node("clock_recorder", timers=(Timer(SECOND, does=(TellTime(0.5),)),))


def caret() -> Scenario:
    """An instrumented DDS tells of its readers; in the layout humble-caret, CARET of the rest."""
    return Scenario(
        name="caret",
        description="A subscriber without ROS; with the layout humble-caret, simulated time.",
        hosts=(Host("alpha"),),
        processes=(
            Process("camera", "alpha", 1101, (_CAMERA,)),
            Process("detector", "alpha", 1201, (_DETECTOR,), start_ns=3 * MILLISECOND),
            Process("planner", "alpha", 1301, (_PLANNER,), start_ns=5 * MILLISECOND),
            Process("clock_recorder", "alpha", 1401, (_CLOCK,), start_ns=7 * MILLISECOND),
            Process(
                "viewer",
                "alpha",
                1501,
                (),
                start_ns=9 * MILLISECOND,
                executors=(Executor("static_single_threaded"),),
                readers=("/image", "/map"),
            ),
        ),
        duration_ns=6 * SECOND,
        layout="humble-fastdds",
    )
