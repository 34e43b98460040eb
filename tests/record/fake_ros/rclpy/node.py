"""Makes timers."""

import rclpy.executors
from rclpy._core import Handle
from rclpy.timer import Timer


class Node:
    handle = Handle(900)

    def create_timer(self, pointer, callback):
        return Timer(pointer, callback)
