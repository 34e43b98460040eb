"""One process of the smallest robot: three nodes in three processes.

    python worker.py PROCESS [PROBLEM]…

    sensor ─/scan→ worker ─/result→ sink

The worker computes 20 ms for each scan, sleeps, waits for a lock that another callback holds, or
writes to the disk. `c_worker.c` is the same with the events of rclcpp.

Each callback notes when it began, by CLOCK_MONOTONIC, and the CPU time of its thread until it
ended: its function and both [ns] are a line of the file truth.tsv here. Another thread writes it.
Of `c_worker.c`, the line says also how often the thread waited meanwhile.
"""

from __future__ import annotations

import functools
import os
import threading
import time
from collections import deque

from parts import PROBLEMS, Part, compute, in_background, run
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup

_WORK_MS = 20
_calls = deque()


def measured(method):
    """Note when a callback begins, and its CPU time."""

    @functools.wraps(method)
    def callback(*arguments) -> None:
        begin_ns, cpu_ns = time.monotonic_ns(), _cpu_ns()
        method(*arguments)
        cpu_ns = _cpu_ns() - cpu_ns
        _calls.append((method.__name__, begin_ns, cpu_ns))

    return callback


def write_down() -> None:
    """Write what callbacks noted, twice a second."""
    with open("truth.tsv", "ab", buffering=0) as file:
        while True:
            time.sleep(0.5)
            noted = [_calls.popleft() for _ in range(len(_calls))]
            file.write("".join(f"{name}\t{at}\t{cpu}\n" for name, at, cpu in noted).encode())


def _cpu_ns() -> int:
    return time.clock_gettime_ns(time.CLOCK_THREAD_CPUTIME_ID)


def write_to_disk(milliseconds: float) -> None:
    """Write for so long, each part onto the disk."""
    end = time.monotonic() + milliseconds / 1e3
    part = bytes(1 << 18)
    with open("written", "wb", buffering=0) as file:
        while time.monotonic() < end:
            file.write(part)
            os.fsync(file.fileno())


class Sensor(Part):
    """Ten scans a second, and an image shortly before each of them for the lock."""

    def __init__(self) -> None:
        super().__init__("sensor", is_silent=True)
        self.send_image = self.out("/image")
        self.send = self.out("/scan")
        self.create_timer(0.1, self.tick)

    @measured
    def tick(self) -> None:
        """Publish."""
        if "lock" in PROBLEMS:
            self.send_image()
            time.sleep(0.005)
        self.send()


class Worker(Part):
    """A result for each scan."""

    def __init__(self) -> None:
        super().__init__("worker", is_silent=True)
        self.lock = threading.Lock()
        self.send = self.out("/result")
        self.hear("/image", self.on_image, group=MutuallyExclusiveCallbackGroup())
        self.hear("/scan", self.on_scan, group=MutuallyExclusiveCallbackGroup())

    @measured
    def on_image(self, _) -> None:
        """Keep the lock."""
        with self.lock:
            time.sleep((_WORK_MS + 8) / 1e3)

    @measured
    def on_scan(self, _) -> None:
        """Work."""
        if "sleeps" in PROBLEMS:
            time.sleep(_WORK_MS / 1e3)
        elif "lock" in PROBLEMS:
            with self.lock:
                pass
        elif "disk" in PROBLEMS:
            write_to_disk(_WORK_MS)
        else:
            compute(_WORK_MS if PROBLEMS else 1)
        self.send()


class Sink(Part):
    """The end of the way."""

    def __init__(self) -> None:
        super().__init__("sink", is_silent=True)
        self.hear("/result", self.on_result)

    @measured
    def on_result(self, _) -> None:
        """Use it."""
        compute(0.2)


PROCESSES = {"sensor": lambda: [Sensor()], "worker": lambda: [Worker()], "sink": lambda: [Sink()]}

if __name__ == "__main__":
    in_background(write_down)
    run(PROCESSES, several_threads={"worker"} if "lock" in PROBLEMS else ())
