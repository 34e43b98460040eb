"""A node of a chain: the source, one that sends on, or the sink; another Python runs it.

    python chain.py NUMBER LAST DOMAIN SECONDS

It says `ready`. The source (0) reads lines with a number of messages and a rate, and sends them.
The sink prints how old each is, in nanoseconds. Messages are times of CLOCK_MONOTONIC.
"""

import sys
import threading
import time

import rclpy
from rclpy.node import Node
from std_msgs.msg import UInt64


def main() -> None:
    """Run a node until the process is ended."""
    number, last, domain = map(int, sys.argv[1:4])
    seconds = float(sys.argv[4])
    rclpy.init(domain_id=domain)
    node = Node(f"node_{number}")
    send = node.create_publisher(UInt64, f"/hop_{number + 1}", 10).publish
    if number == 0:
        threading.Thread(target=answer, args=(node, send), daemon=True).start()
    else:

        def heard(message: UInt64) -> None:
            time.sleep(seconds)
            if number < last:
                send(message)
            else:
                print(time.monotonic_ns() - message.data, flush=True)

        node.create_subscription(UInt64, f"/hop_{number}", heard, 10)
    print("ready", flush=True)
    rclpy.spin(node)


def answer(node: Node, send) -> None:
    """Send the messages that are asked for, by a timer."""
    for line in sys.stdin:
        messages, rate = line.split()
        left = [int(messages)]
        over = threading.Event()

        def tick(left=left, over=over) -> None:
            if left[0]:
                left[0] -= 1
                send(UInt64(data=time.monotonic_ns()))
            else:
                over.set()

        timer = node.create_timer(1 / float(rate), tick)
        over.wait()
        node.destroy_timer(timer)


if __name__ == "__main__":
    main()
