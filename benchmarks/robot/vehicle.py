"""One process of the vehicle: twelve nodes in nine processes.

    python vehicle.py PROCESS [PROBLEM]…

    front_lidar ─/front/points→ merger ─/cloud→ tracker ─/tracks→ behavior ─/intent→ maneuver
    rear_lidar ─/rear/points→ merger        maneuver ─/target→ pilot ─/steering→ wheels

A thread of the rear lidar publishes. The merger keeps what comes from behind, under a lock that
both its callback groups need. The behavior awaits an answer of the router. The mission sends goals
of the action /park to the maneuver. The watchdog hears /tracks, /speed of the wheels, and
heartbeats.
"""

from __future__ import annotations

import gc
import threading
import time

from parts import PROBLEMS, Part, compute, compute_for_ever, heap, in_background, run, write_to_disk
from rclpy.action import ActionClient, ActionServer
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from test_msgs.action import Fibonacci
from test_msgs.srv import BasicTypes


class FrontLidar(Part):
    """A cloud each 70 ms."""

    def __init__(self) -> None:
        super().__init__("front_lidar")
        self.send = self.out_frame("/front/points", 12_000)
        self.create_timer(0.07, self.poll_device)

    def poll_device(self) -> None:
        """Publish a cloud."""
        compute(0.5)
        self.send()


class RearLidar(Part):
    """A cloud each 90 ms of a thread without callbacks, or 16 at once."""

    def __init__(self) -> None:
        super().__init__("rear_lidar")
        self.send = self.out_frame("/rear/points", 6_000)
        in_background(self.read_socket)

    def read_socket(self) -> None:
        """Publish clouds for ever."""
        count = 16 if "burst" in PROBLEMS else 1
        while True:
            time.sleep(0.09 * count)
            for _ in range(count):
                self.send()


class Merger(Part):
    """A cloud of both lidars for each one of the front."""

    def __init__(self) -> None:
        super().__init__("merger")
        self.behind = None
        self.lock = threading.Lock()
        self.send = self.out_frame("/cloud", 18_000, is_reliable="qos" not in PROBLEMS)
        self.hear_frame("/front/points", self.on_front, group=MutuallyExclusiveCallbackGroup())
        self.hear_frame("/rear/points", self.on_rear, group=MutuallyExclusiveCallbackGroup())

    def on_rear(self, message) -> None:
        """Keep a cloud."""
        with self.lock:
            compute(1)
            if "lock" in PROBLEMS:
                time.sleep(0.055)
            self.behind = message

    def on_front(self, _) -> None:
        """Merge."""
        with self.lock:
            compute(2)
        self.send()


class Tracker(Part):
    """Tracks of what moves in each cloud."""

    def __init__(self) -> None:
        super().__init__("tracker")
        self.send = self.out("/tracks")
        self.hear_frame("/cloud", self.on_cloud)
        self.past = heap(300_000) if "gc" in PROBLEMS else []
        if "gil" in PROBLEMS:
            # One makes it late by 10 ms, which harms none of its paths.
            in_background(compute_for_ever)
            in_background(compute_for_ever)

    def reassociate(self) -> None:
        """Begin anew with all tracks."""
        compute(130)

    def on_cloud(self, _) -> None:
        """Publish the tracks."""
        compute(80 if "queue" in PROBLEMS else 6)
        self.calls += 1
        if self.calls % 7 == 0 and "sometimes" in PROBLEMS:
            self.reassociate()
        if self.calls % 30 == 0 and "gc" in PROBLEMS:
            gc.collect()
        self.send()


class Router(Part):
    """Answers."""

    def __init__(self) -> None:
        super().__init__("router")
        self.create_service(BasicTypes, "/route", self.on_route)

    def on_route(self, _, response: BasicTypes.Response) -> BasicTypes.Response:
        """Find the next turn."""
        compute(0.5)
        if self.is_each(4) and "service" in PROBLEMS:
            time.sleep(0.28)
        return response


class Behavior(Part):
    """An intent for each third of the tracks, with an answer of the router."""

    def __init__(self) -> None:
        super().__init__("behavior")
        self.send = self.out("/intent")
        self.router = self.create_client(
            BasicTypes, "/route", callback_group=ReentrantCallbackGroup()
        )
        self.hear("/tracks", self.on_tracks, group=MutuallyExclusiveCallbackGroup())

    async def on_tracks(self, _) -> None:
        """Decide."""
        if not self.is_each(3):
            return
        if self.router.service_is_ready():
            await self.router.call_async(BasicTypes.Request())
        compute(1)
        self.send()


