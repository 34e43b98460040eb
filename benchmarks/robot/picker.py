"""One process of the picker: eight nodes in seven processes.

    python picker.py PROCESS [PROBLEM]…

    joint_driver ─/joint_states→ fusion ─/pose→ arm_control ─/arm/cmd→ arm_drive
    lidar ─/scan→ fusion ─/obstacles→ safety ─/stop→ arm_action ─/arm/halt→ task_manager

Two callback groups of the fusion share a lock. The task manager sends goals of the action /arm/move
to arm_action.
"""

from __future__ import annotations

import threading
import time

from parts import PROBLEMS, Part, compute, run, write_to_disk
from rclpy.action import ActionClient, ActionServer
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from test_msgs.action import Fibonacci


class JointDriver(Part):
    """50 readings a second."""

    def __init__(self) -> None:
        super().__init__("joint_driver")
        self.send = self.out("/joint_states")
        self.create_timer(0.02, self.read_joints)

    def read_joints(self) -> None:
        """Publish a reading."""
        self.send()


class Lidar(Part):
    """Ten scans a second, or 20 at once each two seconds."""

    def __init__(self) -> None:
        super().__init__("lidar")
        self.send = self.out_frame("/scan", 4_000)
        self.create_timer(0.1, self.turn_head)

    def turn_head(self) -> None:
        """Publish."""
        if "burst" not in PROBLEMS:
            self.send()
        elif self.is_each(20):
            for _ in range(20):
                self.send()


class Fusion(Part):
    """Poses of joints and obstacles of scans, on threads of their own."""

    def __init__(self) -> None:
        super().__init__("fusion")
        self.lock = threading.Lock()
        self.send_pose = self.out("/pose")
        self.send_obstacles = self.out("/obstacles")
        self.hear_frame("/scan", self.on_scan, group=MutuallyExclusiveCallbackGroup())
        self.hear("/joint_states", self.on_joints, group=MutuallyExclusiveCallbackGroup())

    def on_scan(self, _) -> None:
        """Find obstacles."""
        with self.lock:
            compute(3)
            if "lock" in PROBLEMS:
                time.sleep(0.07)
        self.send_obstacles()

    def on_joints(self, _) -> None:
        """Find the pose."""
        with self.lock:
            compute(0.5)
        self.send_pose()


class Safety(Part):
    """Stops the arm."""

    def __init__(self) -> None:
        super().__init__("safety")
        self.send = self.out("/stop", 1)
        self.hear("/obstacles", self.on_obstacles)
        self.hear("/pose", self.on_pose, 1 if "depth1" in PROBLEMS else 10)

    def on_pose(self, _) -> None:
        """Look whether the arm is where it may be."""
        compute(0.3)

    def on_obstacles(self, _) -> None:
        """Look whether somebody is in its way."""
        compute(1)
        if "depth1" in PROBLEMS:
            time.sleep(0.06)
        self.send()


class ArmControl(Part):
    """A command for each pose."""

    def __init__(self) -> None:
        super().__init__("arm_control")
        self.send = self.out("/arm/cmd")
        self.hear("/pose", self.on_pose)

    def on_pose(self, _) -> None:
        """Control the position."""
        compute(23 if "queue" in PROBLEMS else 1)
        if self.is_each(3) and "disk" in PROBLEMS:
            self.get_logger().info("a third pose")
            write_to_disk("arm.log")
        self.send()


class ArmDrive(Part):
    """The end of the way."""

    def __init__(self) -> None:
        super().__init__("arm_drive")
        self.hear("/arm/cmd", self.on_command)

    def on_command(self, _) -> None:
        """Move."""
        compute(0.2)


class ArmAction(Part):
    """Executes goals, and passes on that the arm has to stop, on one thread."""

    def __init__(self) -> None:
        super().__init__("arm_action")
        self.server = ActionServer(self, Fibonacci, "/arm/move", self.execute_move)
        self.send = self.out("/arm/halt", 1)
        self.hear("/stop", self.on_stop, 1)

    def on_stop(self, _) -> None:
        """Pass it on."""
        compute(0.2)
        self.send()

    def execute_move(self, goal) -> Fibonacci.Result:
        """Move in four steps."""
        for step in range(4):
            if "action" in PROBLEMS:
                time.sleep(0.15)
            goal.publish_feedback(Fibonacci.Feedback(sequence=[step]))
        goal.succeed()
        return Fibonacci.Result(sequence=[4])


class TaskManager(Part):
    """Sends a goal each 1.5 s."""

    def __init__(self) -> None:
        super().__init__("task_manager")
        self.client = ActionClient(self, Fibonacci, "/arm/move")
        self.create_timer(1.5, self.next_task)
        self.hear("/arm/halt", self.on_halt, 1)

    def on_halt(self, _) -> None:
        """Wait with the next task."""

    def next_task(self) -> None:
        """Send a goal, and ask for its result when it is accepted."""
        if self.client.server_is_ready():
            sent = self.client.send_goal_async(Fibonacci.Goal(order=4))
            sent.add_done_callback(lambda future: future.result().get_result_async())


class Monitor(Part):
    """Takes 9 ms each 40 ms."""

    def __init__(self, number: int) -> None:
        super().__init__(f"monitor_{number}", is_silent=True)
        self.create_timer(0.04, self.check_limits)

    def check_limits(self) -> None:
        """Compute."""
        compute(9)


def arm() -> list[Part]:
    """Return the nodes of one thread, with more than it has time for if that is planted."""
    return [ArmControl(), ArmDrive(), *map(Monitor, range(5 if "over" in PROBLEMS else 0))]


PROCESSES = {
    "joints": lambda: [JointDriver()],
    "lidar": lambda: [Lidar()],
    "fusion": lambda: [Fusion()],
    "safety": lambda: [Safety()],
    "arm": arm,
    "action": lambda: [ArmAction()],
    "tasks": lambda: [TaskManager()],
}

if __name__ == "__main__":
    run(PROCESSES, several_threads={"fusion"} if "lock" in PROBLEMS else ())
