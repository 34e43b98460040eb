"""A robot of two nodes, each a process of its own: `python3 robot.py camera`, `… detector`.

The camera publishes /image four times per second; the detector works on each for 5 ms, then
publishes /objects, and ends after 20.
"""

import contextlib
import sys
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import UInt64


class Camera(Node):
    """Publishes images."""

    def __init__(self):
        super().__init__("camera")
        self.image = self.create_publisher(UInt64, "/image", 10)
        self.create_timer(0.25, self.look)

    def look(self):
        """Publish what it sees."""
        self.image.publish(UInt64())


class Detector(Node):
    """Looks for objects in images."""

    def __init__(self):
        super().__init__("detector")
        self.images = 0
        self.objects = self.create_publisher(UInt64, "/objects", 10)
        self.create_subscription(UInt64, "/image", self.detect, 10)

    def detect(self, image):
        """Compute for 5 ms."""
        end = time.thread_time() + 0.005
        while time.thread_time() < end:
            pass
        self.objects.publish(UInt64(data=image.data))
        self.images += 1
        self.get_logger().info(f"{self.images} images")
        if self.images == 20:
            raise SystemExit


if __name__ == "__main__":
    rclpy.init()
    with contextlib.suppress(ExternalShutdownException, KeyboardInterrupt):
        rclpy.spin({"camera": Camera, "detector": Detector}[sys.argv[1]]())
