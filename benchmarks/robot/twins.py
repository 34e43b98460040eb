"""Twins of the drone and the picker in the simulator, with the events of rclcpp.

A seed chooses names, periods and durations, so that no limit and no name of a verdict fits only one
robot. What an interpreter does is not there, nor goals that keep an executor busy: rclcpp executes
them on threads of their own. The arm takes long for each goal in all twins of the picker, and is
no culprit.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from random import Random

from msgflow_sim.entity import (
    MILLISECOND,
    SECOND,
    Action,
    ActionClient,
    ActionServer,
    Call,
    Client,
    Publish,
    Publisher,
    SendGoal,
    Service,
    Subscription,
    Timer,
    Work,
)
from msgflow_sim.system import Executor, Group, Host, KernelTrace, Load, Node, Process, Scenario
from robot.judge import Culprit, Kind, Limits

PROBLEMS = {
    "drone": ("sometimes", "timer", "service", "await", "hog", "restart", "qos"),
    "picker": ("queue", "depth1", "lock", "disk", "burst", "over"),
}
"""By the name of a robot."""

_DURATION_NS = 10 * SECOND
# Threads of a process follow it.
_PIDS_APART = 100
# Each start comes so much later than the one before it.
_STARTS_APART_NS = 40 * MILLISECOND
_GONE_NS = 2 * SECOND
_NEVER_NS = 10 * _DURATION_NS


@dataclass
class _Twin:
    """A robot that is being built: what the seed chooses, its processes, and who is to blame."""

    random: Random
    processes: list[Process] = field(default_factory=list)
    culprits: list[Culprit] = field(default_factory=list)
    loads: tuple[Load, ...] = ()

    def name(self, *choices: str) -> str:
        """Return one of some names."""
        return self.random.choice(choices)

    def ns(self, milliseconds: float) -> int:
        """Return about so long, in whole milliseconds."""
        return max(round(milliseconds * self.random.uniform(0.8, 1.25)), 1) * MILLISECOND

    def add(
        self, *nodes: Node, executors: int = 1, nested: int = 0, cpus: tuple[int, ...] = ()
    ) -> Process:
        """Add a process with nodes that say once a second that they are well."""
        number = len(self.processes) + 1
        process = Process(
            f"{nodes[0].name}_main",
            "robot",
            1000 + number * _PIDS_APART,
            tuple(_beating(node) for node in nodes),
            start_ns=number * _STARTS_APART_NS,
            executors=(Executor(),) * executors + (Executor("nested"),) * nested,
            cpus=cpus,
        )
        self.processes.append(process)
        return process

    def blame(
        self,
        kinds: Iterable[Kind],
        node: str,
        *limits: Limits,
        callback: str | None = None,
        names: Iterable[str] = (),
        sufferer: str | None = None,
    ) -> None:
        """Add a culprit; names are no patterns."""
        self.culprits.append(
            Culprit(
                tuple(kinds),
                re.escape(f"/{node}") if "|" not in node else node,
                limits,
                None if callback is None else re.escape(callback),
                names=tuple(re.escape(name) for name in names),
                sufferer=None if sufferer is None else re.escape(f"/{sufferer}"),
            )
        )


def _beating(node: Node) -> Node:
    if node.name.endswith("aggregator"):
        return node
    return replace(
        node,
        publishers=(*node.publishers, Publisher("/diagnostics")),
        timers=(*node.timers, Timer(SECOND, ("/diagnostics",))),
    )


def twin(robot: str, problem: str | None, seed: int) -> tuple[Scenario, list[Culprit]]:
    """Return a robot of `PROBLEMS` with a problem, or with none, and who is to blame."""
    # Names and periods are those of the healthy one of the same seed.
    built = _Twin(Random(seed))
    {"drone": _drone, "picker": _picker}[robot](built, problem)
    backup = Load("backup", 7101, period_ns=SECOND // 2, busy_ns=3 * MILLISECOND, cpus=(3,))
    scenario = Scenario(
        name="robot",
        description=f"{robot} {problem} {seed}",
        hosts=(Host("robot", cpu_count=4, kernel=KernelTrace((backup, *built.loads))),),
        processes=tuple(built.processes),
        duration_ns=_DURATION_NS,
        layout="kilted",
        overwrites=True,
    )
    return scenario, built.culprits


def _drone(built: _Twin, problem: str | None) -> None:
    name, ns = built.name, built.ns
    odometry = name("visual_odometry", "vio", "egomotion")
    planner = name("planner", "path_finder", "local_planner")
    server = name("map_server", "atlas", "world_model")
    controller = name("controller", "follower", "autopilot")
    camera = name("camera", "front_camera", "eye")
    image, pose, odom, path, command = (
        name("/camera/rect", "/eye/mono", "/image"),
        name("/vio/pose", "/ego", "/pose"),
        name("/odom", "/state", "/fused"),
        name("/path", "/route", "/plan"),
        name("/motor_cmd", "/thrust", "/cmd"),
    )
    asked = name("/map/query", "/get_cells", "/lookup")
    image_ns, sample_ns, control_ns = ns(100), ns(20), ns(20)
    rarely_ns, answer_ns, stale_ns = ns(160), ns(350), ns(250)
    hog_ns = ns(90)

    imu = Node("imu_driver", publishers=(Publisher("/imu"),), timers=(Timer(sample_ns, ("/imu",)),))
    built.add(imu)
    eye = Node(camera, publishers=(Publisher(image),), timers=(Timer(image_ns, (image,)),))
    built.add(eye)

    usual = _takes(8)
    heard = f"Subscription({image})"
    never = _NEVER_NS if problem == "qos" else 0
    if problem == "sometimes":
        usual = replace(usual, slow_probability=1 / 6, slow_ns=rarely_ns)
        built.blame([Kind.COMPUTES], odometry, _about(rarely_ns, 0.5, 1.4), callback=heard)
    elif problem == "qos":
        count = _DURATION_NS // image_ns
        built.blame(
            [Kind.NEVER_MATCHED], f"/{camera}|/{odometry}", Limits("count", count / 2, count),
            names=(f"/{odometry}", image),
        )  # fmt: skip
    sees = Node(
        odometry,
        publishers=(Publisher(pose),),
        subscriptions=(Subscription(image, (pose,), usual, depth=5, discovery_ns=never),),
    )
    process = built.add(sees, cpus=(0,) if problem == "hog" else ())
    if problem == "hog":
        hog = Load(
            "compressor",
            7001,
            period_ns=3 * hog_ns,
            busy_ns=hog_ns,
            priority=79,
            cpus=(0,),
            start_ns=SECOND,
        )
        built.loads = (hog,)
        built.blame(
            [Kind.NO_CPU], f"compressor.*|/{odometry}", _about(hog_ns, 0.3, 1.3),
            names=("compressor",), sufferer=odometry,
        )  # fmt: skip
    elif problem == "restart":
        half = _DURATION_NS // 2
        built.processes[-1] = replace(process, stop_ns=half, is_killed=True)
        again = replace(process, pid=process.pid + 5000, start_ns=half + _GONE_NS)
        built.processes.append(again)
        lost = _GONE_NS // image_ns
        built.blame(
            [Kind.RESTART],
            odometry,
            _about(_GONE_NS, 0.7, 4.5),
            Limits("count", lost * 0.6, lost * 1.6),
        )

    estimator = Node(
        "estimator",
        publishers=(Publisher(odom),),
        subscriptions=(Subscription("/imu", (odom,), _takes(1)), Subscription(pose)),
    )
    built.add(estimator)

    does: tuple[Action, ...] = (Publish(path),)
    client, groups = Client(asked), (Group("answers", executor=1),)
    if problem == "service":
        does = (Call(asked, spins=1), Publish(path))
        client = Client(asked, group="answers")
    elif problem == "await":
        does, client = (Call(asked),), Client(asked, (path,))
    plans = Node(
        planner,
        groups=groups,
        publishers=(Publisher(path),),
        clients=(client,),
        subscriptions=(Subscription(pose, work=_takes(3), does=does), Subscription(odom)),
    )
    built.add(plans, nested=1)
    answers = _takes(1)
    if problem in {"service", "await"}:
        answers = replace(answers, slow_probability=1 / 6, slow_ns=answer_ns)
        built.blame(
            [Kind.AWAITS], f"/{planner}|/{server}", _about(answer_ns, 0.4, 1.4),
            names=(f"/{planner}", asked),
        )  # fmt: skip
    built.add(Node(server, services=(Service(asked, work=answers),)))

    period_ns = stale_ns if problem == "timer" else control_ns
    if problem == "timer":
        callback = f"Timer({stale_ns // MILLISECOND} ms)"
        built.blame([Kind.STALE], controller, _about(stale_ns, 0.95, 1.05), callback=callback)
    controls = Node(
        controller,
        publishers=(Publisher(command),),
        subscriptions=(Subscription(path),),
        timers=(Timer(period_ns, (command,), _takes(1)),),
    )
    built.add(controls, Node("motor", subscriptions=(Subscription(command),)))
    built.add(Node("aggregator", subscriptions=(Subscription("/diagnostics", depth=50),)))


def _picker(built: _Twin, problem: str | None) -> None:
    name, ns = built.name, built.ns
    lidar = name("lidar", "scanner", "laser")
    fusion = name("fusion", "perception", "world")
    safety = name("safety", "guard", "light_curtain")
    control = name("arm_control", "servo", "position_control")
    states, scan, pose, obstacles, command = (
        name("/joint_states", "/joints", "/encoders"),
        name("/scan", "/ranges", "/points"),
        name("/pose", "/tool_pose", "/gripper"),
        name("/obstacles", "/humans", "/zones"),
        name("/arm/cmd", "/effort", "/setpoint"),
    )
    action = name("/arm/move", "/grasp", "/pick")
    reading_ns, scan_ns = ns(20), ns(100)
    locked_ns, guarded_ns, disk_ns, check_ns = ns(70), ns(60), ns(40), ns(40)
    share = built.random.uniform(1.08, 1.3)

    joints = Node(
        "joint_driver", publishers=(Publisher(states),), timers=(Timer(reading_ns, (states,)),)
    )
    built.add(joints)
    head = Timer(scan_ns, (scan,))
    if problem == "burst":
        head = Timer(20 * scan_ns, (scan,) * 20)
        built.blame([Kind.BURST], lidar, Limits("count", 20, 20))
    built.add(Node(lidar, publishers=(Publisher(scan, 50),), timers=(head,)))

    looks = _takes(3)
    if problem == "lock":
        looks = _work(locked_ns)
        built.blame(
            [Kind.LOCK, Kind.SLEEPS], fusion, _about(locked_ns, 0.8, 2.5), names=(states, scan),
            sufferer=fusion,
        )  # fmt: skip
    fuses = Node(
        fusion,
        groups=(Group("scans", executor=1),),
        publishers=(Publisher(pose), Publisher(obstacles)),
        subscriptions=(
            Subscription(states, (pose,), replace(_takes(1), mutex="state")),
            Subscription(scan, (obstacles,), replace(looks, mutex="state"), group="scans"),
        ),
    )
    built.add(fuses, executors=2)

    guards, depth = _takes(1), 10
    if problem == "depth1":
        guards, depth = _work(guarded_ns), 1
        overwritten = _DURATION_NS // reading_ns
        built.blame(
            [Kind.COMPUTES, Kind.QUEUE], safety, _about(guarded_ns, 0.9, 2),
            Limits("count", overwritten / 10, overwritten),
        )  # fmt: skip
    elif problem == "disk":
        guards = replace(guards, page_fault_ns=disk_ns)
        built.blame(
            [Kind.DISK, Kind.SLEEPS], safety, _about(disk_ns, 0.7, 1.6),
            callback=f"Subscription({obstacles})", sufferer=safety,
        )  # fmt: skip
    guard = Node(
        safety,
        publishers=(Publisher("/stop"),),
        subscriptions=(
            Subscription(obstacles, ("/stop",), guards),
            Subscription(pose, depth=depth),
        ),
    )
    built.add(guard)

    moves = _takes(1)
    monitors: tuple[Node, ...] = ()
    if problem == "queue":
        moves = _work(round(share * reading_ns))
        built.blame(
            [Kind.COMPUTES, Kind.OVERLOAD, Kind.QUEUE],
            control,
            _about(round(share * reading_ns), 0.95, 1.4),
            Limits("%", 95, 140),
            callback=f"Subscription({pose})",
        )
    elif problem == "over":
        each_ns = round(share * check_ns / 5)
        monitors = tuple(
            Node(f"monitor_{number}", timers=(Timer(check_ns, work=_work(each_ns)),))
            for number in range(5)
        )
        built.blame(
            [Kind.OVERLOAD], rf"/{control}|/monitor_\d|{control}_main.*",
            Limits("%", 90, 160), _about(each_ns, 0.9, 1.5), names=("monitor",),
        )  # fmt: skip
    arm = Node(
        control,
        publishers=(Publisher(command),),
        subscriptions=(Subscription(pose, (command,), moves),),
    )
    built.add(arm, Node("arm_drive", subscriptions=(Subscription(command),)), *monitors)

    acts = Node(
        "arm_action",
        publishers=(Publisher("/halt"),),
        subscriptions=(Subscription("/stop", ("/halt",), _takes(1)),),
        action_servers=(ActionServer(action, feedback=4, period_ns=ns(150)),),
    )
    built.add(acts)
    tasks = Node(
        "task_manager",
        subscriptions=(Subscription("/halt"),),
        action_clients=(ActionClient(action),),
        timers=(Timer(ns(1500), does=(SendGoal(action),)),),
    )
    built.add(tasks)
    built.add(Node("aggregator", subscriptions=(Subscription("/diagnostics", depth=50),)))


def _takes(milliseconds: int) -> Work:
    return _work(milliseconds * MILLISECOND)


def _work(duration_ns: int) -> Work:
    # What it computes is published at its end.
    return Work(duration_ns, MILLISECOND // 4, percent_before=100)


def _about(duration_ns: int, least: float, most: float) -> Limits:
    milliseconds = duration_ns / MILLISECOND
    return Limits("ms", least * milliseconds, most * milliseconds)
