"""One process of the drone: nine nodes in eight processes.

    python drone.py PROCESS [PROBLEM]…

    camera ─/camera/rect→ visual_odometry ─/vio/pose→ estimator ─/odom→ planner ─/path→ controller
    imu_driver ─/imu→ estimator                       controller ─/motor_cmd→ motor

The planner awaits an answer of the map server. A thread of the camera publishes what a timer
grabbed.
"""

from __future__ import annotations

import gc
import queue
import time

from parts import PROBLEMS, Part, compute, compute_for_ever, heap, in_background, run
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from test_msgs.srv import BasicTypes


class ImuDriver(Part):
    """50 samples a second."""

    def __init__(self) -> None:
        super().__init__("imu_driver")
        self.send = self.out("/imu")
        self.create_timer(0.02, self.sample)

    def sample(self) -> None:
        """Publish a sample."""
        self.send()


class Camera(Part):
    """Ten images a second, raw by the timer and rectified by a thread."""

    def __init__(self) -> None:
        super().__init__("camera")
        self.send_raw = self.out_frame("/camera/raw", 20_000, is_reliable=False)
        self.send = self.out_frame("/camera/rect", 20_000, is_reliable="qos" not in PROBLEMS)
        self.grabbed = queue.Queue()
        in_background(self.rectify)
        self.create_timer(0.1, self.grab)

    def grab(self) -> None:
        """Publish an image, and leave it to the thread."""
        self.send_raw()
        self.grabbed.put(self.calls)

    def rectify(self) -> None:
        """Publish each image rectified."""
        while True:
            self.grabbed.get()
            compute(4)
            self.send()


class VisualOdometry(Part):
    """A pose for each image."""

    def __init__(self) -> None:
        super().__init__("visual_odometry")
        self.send = self.out("/vio/pose")
        self.hear_frame("/camera/rect", self.on_image)
        if "gil" in PROBLEMS:
            in_background(compute_for_ever)

    def relocalize(self) -> None:
        """Look for the place in the whole map."""
        compute(160)

    def on_image(self, _) -> None:
        """Match features, and publish the pose."""
        compute(8)
        if self.is_each(9) and "sometimes" in PROBLEMS:
            self.relocalize()
        self.send()


class Estimator(Part):
    """The state of the drone for each sample."""

    def __init__(self) -> None:
        super().__init__("estimator")
        self.send = self.out("/odom")
        self.send_transform = self.out("/tf", 100)
        self.hear("/imu", self.on_imu)
        self.hear("/vio/pose", self.on_pose)
        self.past = heap(400_000) if "gc" in PROBLEMS else []

    def on_pose(self, message) -> None:
        """Keep the pose."""
        self.pose = message
        compute(1)

    def on_imu(self, _) -> None:
        """Publish the state."""
        compute(1)
        if self.is_each(40) and "gc" in PROBLEMS:
            gc.collect()
        self.send()
        self.send_transform()


class Planner(Part):
    """A path for each fifth state, with an answer of the map server."""

    def __init__(self) -> None:
        super().__init__("planner")
        self.send = self.out("/path")
        self.map = self.create_client(
            BasicTypes, "/map/query", callback_group=ReentrantCallbackGroup()
        )
        self.hear("/odom", self.on_odom, group=MutuallyExclusiveCallbackGroup())

    async def on_odom(self, _) -> None:
        """Plan."""
        if not self.is_each(5):
            return
        if self.map.service_is_ready():
            await self.map.call_async(BasicTypes.Request())
        compute(3)
        self.send()


class MapServer(Part):
    """Answers."""

    def __init__(self) -> None:
        super().__init__("map_server")
        self.create_service(BasicTypes, "/map/query", self.on_query)

    def on_query(self, _, response: BasicTypes.Response) -> BasicTypes.Response:
        """Look into the map."""
        compute(1)
        if self.is_each(6) and "service" in PROBLEMS:
            time.sleep(0.35)
        return response


class Controller(Part):
    """A command each 20 ms."""

    def __init__(self) -> None:
        super().__init__("controller")
        self.path = None
        self.send = self.out("/motor_cmd")
        self.hear("/path", self.on_path)
        self.create_timer(0.25 if "timer" in PROBLEMS else 0.02, self.control)

    def on_path(self, message) -> None:
        """Keep the path."""
        self.path = message

    def control(self) -> None:
        """Follow the path."""
        if self.path is not None:
            compute(0.5)
            self.send()


class Motor(Part):
    """The end of the way."""

    def __init__(self) -> None:
        super().__init__("motor")
        self.hear("/motor_cmd", self.on_command)

    def on_command(self, _) -> None:
        """Turn."""
        compute(0.2)


class Aggregator(Part):
    """Hears heartbeats."""

    def __init__(self) -> None:
        super().__init__("diagnostic_aggregator", is_silent=True)
        self.hear_health(self.on_diagnostics)

    def on_diagnostics(self, _) -> None:
        """Keep it."""


PROCESSES = {
    "imu": lambda: [ImuDriver()],
    "camera": lambda: [Camera()],
    "vio": lambda: [VisualOdometry()],
    "estimator": lambda: [Estimator()],
    "planner": lambda: [Planner()],
    "map": lambda: [MapServer()],
    "control": lambda: [Controller(), Motor()],
    "diagnostics": lambda: [Aggregator()],
}

if __name__ == "__main__":
    run(PROCESSES)
