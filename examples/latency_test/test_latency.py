"""How long may images take? `pytest test_latency.py`, where ROS 2, LTTng and msgflow are."""

import shutil
import signal
import subprocess
from pathlib import Path

import pytest

from msgflow.testing import ms, msgflow_recorded

__all__ = ["msgflow_recorded"]

HERE = Path(__file__).parent


def require_quick(database):
    """Require what the robot has to do, of a recording of it."""
    latency = database.e2e("/image", "/detector")
    assert latency.reached >= 10
    assert latency.lost == 0
    assert ms(5) < latency.p50 < ms(1_000)


def test_of_processes(msgflow_recorded):
    """Any processes that the block starts are recorded."""
    with msgflow_recorded() as database:
        detector, camera = (
            subprocess.Popen(["python3", HERE / "robot.py", name])
            for name in ("detector", "camera")
        )
        detector.wait(60)
        camera.send_signal(signal.SIGINT)
        camera.wait(60)
    require_quick(database)


def test_of_a_launch_test(msgflow_recorded):
    """A launch test stays as it is: what it starts is recorded."""
    if shutil.which("launch_test") is None:
        pytest.skip("no launch_test: source /opt/ros/…/setup.sh")
    with msgflow_recorded() as database:
        subprocess.run(["launch_test", HERE / "launch_drive.py"], check=True)
    require_quick(database)
