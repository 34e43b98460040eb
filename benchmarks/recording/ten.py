"""A robot of ten nodes in one process, which counts its callbacks; another Python runs it.

    python ten.py SECONDS CALLS

It prints how many callbacks ran in so many seconds, then `ready`. For each line that it reads, it
runs so many callbacks as fast as it can, and prints the nanoseconds of CPU that each took, with its
turn of the executor.
"""

import os
import sys
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import UInt64


def main() -> None:
    """Run the robot, then what is asked for."""
    seconds, calls = float(sys.argv[1]), int(sys.argv[2])
    rclpy.init(domain_id=43)
    executor = SingleThreadedExecutor()
    ran = [0]

    def count(*_: object) -> None:
        ran[0] += 1

    for number in range(10):
        node = Node(f"node_{number}")
        node.create_subscription(UInt64, f"/topic_{number}", count, 10)
        send = node.create_publisher(UInt64, f"/topic_{(number + 1) % 10}", 10).publish
        node.create_timer(0.1, lambda send=send: (count(), send(UInt64())))
        executor.add_node(node)
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        executor.spin_once(0.1)
    print(ran[0], flush=True)
    alone = SingleThreadedExecutor()
    node = Node("alone", enable_rosout=False, start_parameter_services=False)
    condition = node.create_guard_condition(count)
    alone.add_node(node)
    print("ready", flush=True)
    for _ in sys.stdin:
        begin = time.process_time_ns()
        for _ in range(calls):
            condition.trigger()
            alone.spin_once(0)
        print((time.process_time_ns() - begin) // calls, flush=True)
    # Threads of the middleware may still call Python while it ends.
    os._exit(0)


if __name__ == "__main__":
    main()
