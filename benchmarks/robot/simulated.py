"""The robot of the simulator, whose nodes are those of rclcpp.

    lidar ─/scan→ filter ─/points→ localizer ─/pose→ planner ─/plan→ controller ─/cmd→ motors
    camera ─/image→ detector ─/objects→ motors

The localizer shares its executor with a monitor, the controller with the motors. The planner can
ask the map server.
"""

from __future__ import annotations

from collections.abc import Collection

from msgflow_sim.entity import (
    MILLISECOND,
    SECOND,
    Call,
    Client,
    Publish,
    Publisher,
    Service,
    Subscription,
    Timer,
    Work,
)
from msgflow_sim.system import Executor, Group, Host, KernelTrace, Load, Node, Process, Scenario

_LOAD = Load("backup", 7101, period_ns=500 * MILLISECOND, busy_ns=3 * MILLISECOND, cpus=(3,))
_HOG = Load(
    "compressor",
    7001,
    period_ns=220 * MILLISECOND,
    busy_ns=90 * MILLISECOND,
    priority=79,
    cpus=(0,),
    start_ns=100 * MILLISECOND,
)


def robot(problems: Collection[str]) -> Scenario:
    """Return the robot with some problems, of `PROBLEMS`."""
    return Scenario(
        name="robot_" + ("_".join(problems) or "healthy"),
        description="A robot of ten nodes in eight processes.",
        hosts=(
            Host(
                "robot",
                cpu_count=4,
                kernel=KernelTrace((_LOAD, _HOG) if "hog" in problems else (_LOAD,)),
            ),
        ),
        processes=(
            Process("lidar", "robot", 1101, (_sensor("lidar", "/scan", 200),), cpus=(1,)),
            Process(
                "camera",
                "robot",
                1201,
                (_sensor("camera", "/image", 50),),
                start_ns=40 * MILLISECOND,
                cpus=(2,),
            ),
            Process(
                "filter",
                "robot",
                1301,
                (_filter("slow" in problems),),
                start_ns=110 * MILLISECOND,
                cpus=(3,),
            ),
            Process(
                "detector",
                "robot",
                1401,
                (_detector("queue" in problems),),
                start_ns=190 * MILLISECOND,
                cpus=(2,),
            ),
            Process(
                "localization",
                "robot",
                1501,
                (_localizer(), _monitor("busy" in problems)),
                start_ns=260 * MILLISECOND,
                cpus=(0,),
            ),
            Process(
                "map_server",
                "robot",
                1601,
                (_map_server("service" in problems),),
                start_ns=330 * MILLISECOND,
                cpus=(1,),
            ),
            Process(
                "planner",
                "robot",
                1701,
                (_planner("service" in problems),),
                start_ns=(4 * SECOND if "late" in problems else 400 * MILLISECOND),
                executors=(Executor(), Executor("nested")),
                cpus=(3,),
            ),
            Process(
                "control",
                "robot",
                1801,
                (_controller("stale" in problems), _motors()),
                start_ns=480 * MILLISECOND,
                cpus=(1,),
            ),
        ),
        layout="kilted",
        overwrites=True,
    )


def _sensor(name: str, topic: str, period_ms: int) -> Node:
    timer = Timer(period_ms * MILLISECOND, (topic,), Work(MILLISECOND, MILLISECOND))
    return Node(name, publishers=(Publisher(topic),), timers=(timer,))


def _filter(is_slow: bool) -> Node:
    work = Work(60 * MILLISECOND, 5 * MILLISECOND) if is_slow else _usual(3)
    return Node(
        "filter",
        publishers=(Publisher("/points"),),
        subscriptions=(Subscription("/scan", ("/points",), work),),
    )


def _detector(is_overrun: bool) -> Node:
    work = Work(50 * MILLISECOND, 35 * MILLISECOND) if is_overrun else _usual(7)
    return Node(
        "detector",
        publishers=(Publisher("/objects"),),
        subscriptions=(Subscription("/image", ("/objects",), work, 1 if is_overrun else 10),),
    )


def _localizer() -> Node:
    return Node(
        "localizer",
        publishers=(Publisher("/pose"),),
        subscriptions=(Subscription("/points", ("/pose",), _usual(4)),),
    )


def _monitor(is_busy: bool) -> Node:
    work = Work(80 * MILLISECOND, 4 * MILLISECOND) if is_busy else _usual(1)
    return Node("monitor", timers=(Timer(190 * MILLISECOND, work=work),))


def _map_server(is_slow: bool) -> Node:
    work = Work(120 * MILLISECOND, 3 * MILLISECOND) if is_slow else _usual(1)
    return Node("map_server", services=(Service("/get_map", work=work),))


def _planner(asks: bool) -> Node:
    does = (Call("/get_map", spins=1), Publish("/plan")) if asks else (Publish("/plan"),)
    return Node(
        "planner",
        groups=(Group("answers", executor=1),),
        publishers=(Publisher("/plan"),),
        clients=(Client("/get_map", group="answers"),),
        subscriptions=(Subscription("/pose", work=_usual(3), does=does),),
    )


def _controller(is_stale: bool) -> Node:
    hears = Subscription("/plan", () if is_stale else ("/cmd",), _usual(1))
    timers = (Timer(600 * MILLISECOND, ("/cmd",), _usual(1)),) if is_stale else ()
    return Node(
        "controller", publishers=(Publisher("/cmd"),), subscriptions=(hears,), timers=timers
    )


def _motors() -> Node:
    return Node(
        "motors", subscriptions=(Subscription("/cmd", work=_usual(1)), Subscription("/objects"))
    )


def _usual(milliseconds: int) -> Work:
    return Work(milliseconds * MILLISECOND, milliseconds * MILLISECOND)
