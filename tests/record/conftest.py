"""A robot of real ROS 2 nodes, and a session daemon, for tests that record with the real LTTng."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from recording.recorder import NotPossibleError, one_at_a_time, require, ros_environment
from recording.tracetools import build_tracetools
from support.lttng_program import Ended, Record, daemons, lttng

# `make` installs the wheels of ROS 2 there.
ROS = Path(sys.prefix) / "ros" / "bin" / "python"
NODE = """
import sys
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import UInt64

rclpy.init()
camera, detector = Node("camera"), Node("detector")
image = camera.create_publisher(UInt64, "/image", 10)
objects = detector.create_publisher(UInt64, "/objects", 10)
detector.create_subscription(UInt64, "/image", objects.publish, 10)
camera.create_timer(float(sys.argv[1]), lambda: image.publish(UInt64()))
executor = rclpy.executors.SingleThreadedExecutor()
executor.add_node(camera)
executor.add_node(detector)
try:
    executor.spin()
except (ExternalShutdownException, KeyboardInterrupt):
    pass
"""


@pytest.fixture
def record(tmp_path: Path) -> Record:
    """Runs the command in an empty directory, and sends it a signal after some seconds."""

    def run(*words: str, after: float | None = None, number: int = signal.SIGINT, **more) -> Ended:
        process = subprocess.Popen(
            [sys.executable, "-m", "msgflow", "record", *words],
            cwd=tmp_path,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            **more,
        )
        if after is not None:
            time.sleep(after)
            process.send_signal(number)
        try:
            out, err = process.communicate(timeout=120)
        finally:
            process.kill()
        return Ended(process.returncode, out, err)

    return run


@pytest.fixture(autouse=True)
def _alone() -> Iterator[None]:
    if shutil.which("lttng-sessiond") is None:
        pytest.skip("no LTTng")
    with one_at_a_time():
        yield
        assert daemons() == []


@pytest.fixture
def robot(tmp_path: Path) -> list[str]:
    """Start of a command: two nodes, which have tracepoints, of a period to name."""
    try:
        require(ROS)
    except NotPossibleError as error:
        pytest.skip(f"cannot record: {error}")
    (tmp_path / "library").mkdir()
    library = build_tracetools(tmp_path / "library")
    environment = ros_environment(ROS) | {"LD_PRELOAD": str(library)}
    changed = {name: value for name, value in environment.items() if value != os.environ.get(name)}
    return ["env", *(f"{name}={value}" for name, value in changed.items()), str(ROS), "-c", NODE]


@pytest.fixture
def daemon() -> Iterator[None]:
    """A session daemon that someone else started."""
    process = subprocess.Popen(["lttng-sessiond", "--no-kernel", "--quiet"])
    end = time.monotonic() + 20
    while lttng("list").returncode and time.monotonic() < end:
        time.sleep(0.1)
    yield
    process.terminate()
    process.wait()
