"""RTAB-Map, a SLAM system, on a robot and a laptop.

Written down before it was first simulated, and not changed to meet any result. Where it is from:

- Nodes, hosts, topics and who listens to transforms: experiment 2 of Bédard et al., "Message Flow
  Analysis with Complex Causal Links for Distributed ROS 2 Systems" (text and figure 8). The camera
  driver and the odometry run on the robot, SLAM and rviz on a laptop in the same wireless network.
  The odometry, SLAM and rviz have a transform listener each: a node with an executor of its own.
- What callbacks compute: 89.5 ms the odometry, 112.5 ms SLAM (the one message that the paper
  measures); it varies by some ms here. What is computed comes before what is published.
- The odometry publishes on /tf in its callback; the listener of its own process hears it as well,
  and there is no loop.
- Ids of the processes of the odometry and of SLAM: the paper.

Assumptions of ours:

- The camera has 10 images a second, the most that this odometry keeps up with. Depth images and
  camera infos are left out: the colour image stands for what the odometry waits for.
- SLAM takes what the odometry publishes on /odom, one message at a time, the latest: at 112.5 ms
  of computing it cannot have all.
- Colour images have 640 x 480 pixels of three bytes, the map a few hundred kB. 8 CPUs per host.
- Clocks kept together by NTP over a wireless network: the laptop is 3 ms ahead and runs 12 ppm too
  fast.
- What a transform listener hears is used when its process next computes something of it. The paper
  leaves such a link as future work. Here SLAM says so in its trace: the latest /tf is part of every
  /mapGraph.
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
from msgflow_sim.scenario.transforms import listener
from msgflow_sim.system import Executor, Host, Node, Process, Scenario

_ROBOT, _LAPTOP = "scout", "laptop"
_CPU_COUNT = 8
_IMAGE_BYTES = 640 * 480 * 3
_MAP_BYTES = 300_000
_IMAGE, _MAP_GRAPH = "/camera/color/image_raw", "/mapGraph"
_ODOMETRY_WORK = Work(88 * MILLISECOND, 3 * MILLISECOND, percent_before=100)
_SLAM_WORK = Work(110 * MILLISECOND, 5 * MILLISECOND, percent_before=100)
_DRAWING = Work(4 * MILLISECOND, 2 * MILLISECOND)
_BOTH = (Executor(), Executor())


def rtabmap() -> Scenario:
    """From a camera to a map on another host, with transforms beside."""
    camera = Node(
        "camera",
        "/camera",
        publishers=(Publisher(_IMAGE, 1, _IMAGE_BYTES),),
        timers=(Timer(100 * MILLISECOND, (_IMAGE,)),),
    )
    odometry = Node(
        "rgbd_odometry",
        publishers=(Publisher("/odom", 1), Publisher("/tf", 100)),
        subscriptions=(
            Subscription(
                _IMAGE, ("/odom", "/tf"), _ODOMETRY_WORK, 1, message_type="sensor_msgs::msg::Image"
            ),
        ),
    )
    heard_by_slam = listener(0x5566A1B0)
    slam = Node(
        "rtabmap",
        publishers=(
            Publisher("/mapData", 1, _MAP_BYTES),
            Publisher(_MAP_GRAPH, 1),
            Publisher("/tf", 100),
        ),
        subscriptions=(
            Subscription(
                "/odom",
                ("/mapData", _MAP_GRAPH, "/tf"),
                _SLAM_WORK,
                1,
                message_type="nav_msgs::msg::Odometry",
            ),
        ),
        links=(
            MessageLink(
                "periodic_async", ("/tf",), (_MAP_GRAPH,), inputs_of=heard_by_slam.full_name
            ),
        ),
    )
    rviz = Node(
        "rviz",
        subscriptions=(
            Subscription("/mapData", (), _DRAWING, 1, message_type="rtabmap_msgs::msg::MapData"),
            Subscription(_MAP_GRAPH, (), _DRAWING, 1, message_type="rtabmap_msgs::msg::MapGraph"),
        ),
    )
    return Scenario(
        name="rtabmap",
        description="RTAB-Map on a robot and a laptop: camera, odometry, SLAM and rviz.",
        hosts=(
            Host(_ROBOT, _CPU_COUNT),
            Host(_LAPTOP, _CPU_COUNT, clock_offset_ns=3 * MILLISECOND, clock_drift_ppm=12),
        ),
        processes=(
            Process("realsense2_camera_node", _ROBOT, 1301, (camera,)),
            Process(
                "rgbd_odometry",
                _ROBOT,
                1348,
                (listener(0x55D01C40), odometry),
                start_ns=10 * MILLISECOND,
                executors=_BOTH,
            ),
            Process(
                "rtabmap",
                _LAPTOP,
                194363,
                (heard_by_slam, slam),
                start_ns=5 * MILLISECOND,
                executors=_BOTH,
            ),
            Process(
                "rviz2",
                _LAPTOP,
                194375,
                (listener(0x5581E3D2), rviz),
                start_ns=15 * MILLISECOND,
                executors=_BOTH,
            ),
        ),
        duration_ns=20 * SECOND,
        layout="rolling",
        overwrites=True,
    )
