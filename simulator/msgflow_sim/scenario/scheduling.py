"""Systems whose threads share CPUs with others, and whose kernel is traced."""

from __future__ import annotations

from dataclasses import replace

from msgflow_sim.entity import (
    MICROSECOND,
    MILLISECOND,
    SECOND,
    Publisher,
    Subscription,
    Timer,
    Work,
)
from msgflow_sim.system import Executor, Host, KernelTrace, Load, Node, Process, Scenario

_CAMERA = Node(
    "camera",
    publishers=(Publisher("/image"),),
    timers=(Timer(40 * MILLISECOND, ("/image",), Work(300 * MICROSECOND, 200 * MICROSECOND)),),
)
_DETECTOR = Node(
    "detector",
    publishers=(Publisher("/objects"),),
    subscriptions=(Subscription("/image", ("/objects",), Work(9 * MILLISECOND, 3 * MILLISECOND)),),
)
_PLANNER = Node(
    "planner",
    publishers=(Publisher("/cmd"),),
    subscriptions=(
        Subscription(
            "/objects",
            ("/cmd",),
            Work(MILLISECOND, MILLISECOND, sleep_ns=400 * MICROSECOND),
        ),
    ),
)
_MOTORS = Node("motors", subscriptions=(Subscription("/cmd"),))
_HOG = Load(
    "log_compressor",
    7001,
    period_ns=450 * MILLISECOND,
    busy_ns=60 * MILLISECOND,
    priority=79,
    cpus=(0,),
    start_ns=100 * MILLISECOND,
)
_BACKUP = Load("backup", 7101, period_ns=70 * MILLISECOND, busy_ns=11 * MILLISECOND)


def cpu_hog() -> Scenario:
    """A detector that shares its CPU with a process of a higher priority."""
    return Scenario(
        name="cpu_hog",
        description="A log compressor with a real-time priority takes the CPU from a detector.",
        hosts=(Host("robot", cpu_count=2, kernel=KernelTrace((_HOG, _BACKUP))),),
        processes=(
            Process("camera", "robot", 1101, (_CAMERA,), cpus=(1,)),
            Process("detector", "robot", 1201, (_DETECTOR,), start_ns=3 * MILLISECOND, cpus=(0,)),
            Process("planner", "robot", 1301, (_PLANNER,), start_ns=5 * MILLISECOND),
            Process("motors", "robot", 1401, (_MOTORS,), start_ns=7 * MILLISECOND),
        ),
        duration_ns=5 * SECOND,
    )


def real_time() -> Scenario:
    """A controller with a real-time priority beside others that have none, on one CPU."""
    controller = Node(
        "controller",
        publishers=(Publisher("/effort"),),
        timers=(Timer(5 * MILLISECOND, ("/effort",), Work(600 * MICROSECOND, 200 * MICROSECOND)),),
    )
    joints = Node("joints", subscriptions=(Subscription("/effort"),))
    recorder = Node(
        "recorder",
        subscriptions=(Subscription("/image", work=Work(9 * MILLISECOND, 3 * MILLISECOND)),),
    )
    return Scenario(
        name="real_time",
        description="A controller of SCHED_FIFO takes the CPU from a recorder, which takes turns.",
        hosts=(Host("robot", cpu_count=1, kernel=KernelTrace((_BACKUP,))),),
        processes=(
            Process("camera", "robot", 1101, (_CAMERA,)),
            Process("recorder", "robot", 1201, (recorder,), start_ns=3 * MILLISECOND),
            # Nothing lets itself be interrupted while it starts.
            Process(
                "controller",
                "robot",
                1301,
                (controller,),
                start_ns=100 * MILLISECOND,
                priority=40,
            ),
            Process("joints", "robot", 1401, (joints,), start_ns=103 * MILLISECOND, priority=60),
        ),
        duration_ns=3 * SECOND,
    )


