"""What nodes of all robots of rclpy share; needs rclpy and no package of msgflow."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Collection, Mapping

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import String, UInt8MultiArray

PROBLEMS = set(sys.argv[2:])
"""What is planted."""

_DISK_WRITE_BYTES = 1 << 18
_DISK_SECONDS = 0.025


class Part(Node):
    """A node that says once a second that it is well."""

    def __init__(self, name: str, *, is_silent: bool = False) -> None:
        super().__init__(name)
        self.calls = 0
        if not is_silent:
            self.health = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
            self.create_timer(1.0, self.beat)

    def beat(self) -> None:
        """Say that the node is well."""
        status = DiagnosticStatus(name=self.get_name(), message="well")
        self.health.publish(DiagnosticArray(status=[status]))

    def out(self, topic: str, depth: int = 10):
        """Return a function that publishes a short message."""
        publisher = self.create_publisher(String, topic, depth)
        return lambda: publisher.publish(String(data=topic))

    def out_frame(self, topic: str, size: int, *, is_reliable: bool = True):
        """Return a function that publishes an image or a scan of so many bytes."""
        publisher = self.create_publisher(UInt8MultiArray, topic, quality(5, is_reliable))
        frame = UInt8MultiArray(data=bytes(size))
        return lambda: publisher.publish(frame)

    def hear(self, topic: str, callback: Callable, depth: int = 10, group=None) -> None:
        """Call back with each short message of a topic."""
        self.create_subscription(String, topic, callback, depth, callback_group=group)

    def hear_frame(
        self, topic: str, callback: Callable, *, is_reliable: bool = True, group=None
    ) -> None:
        """Call back with each image or scan of a topic."""
        profile = quality(5, is_reliable)
        self.create_subscription(UInt8MultiArray, topic, callback, profile, callback_group=group)

    def hear_health(self, callback: Callable) -> None:
        """Call back with what nodes say once a second."""
        self.create_subscription(DiagnosticArray, "/diagnostics", callback, 50)

    def is_each(self, number: int) -> bool:
        """Count a call; tell whether it is one of so many."""
        self.calls += 1
        return self.calls % number == 0


def quality(depth: int, is_reliable: bool) -> QoSProfile:
    """Return a quality of service."""
    policy = ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT
    return QoSProfile(depth=depth, reliability=policy)


def compute(milliseconds: float) -> None:
    """Have the CPU for so long, however long that takes."""
    end = time.thread_time() + milliseconds / 1e3
    while time.thread_time() < end:
        sum(range(300))


def compute_for_ever() -> None:
    """Keep the lock of the interpreter as often as it can be had."""
    total = 0
    while True:
        for number in range(999):
            total ^= number


def in_background(function: Callable[[], None]) -> None:
    """Run a function in a thread beside the executor."""
    threading.Thread(target=function, daemon=True).start()


def write_to_disk(path: str) -> None:
    """Write, and wait for the disk. One that is faster than a card of flash waits as long."""
    with open(path, "ab") as file:
        file.write(os.urandom(_DISK_WRITE_BYTES))
        file.flush()
        os.fsync(file.fileno())
    time.sleep(_DISK_SECONDS)


def heap(objects: int) -> list[dict[str, list[int]]]:
    """Return so many objects for the garbage collection to look at."""
    return [{"at": [number]} for number in range(objects)]


def run(
    processes: Mapping[str, Callable[[], list[Node]]], *, several_threads: Collection[str] = ()
) -> None:
    """Run the process that the command line names until Ctrl-C, which ends it at once.

    An executor of several threads is only where the problem needs one: that of rclpy looks for work
    again and again while a callback group is busy, and no such robot is healthy on a small machine.
    """
    process = sys.argv[1]
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    executor = MultiThreadedExecutor(3) if process in several_threads else SingleThreadedExecutor()
    for node in processes[process]():
        executor.add_node(node)
    print("ready", flush=True)
    executor.spin()
