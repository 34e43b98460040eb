"""What can be planted in each robot, and what a verdict has to say of it.

Names of robots are those of `launch.py`. Limits are wide where a machine that is not alone makes
things longer.
"""

from __future__ import annotations

from functools import partial

from robot.judge import Culprit, Kind, Limits


def _ms(least: float, most: float) -> Limits:
    return Limits("ms", least, most)


def _count(least: float, most: float) -> Limits:
    return Limits("count", least, most)


# More than a thread has, but no more than it is asked for with what is usual besides.
_OVER = Limits("%", 90, 160)
# What delays a callback without being in it.
_ANY = _ms(8, 3_000)
_NODE = r"/.+"
# By the kernel its thread has a name, by samples its process a command.
_HOG = r"compressor|hog\.py"

# It sleeps with rclpy, and computes in the simulator.
_WORK = (Kind.COMPUTES, Kind.SLEEPS)
ROBOT = {
    "slow": Culprit(
        _WORK, "/filter", (_ms(45, 75),), r"Subscription\(/scan\)"
    ),
    "busy": Culprit(
        _WORK, "/monitor", (_ms(45, 100),), r"Timer\(190 ms\)",
    ),
    "queue": Culprit(
        (*_WORK, Kind.OVERLOAD, Kind.QUEUE), "/detector",
        (_ms(50, 100), _count(20, 120), _OVER), r"Subscription\(/image\)",
    ),
    "hog": Culprit(
        (Kind.NO_CPU,), r"compressor.*|/localizer", (_ms(45, 110),), names=(_HOG,),
        sufferer="/localizer",
    ),
    "late": Culprit((Kind.LATE_START,), "/planner", (_ms(3_000, 6_000),)),
    "stale": Culprit((Kind.STALE,), "/controller", (_ms(590, 610),), r"Timer\(600 ms\)"),
    "service": Culprit(
        (Kind.AWAITS, *_WORK), "/map_server|/planner", (_ms(110, 170),),
        r"Service\(/get_map\)|Subscription\(/pose\)", names=("/planner", "/map_server|/get_map"),
    ),
}  # fmt: skip
DRONE = {
    "sometimes": Culprit(
        (Kind.COMPUTES,), "/visual_odometry", (_ms(140, 300),),
        r"Subscription\(/camera/rect\)", "on_image",
    ),
    "timer": Culprit((Kind.STALE,), "/controller", (_ms(245, 255),), r"Timer\(250 ms\)"),
    "service": Culprit(
        (Kind.AWAITS,), "/planner|/map_server", (_ms(300, 450),),
        r"Subscription\(/odom\)|Service\(/map/query\)", "on_odom|on_query",
        names=("/planner", "/map_server|/map/query"),
    ),
    "gc": Culprit(
        (Kind.GARBAGE_COLLECTION,), "/estimator", (_ms(50, 3_000),),
        r"Subscription\(/imu\)", "on_imu",
    ),
    "gil": Culprit(
        (Kind.PROCESS_THREAD,), "/visual_odometry", (_ANY,),
        r"Subscription\(/camera/rect\)", "on_image", sufferer="/visual_odometry",
    ),
    "hog": Culprit(
        (Kind.NO_CPU,), rf"compressor.*|{_NODE}", (_ANY,), names=(_HOG,), sufferer=_NODE
    ),
    "restart": Culprit(
        (Kind.RESTART,), "/visual_odometry", (_ms(1_500, 15_000), _count(15, 80))
    ),
    "qos": Culprit(
        (Kind.NEVER_MATCHED,), "/camera|/visual_odometry", (_count(60, 250),),
        names=("/camera/rect", "/visual_odometry"),
    ),
}  # fmt: skip
PICKER = {
    "queue": Culprit(
        (Kind.COMPUTES, Kind.OVERLOAD, Kind.QUEUE), "/arm_control", (_ms(20, 50), _OVER),
        r"Subscription\(/pose\)", "on_pose",
    ),
    "depth1": Culprit(
        (Kind.SLEEPS, Kind.QUEUE), "/safety", (_ms(55, 120), _count(30, 600)),
        r"Subscription\((/obstacles|/pose)\)", "on_obstacles|on_pose",
    ),
    "lock": Culprit(
        (Kind.LOCK,), "/fusion", (_ms(60, 200),),
        r"Subscription\((/scan|/joint_states)\)", "on_scan|on_joints",
        names=("/joint_states|on_joints", "/scan|on_scan"), sufferer="/fusion",
    ),
    "disk": Culprit(
        (Kind.DISK, Kind.SLEEPS), "/arm_control", (_ms(20, 500),),
        r"Subscription\(/pose\)", "on_pose", sufferer="/arm_control",
    ),
    "burst": Culprit((Kind.BURST,), "/lidar", (_count(19, 21),)),
    "over": Culprit(
        (Kind.OVERLOAD,), r"/arm_control|/monitor_\d|python.*", (_OVER, _ms(8, 20)),
        names=("monitor",),
    ),
    "action": Culprit(
        (Kind.ACTION,), "/arm_action", (_ms(590, 750),), r".*/arm/move.*", "execute_move"
    ),
}  # fmt: skip
VEHICLE = {
    "sometimes": Culprit(
        (Kind.COMPUTES,), "/tracker", (_ms(120, 260),), r"Subscription\(/cloud\)", "on_cloud"
    ),
    "queue": Culprit(
        (Kind.COMPUTES, Kind.OVERLOAD, Kind.QUEUE), "/tracker", (_ms(75, 150), _OVER),
        r"Subscription\(/cloud\)", "on_cloud",
    ),
    "depth1": Culprit(
        (Kind.SLEEPS, Kind.QUEUE), "/watchdog", (_ms(45, 110), _count(30, 600)),
        r"Subscription\((/tracks|/speed)\)", "on_tracks|on_speed",
    ),
    "timer": Culprit((Kind.STALE,), "/pilot", (_ms(590, 610),), r"Timer\(600 ms\)"),
    "service": Culprit(
        (Kind.AWAITS,), "/behavior|/router", (_ms(250, 380),),
        r"Subscription\(/tracks\)|Service\(/route\)", "on_tracks|on_route",
        names=("/behavior", "/router|/route"),
    ),
    "lock": Culprit(
        (Kind.LOCK,), "/merger", (_ms(45, 150),),
        r"Subscription\(/(front|rear)/points\)", "on_front|on_rear",
        names=("/front/points|on_front", "/rear/points|on_rear"), sufferer="/merger",
    ),
    "disk": Culprit(
        (Kind.DISK, Kind.SLEEPS), "/wheels", (_ms(20, 500),),
        r"Subscription\(/steering\)", "on_steering", sufferer="/wheels",
    ),
    # A thread without callbacks sends.
    "burst": Culprit((Kind.BURST,), "/rear_lidar", (_count(15, 17),)),
    "over": Culprit(
        (Kind.OVERLOAD,), r"/pilot|/wheels|/logger_\d|python.*", (_OVER, _ms(12, 30)),
        names=("logger",),
    ),
    "action": Culprit(
        (Kind.ACTION,), "/maneuver", (_ms(530, 700),), r".*/park.*", "execute_park"
    ),
    "gc": Culprit(
        (Kind.GARBAGE_COLLECTION,), "/tracker", (_ms(50, 3_000),),
        r"Subscription\(/cloud\)", "on_cloud",
    ),
    "gil": Culprit(
        (Kind.PROCESS_THREAD,), "/tracker", (_ANY,),
        r"Subscription\(/cloud\)", "on_cloud", sufferer="/tracker",
    ),
    "hog": Culprit(
        (Kind.NO_CPU,), rf"compressor.*|{_NODE}", (_ANY,), names=(_HOG,), sufferer=_NODE
    ),
    "restart": Culprit((Kind.RESTART,), "/tracker", (_ms(1_500, 15_000), _count(20, 110))),
    "qos": Culprit(
        (Kind.NEVER_MATCHED,), "/merger|/tracker", (_count(90, 350),),
        names=("/cloud", "/tracker"),
    ),
}  # fmt: skip
_of_worker = partial(
    Culprit, who="/worker", callback=r"Subscription\(/scan\)", function="on_scan|Worker::on_scan"
)
# As long as it works; what keeps it from the CPU makes that longer.
_WORK_TIME = (_ms(17, 40),)
WORKER = {
    "computes": _of_worker((Kind.COMPUTES,), limits=_WORK_TIME),
    "sleeps": _of_worker((Kind.SLEEPS,), limits=_WORK_TIME),
    "lock": _of_worker((Kind.LOCK,), limits=_WORK_TIME, names=("on_image",)),
    "disk": _of_worker((Kind.DISK,), limits=(_ms(17, 120),)),
    "hog": Culprit(
        (Kind.NO_CPU,), r".*train\.py.*|/worker", (_ms(40, 5_000),), names=(r"train\.py",)
    ),
    "quota": Culprit(
        (Kind.NO_CPU,), "/worker", (_ms(15, 300),), names=("msgflow-planted", "0.3 CPU")
    ),
}
ROBOTS = {
    "robot": ROBOT,
    "drone": DRONE,
    "picker": PICKER,
    "vehicle": VEHICLE,
    "worker": WORKER,
    "c_worker": WORKER,
}
"""By the name of a robot."""

# Two at once, the worse one first.
PAIRS = {
    "robot": (
        ("service", "slow"),
        ("slow", "busy"),
        ("stale", "busy"),
        ("queue", "late"),
        ("stale", "late"),
        ("queue", "hog"),
        ("service", "hog"),
    ),
    "drone": (("service", "sometimes"), ("restart", "timer")),
    "picker": (("action", "disk"), ("over", "depth1")),
    "vehicle": (("action", "sometimes"),),
    "worker": (),
    "c_worker": (),
}