def shared_map() -> Scenario:
    """Two threads of a process that wait for each other."""
    lidar = Node(
        "lidar", publishers=(Publisher("/points"),), timers=(Timer(50 * MILLISECOND, ("/points",)),)
    )
    mapper = Node(
        "mapper",
        subscriptions=(
            Subscription("/points", work=Work(12 * MILLISECOND, 4 * MILLISECOND, mutex="map")),
        ),
    )
    localizer = Node(
        "localizer",
        executor=1,
        publishers=(Publisher("/pose"),),
        timers=(
            Timer(
                10 * MILLISECOND,
                ("/pose",),
                Work(500 * MICROSECOND, 500 * MICROSECOND, mutex="map"),
            ),
        ),
    )
    control = Node("control", subscriptions=(Subscription("/pose"),))
    return Scenario(
        name="shared_map",
        description="A localizer that waits for the mapper in its process to give a mutex away.",
        hosts=(Host("robot", cpu_count=2, kernel=KernelTrace((_BACKUP,))),),
        processes=(
            Process("lidar", "robot", 1101, (lidar,)),
            Process(
                "slam",
                "robot",
                1201,
                (mapper, localizer),
                start_ns=3 * MILLISECOND,
                executors=(Executor(), Executor()),
            ),
            Process("control", "robot", 1301, (control,), start_ns=5 * MILLISECOND),
        ),
        duration_ns=3 * SECOND,
    )


def shared_memory() -> Scenario:
    """Threads of two processes that wait for conditions, and one that waits for a disk."""
    driver = Node(
        "driver",
        timers=(
            Timer(
                33 * MILLISECOND,
                work=Work(2 * MILLISECOND, MILLISECOND, mutex="/frame", signals="/captured"),
            ),
        ),
    )
    detector = Node(
        "detector",
        publishers=(Publisher("/objects"),),
        timers=(
            Timer(
                20 * MILLISECOND,
                ("/objects",),
                Work(
                    3 * MILLISECOND,
                    MILLISECOND,
                    mutex="/frame",
                    waits_for="/captured",
                    signals="detected",
                ),
            ),
        ),
    )
    tracker = Node(
        "tracker",
        executor=1,
        publishers=(Publisher("/tracks"),),
        timers=(
            Timer(
                20 * MILLISECOND,
                ("/tracks",),
                Work(4 * MILLISECOND, MILLISECOND, waits_for="detected"),
            ),
        ),
    )
    planner = Node(
        "planner",
        subscriptions=(
            Subscription(
                "/objects",
                work=Work(
                    4 * MILLISECOND,
                    MILLISECOND,
                    percent_before=10,
                    page_fault_ns=700 * MICROSECOND,
                ),
            ),
        ),
    )
    display = Node("display", subscriptions=(Subscription("/tracks"),))
    return Scenario(
        name="shared_memory",
        description="A detector that waits for a driver to signal a frame; a map on a disk.",
        hosts=(Host("robot", cpu_count=2, kernel=KernelTrace((_BACKUP,))),),
        processes=(
            Process("driver", "robot", 1101, (driver,)),
            Process(
                "perception",
                "robot",
                1201,
                (detector, tracker),
                start_ns=3 * MILLISECOND,
                executors=(Executor(), Executor()),
                cpus=(0,),
            ),
            Process("planner", "robot", 1301, (planner,), start_ns=5 * MILLISECOND, cpus=(0,)),
            Process("display", "robot", 1401, (display,), start_ns=7 * MILLISECOND),
        ),
        duration_ns=3 * SECOND,
    )


def kernel_losses() -> Scenario:
    """The detector in a container; the trace of the kernel tells no ids, and has lost events."""
    system = cpu_hog()
    kernel = KernelTrace(
        (_HOG, _BACKUP),
        has_ids=False,
        losses=((700 * MILLISECOND, 740 * MILLISECOND), (1500 * MILLISECOND, 1503 * MILLISECOND)),
    )
    return replace(
        system,
        name="kernel_losses",
        description="The hog beside a container, seen by a kernel trace without ids and with gaps.",
        hosts=(replace(system.hosts[0], kernel=kernel),),
        processes=tuple(replace(process, container="box") for process in system.processes),
    )
