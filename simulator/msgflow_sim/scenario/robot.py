"""The demonstration: a small robot, its sensors on one host, perception and planning on another."""

from __future__ import annotations

from msgflow_sim.entity import MICROSECOND, MILLISECOND, Publisher, Subscription, Timer, Work
from msgflow_sim.system import Host, Node, Process, Scenario

_BASE = "robot-base"
_COMPUTER = "robot-computer"


def demo() -> Scenario:
    """Camera, lidar and IMU → perception → planning → control; the detector is slow at times."""
    return Scenario(
        name="demo",
        description="A small robot: camera, lidar and IMU to motor commands, on two hosts.",
        hosts=(Host(_BASE, cpu_count=2), Host(_COMPUTER, cpu_count=4)),
        processes=(*_sensors(), *_perception(), *_control()),
    )


def _sensors() -> tuple[Process, ...]:
    camera = Node(
        "driver",
        "/camera",
        publishers=(Publisher("/camera/image", 5), Publisher("/camera/camera_info", 5)),
        timers=(
            Timer(
                33_333 * MICROSECOND,
                ("/camera/image", "/camera/camera_info"),
                Work(900 * MICROSECOND, 700 * MICROSECOND),
            ),
        ),
    )
    lidar = Node(
        "driver",
        "/lidar",
        publishers=(Publisher("/lidar/points", 5),),
        timers=(Timer(100 * MILLISECOND, ("/lidar/points",), Work(2 * MILLISECOND, MILLISECOND)),),
    )
    imu = Node(
        "driver",
        "/imu",
        publishers=(Publisher("/imu/data", 50),),
        timers=(Timer(10 * MILLISECOND, ("/imu/data",), Work(60 * MICROSECOND, 40 * MICROSECOND)),),
    )
    motors = Node(
        "motors",
        "/base",
        subscriptions=(
            Subscription(
                "/control/cmd",
                work=Work(150 * MICROSECOND, 100 * MICROSECOND),
                message_type="geometry_msgs::msg::TwistStamped",
            ),
        ),
    )
    return (
        Process("camera_driver", _BASE, 812, (camera,)),
        Process("lidar_driver", _BASE, 843, (lidar,), start_ns=4 * MILLISECOND),
        Process("imu_driver", _BASE, 871, (imu,), start_ns=9 * MILLISECOND),
        Process("motor_driver", _BASE, 902, (motors,), start_ns=13 * MILLISECOND),
    )


def _perception() -> tuple[Process, ...]:
    detector = Node(
        "detector",
        "/perception",
        publishers=(Publisher("/perception/detections"),),
        subscriptions=(
            Subscription(
                "/camera/image",
                ("/perception/detections",),
                Work(11 * MILLISECOND, 6 * MILLISECOND, slow_probability=0.04, slow_ns=55_000_000),
                depth=5,
                message_type="sensor_msgs::msg::Image",
            ),
            Subscription(
                "/camera/camera_info", depth=5, message_type="sensor_msgs::msg::CameraInfo"
            ),
        ),
    )
    ground_filter = _relay(
        "ground_filter",
        "/lidar/points",
        "/perception/obstacles",
        Work(18 * MILLISECOND, 9 * MILLISECOND),
        "sensor_msgs::msg::PointCloud2",
        depths=(5, 5),
    )
    tracker = _relay(
        "tracker",
        "/perception/detections",
        "/perception/objects",
        Work(2 * MILLISECOND, 2 * MILLISECOND),
        "vision_msgs::msg::Detection3DArray",
        logs=True,
    )
    return (
        Process("detector", _COMPUTER, 812, (detector,), start_ns=6 * MILLISECOND),
        Process("ground_filter", _COMPUTER, 843, (ground_filter,), start_ns=11 * MILLISECOND),
        Process("tracker", _COMPUTER, 894, (tracker,), start_ns=15 * MILLISECOND),
    )


def _control() -> tuple[Process, ...]:
    planner = Node(
        "planner",
        "/planning",
        publishers=(Publisher("/planning/trajectory"),),
        subscriptions=(
            Subscription(
                "/perception/objects",
                ("/planning/trajectory",),
                Work(4 * MILLISECOND, 3 * MILLISECOND),
                message_type="vision_msgs::msg::Detection3DArray",
            ),
            Subscription(
                "/perception/obstacles",
                ("/planning/trajectory",),
                Work(3 * MILLISECOND, 2 * MILLISECOND),
                depth=5,
                message_type="sensor_msgs::msg::PointCloud2",
            ),
        ),
    )
    estimator = _relay(
        "state_estimator",
        "/imu/data",
        "/localization/odometry",
        Work(250 * MICROSECOND, 150 * MICROSECOND),
        "sensor_msgs::msg::Imu",
        depths=(50, 10),
    )
    controller = Node(
        "controller",
        "/control",
        publishers=(Publisher("/control/cmd"),),
        subscriptions=(
            Subscription(
                "/planning/trajectory",
                ("/control/cmd",),
                Work(600 * MICROSECOND, 400 * MICROSECOND),
                message_type="nav_msgs::msg::Path",
            ),
            Subscription(
                "/localization/odometry",
                work=Work(40 * MICROSECOND, 30 * MICROSECOND),
                message_type="nav_msgs::msg::Odometry",
            ),
        ),
    )
    return (
        Process("planner", _COMPUTER, 921, (planner,), start_ns=19 * MILLISECOND),
        # Two nodes in one process, spun by one executor.
        Process(
            "control_container",
            _COMPUTER,
            955,
            (estimator, controller),
            start_ns=24 * MILLISECOND,
        ),
    )


def _relay(
    name: str,
    heard: str,
    said: str,
    work: Work,
    message_type: str,
    *,
    depths: tuple[int, int] = (10, 10),
    logs: bool = False,
) -> Node:
    """Return a node that answers each message with one, in the namespace of what it publishes."""
    subscription = Subscription(
        heard, (said,), work, depth=depths[0], message_type=message_type, logs=logs
    )
    publishers = (Publisher(said, depths[1]),)
    namespace = said.rpartition("/")[0]
    return Node(name, namespace, publishers=publishers, subscriptions=(subscription,))
