"""msgflow.trace reads any CTF trace: it names no event of ROS 2 and no layer of it."""

from __future__ import annotations

import re
from pathlib import Path

ROOM = Path(__file__).resolve().parents[2] / "msgflow" / "trace"
# Hints may name the command `ros2 trace`, which writes traces.
OF_ROS = re.compile(r"\b(ros2|dds):|\b(rcl|rclcpp|rclpy|rmw)(_|\b)|message_link|callback_start")


def test_no_names_of_ros() -> None:
    found = {
        path.relative_to(ROOM): match[0]
        for path in ROOM.rglob("*.py")
        if (match := OF_ROS.search(path.read_text()))
    }
    assert not found