class Maneuver(Part):
    """A target for each intent, and an action, on one thread."""

    def __init__(self) -> None:
        super().__init__("maneuver")
        self.send = self.out("/target")
        self.server = ActionServer(self, Fibonacci, "/park", self.execute_park)
        self.hear("/intent", self.on_intent)

    def on_intent(self, _) -> None:
        """Aim."""
        compute(1)
        self.send()

    def execute_park(self, goal) -> Fibonacci.Result:
        """Park in three moves."""
        for move in range(3):
            if "action" in PROBLEMS:
                time.sleep(0.18)
            goal.publish_feedback(Fibonacci.Feedback(sequence=[move]))
        goal.succeed()
        return Fibonacci.Result(sequence=[3])


class Mission(Part):
    """Sends a goal each 2.2 s."""

    def __init__(self) -> None:
        super().__init__("mission")
        self.client = ActionClient(self, Fibonacci, "/park")
        self.create_timer(2.2, self.send_goal)

    def send_goal(self) -> None:
        """Send a goal, and ask for its result when it is accepted."""
        if self.client.server_is_ready():
            sent = self.client.send_goal_async(Fibonacci.Goal(order=3))
            sent.add_done_callback(lambda future: future.result().get_result_async())


class Pilot(Part):
    """A command each 30 ms."""

    def __init__(self) -> None:
        super().__init__("pilot")
        self.target = None
        self.send = self.out("/steering")
        self.hear("/target", self.on_target)
        self.create_timer(0.6 if "timer" in PROBLEMS else 0.03, self.steer)

    def on_target(self, message) -> None:
        """Keep the target."""
        self.target = message

    def steer(self) -> None:
        """Steer to the target."""
        if self.target is not None:
            compute(0.4)
            self.send()


class Wheels(Part):
    """The end of the way, and how fast it goes each 25 ms."""

    def __init__(self) -> None:
        super().__init__("wheels")
        self.send = self.out("/speed")
        self.hear("/steering", self.on_steering)
        self.create_timer(0.025, self.measure)

    def on_steering(self, _) -> None:
        """Turn."""
        compute(0.2)
        if self.is_each(4) and "disk" in PROBLEMS:
            write_to_disk("wheels.log")

    def measure(self) -> None:
        """Publish the speed."""
        self.send()


class Watchdog(Part):
    """Looks after the others."""

    def __init__(self) -> None:
        super().__init__("watchdog", is_silent=True)
        self.send = self.out("/alarm")
        self.hear("/tracks", self.on_tracks)
        self.hear("/speed", self.on_speed, 1 if "depth1" in PROBLEMS else 10)
        self.hear_health(self.on_diagnostics)

    def on_tracks(self, _) -> None:
        """Look how near others are."""
        compute(0.5)
        if "depth1" in PROBLEMS:
            time.sleep(0.05)
        self.send()

    def on_speed(self, _) -> None:
        """Look how fast it goes."""
        compute(0.2)

    def on_diagnostics(self, _) -> None:
        """Keep it."""


class Brake(Part):
    """Hears alarms."""

    def __init__(self) -> None:
        super().__init__("brake")
        self.hear("/alarm", self.on_alarm)

    def on_alarm(self, _) -> None:
        """Brake."""
        compute(0.1)


class Logger(Part):
    """Takes 13 ms each 45 ms."""

    def __init__(self, number: int) -> None:
        super().__init__(f"logger_{number}", is_silent=True)
        self.create_timer(0.045, self.compress)

    def compress(self) -> None:
        """Compute."""
        compute(13)


def driving() -> list[Part]:
    """Return the nodes of one thread, with more than it has time for if that is planted."""
    return [Pilot(), Wheels(), *map(Logger, range(4 if "over" in PROBLEMS else 0))]


PROCESSES = {
    "front": lambda: [FrontLidar()],
    "rear": lambda: [RearLidar()],
    "merger": lambda: [Merger()],
    "tracker": lambda: [Tracker()],
    "router": lambda: [Router()],
    "behavior": lambda: [Behavior()],
    "maneuver": lambda: [Maneuver(), Mission()],
    "driving": driving,
    "watchdog": lambda: [Watchdog(), Brake()],
}

if __name__ == "__main__":
    run(PROCESSES, several_threads={"merger"} if "lock" in PROBLEMS else ())
