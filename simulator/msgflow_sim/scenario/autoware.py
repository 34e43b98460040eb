"""The Autoware reference system of the ROS 2 Real-Time Working Group, on two hosts.

Written down before it was first simulated, and not changed to meet any result. Where it is from:

- Nodes, topics, periods and kinds of nodes: the reference system (`autoware_system_builder.hpp`,
  `system/timing/default.hpp`, ros-realtime/reference-system). Sensors publish in a timer;
  transformers and intersections publish in the callback of their input; fusions publish in the
  callback of whichever of their two inputs completes the pair, and then wait for both again;
  the cyclic node publishes in a timer of 100 ms; commands receive. All queues hold one message of
  4 KiB.
- What a callback computes: "about 25 ms" on an i7-6700K at 4 GHz, the same for all that compute
  (branch `message-link-instrumentation` of christophebedard/reference-system, with which the
  experiment was made). It is a fixed amount of work, so it varies little: 25 ms and up to 0.5 ms.
  All of it is done before the callback publishes, which the first simulation had missed.
- Processes 1a to 1d and 2a to 2g, their hosts and annotations: the same branch and the launch files
  of christophebedard/ros2-message-flow-analysis. The two-threaded variant changes process 1b only.
- Assumptions of ours: 8 CPUs per host (so many has that processor); launched processes begin 10 ms
  apart in the order of the launch file, on the second host half a step later.
"""

from __future__ import annotations

from msgflow_sim.entity import (
    MILLISECOND,
    SECOND,
    MessageLink,
    Publisher,
    Subscription,
    Timer,
    Work,
)
from msgflow_sim.system import Executor, Group, Host, Node, Process, Scenario

