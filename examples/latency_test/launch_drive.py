"""A launch test of the robot: `launch_test launch_drive.py`. It ends after 20 images."""

import unittest
from pathlib import Path

from launch import LaunchDescription
from launch.actions import ExecuteProcess
from launch_testing.actions import ReadyToTest

ROBOT = str(Path(__file__).with_name("robot.py"))


def generate_test_description():
    """Start the nodes; the test begins at once."""
    nodes = [ExecuteProcess(cmd=["python3", ROBOT, name]) for name in ("detector", "camera")]
    return LaunchDescription([*nodes, ReadyToTest()])


class TestDrive(unittest.TestCase):
    """What the launch test itself wants to know."""

    def test_images_are_seen(self, proc_output):
        """The detector says how many."""
        proc_output.assertWaitFor("20 images", timeout=60)
