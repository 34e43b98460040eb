"""One process of the robot of `simulated.py`, with nodes of rclpy.

python robot.py PROCESS [PROBLEM]…
"""

from __future__ import annotations

import os
import random
import time

import rclpy
from parts import PROBLEMS, run
from rcl_interfaces.srv import ListParameters
from rclpy.node import Node
from std_msgs.msg import UInt64


def work(milliseconds: float, spread: float = 0) -> None:
    """Take so long. It costs no CPU: the machine may be a small one."""
    time.sleep((milliseconds + spread * random.random()) / 1e3)


class Relay(Node):
    """A node of the robot."""

    def says(self, topic: str):
        """Return what publishes to a topic."""
        publisher = self.create_publisher(UInt64, topic, 10)
        return lambda: publisher.publish(UInt64())

    def hears(self, topic: str, callback, depth: int = 10) -> None:
        """Call back with each message of a topic."""
        self.create_subscription(UInt64, topic, lambda _: callback(), depth)


def sensor(name: str, topic: str, milliseconds: int) -> list[Node]:
    """Publish with a period."""
    node = Relay(name)
    send = node.says(topic)
    node.create_timer(milliseconds / 1e3, lambda: (work(1), send()))
    return [node]


def relay(name: str, heard: str, said: str, usual: float, spread: float = 1, depth: int = 10):
    """Answer each message of a topic."""
    node = Relay(name)
    send = node.says(said)
    node.hears(heard, lambda: (work(usual, spread), send()), depth)
    return [node]


def filters() -> list[Node]:
    """Take 60 ms for each scan, if planted."""
    return relay("filter", "/scan", "/points", 60 if "slow" in PROBLEMS else 3, 5)


def detector() -> list[Node]:
    """Take longer for each image than until the next, with a queue of 1, if planted."""
    if "queue" in PROBLEMS:
        return relay("detector", "/image", "/objects", 50, 35, depth=1)
    return relay("detector", "/image", "/objects", 7)


def localization() -> list[Node]:
    """Localize, beside a monitor in the same executor: 80 ms each 190 ms, if planted."""
    if "hog" in PROBLEMS:
        # Where the hog is.
        os.sched_setaffinity(0, {0})
    monitor = Relay("monitor")
    monitor.create_timer(0.19, lambda: work(80 if "busy" in PROBLEMS else 1, 4))
    return [*relay("localizer", "/points", "/pose", 4), monitor]


def map_server() -> list[Node]:
    """Answer, after 120 ms if planted."""
    node = Relay("map_server")

    def answer(_, response: ListParameters.Response) -> ListParameters.Response:
        work(120 if "service" in PROBLEMS else 1, 3)
        return response

    node.create_service(ListParameters, "/get_map", answer)
    return [node]


def planner() -> list[Node]:
    """Ask the map server in the callback of each pose, if planted, in an executor of its own.

    No executor of several threads: that of rclpy looks for work again and again until a thread of
    its pool begins with it, and can keep that thread from beginning for some hundred milliseconds.
    """
    node = Relay("planner")
    send = node.says("/plan")
    ask = asking() if "service" in PROBLEMS else lambda: None
    node.hears("/pose", lambda: (work(3), ask(), send()))
    return [node]


def asking():
    """Return what asks the map server, and waits for its answer."""
    node = rclpy.create_node("planner_client")
    client = node.create_client(ListParameters, "/get_map")

    def ask() -> None:
        if client.service_is_ready():
            rclpy.spin_until_future_complete(node, client.call_async(ListParameters.Request()))

    return ask


def control() -> list[Node]:
    """Answer each plan, or the last one each 600 ms, if planted."""
    node = Relay("controller")
    send = node.says("/cmd")
    if "stale" in PROBLEMS:
        node.hears("/plan", lambda: work(1))
        node.create_timer(0.6, lambda: (work(1), send()))
    else:
        node.hears("/plan", lambda: (work(1), send()))
    motors = Relay("motors")
    motors.hears("/cmd", lambda: work(1))
    motors.hears("/objects", lambda: None)
    return [node, motors]


PROCESSES = {
    "lidar": lambda: sensor("lidar", "/scan", 200),
    "camera": lambda: sensor("camera", "/image", 50),
    "filter": filters,
    "detector": detector,
    "localization": localization,
    "map_server": map_server,
    "planner": planner,
    "control": control,
}


if __name__ == "__main__":
    run(PROCESSES)