_CRUNCH = Work(25 * MILLISECOND, MILLISECOND // 2, percent_before=100)
_SIZE_BYTES = 4096
_MESSAGE_TYPE = "reference_interfaces::msg::Message4kb"
_CPU_COUNT = 8
_BEGIN_APART_NS = 10 * MILLISECOND
_FIRST_HOST, _SECOND_HOST = "reference-system-1", "reference-system-2"
_FIRST_PID, _PIDS_APART = 4101, 20


def autoware() -> Scenario:
    """Every process with one thread."""
    return _scenario(
        "autoware", "The Autoware reference system on two hosts, in eleven processes.", Executor()
    )


def autoware_two_threads() -> Scenario:
    """The process that fuses point clouds has two threads."""
    return _scenario(
        "autoware_two_threads",
        "The Autoware reference system, with two threads where point clouds are fused.",
        Executor("multi_threaded", 2),
    )


def _scenario(name: str, description: str, fusion: Executor) -> Scenario:
    first = (
        ("1a", (_lidar("Front"), _lidar("Rear"), _transformer("Front"), _transformer("Rear"))),
        ("1b", (
            _fusion("PointCloudFusion", "PointsTransformerFront", "PointsTransformerRear"),
            _transform("RayGroundFilter", "PointCloudFusion"),
            _transform("VoxelGridDownsampler", "PointCloudFusion"),
        )),
        ("1c", (_sensor("EuclideanClusterSettings", 25), _intersection(),
                _command("IntersectionOutput", "EuclideanIntersection"))),
        ("1d", (_sensor("PointCloudMap", 120), _transform("PointCloudMapLoader", "PointCloudMap"))),
    )  # fmt: skip
    second = (
        ("2a", (_fusion("NDTLocalizer", "VoxelGridDownsampler", "PointCloudMapLoader"),)),
        ("2b", (_sensor("Visualizer", 60),
                _fusion("Lanelet2GlobalPlanner", "Visualizer", "NDTLocalizer"))),
        ("2c", (_sensor("Lanelet2Map", 100),
                _fusion("Lanelet2MapLoader", "Lanelet2Map", "Lanelet2GlobalPlanner"))),
        ("2d", (_transform("ObjectCollisionEstimator", "EuclideanClusterDetector"),)),
        ("2e", (_transform("ParkingPlanner", "Lanelet2MapLoader"),
                _transform("LanePlanner", "Lanelet2MapLoader"))),
        ("2f", (_cyclic("BehaviorPlanner", 100, (
            "ObjectCollisionEstimator", "NDTLocalizer", "Lanelet2GlobalPlanner",
            "Lanelet2MapLoader", "ParkingPlanner", "LanePlanner")),)),
        ("2g", (_transform("MPCController", "BehaviorPlanner"),
                _fusion("VehicleInterface", "MPCController", "BehaviorPlanner"),
                _command("VehicleDBWSystem", "VehicleInterface"))),
    )  # fmt: skip
    return Scenario(
        name=name,
        description=description,
        hosts=(Host(_FIRST_HOST, _CPU_COUNT), Host(_SECOND_HOST, _CPU_COUNT)),
        processes=(
            *_processes(_FIRST_HOST, first, 0, {"1b": fusion}),
            *_processes(_SECOND_HOST, second, _BEGIN_APART_NS // 2, {}),
        ),
        duration_ns=20 * SECOND,
        layout="rolling",
        overwrites=True,
        draws_like="autoware",
    )


def _processes(
    hostname: str,
    nodes: tuple[tuple[str, tuple[Node, ...]], ...],
    start_ns: int,
    executors: dict[str, Executor],
) -> tuple[Process, ...]:
    return tuple(
        Process(
            f"autoware_{label}",
            hostname,
            _FIRST_PID + _PIDS_APART * number,
            own,
            start_ns=start_ns + _BEGIN_APART_NS * number,
            executors=(executors.get(label, Executor()),),
        )
        for number, (label, own) in enumerate(nodes)
    )


def _publisher(name: str) -> Publisher:
    return Publisher(f"/{name}", 1, _SIZE_BYTES)


def _subscription(
    topic: str, publishes: tuple[str, ...] = (), work: Work = _CRUNCH, group: str = ""
) -> Subscription:
    return Subscription(
        f"/{topic}", publishes, work, depth=1, message_type=_MESSAGE_TYPE, group=group
    )


def _sensor(name: str, period_ms: int) -> Node:
    return Node(
        name,
        publishers=(_publisher(name),),
        timers=(Timer(period_ms * MILLISECOND, (f"/{name}",)),),
    )


def _lidar(side: str) -> Node:
    return _sensor(f"{side}LidarDriver", 100)


def _transformer(side: str) -> Node:
    return _transform(f"PointsTransformer{side}", f"{side}LidarDriver")


def _transform(name: str, source: str) -> Node:
    return Node(
        name,
        publishers=(_publisher(name),),
        subscriptions=(_subscription(source, (f"/{name}",)),),
    )


def _intersection() -> Node:
    """Two transformers in one node, each in a callback group of its own."""
    outputs = ("EuclideanClusterDetector", "EuclideanIntersection")
    inputs = ("RayGroundFilter", "EuclideanClusterSettings")
    return Node(
        "EuclideanClusterDetector",
        groups=tuple(Group(source) for source in inputs),
        publishers=tuple(_publisher(output) for output in outputs),
        subscriptions=tuple(
            _subscription(source, (f"/{output}",), group=source)
            for source, output in zip(inputs, outputs, strict=True)
        ),
    )


def _fusion(name: str, *sources: str) -> Node:
    return Node(
        name,
        publishers=(_publisher(name),),
        subscriptions=tuple(_subscription(source, (f"/{name}",)) for source in sources),
        links=(
            MessageLink("partial_sync", tuple(f"/{source}" for source in sources), (f"/{name}",)),
        ),
    )


def _cyclic(name: str, period_ms: int, sources: tuple[str, ...]) -> Node:
    return Node(
        name,
        publishers=(_publisher(name),),
        subscriptions=tuple(_subscription(source, work=Work()) for source in sources),
        timers=(Timer(period_ms * MILLISECOND, (f"/{name}",), _CRUNCH),),
        links=(
            MessageLink("periodic_async", tuple(f"/{source}" for source in sources), (f"/{name}",)),
        ),
    )


def _command(name: str, source: str) -> Node:
    return Node(name, subscriptions=(_subscription(source, work=Work()),))
