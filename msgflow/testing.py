"""Tests of how long messages take: what a test starts is recorded, read, and asked.

pytest_plugins = ["msgflow.testing"]          # in conftest.py

def test_the_robot_is_quick(msgflow_recorded):
    with msgflow_recorded() as database:
        subprocess.run(["ros2", "launch", "my_robot", "drive.launch.py"], timeout=30)
    assert database.e2e("/scan", "/cmd_vel").p99 < ms(80)
"""

from __future__ import annotations

import os
import shutil
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeAlias

import pytest

from msgflow.database import Database
from msgflow.record.daemon import session_daemon
from msgflow.record.program import with_python_nodes
from msgflow.record.session import Channel, recording_session

__all__ = ["Latency", "RecordedDatabase", "ms", "msgflow_recorded", "recorded"]


def ms(number: float) -> int:
    """Return milliseconds as the nanoseconds that results have."""
    return round(number * 1e6)


@dataclass(frozen=True)
class Latency:
    """How long messages took from one topic to another, by any path.

    Attributes:
        roots: messages that began.
        reached: those that arrived.
        lost: those that were lost, or dropped by a full queue.
        p50, p95, p99, max: latency of the first arrival of each [ns].
    """

    roots: int
    reached: int
    lost: int
    p50: int
    p95: int
    p99: int
    max: int


class RecordedDatabase(Database):
    """The database of a recording; it can be asked behind the block that was recorded."""

    def e2e(self, from_: str, to: str) -> Latency:
        """Return the latency from one topic or node to another.

        Where several nodes receive the last topic, of the one that is slowest.

        Raises:
            UsageError: the recording has no such topic or node.
            AssertionError: nothing arrived.
        """
        found = self.query("e2e-latency", by="ends", from_=from_, to=to).to_arrow().to_pylist()
        arrived = [row for row in found if row["pairs"]]
        if not arrived:
            raise AssertionError(f"nothing from {from_} arrived at {to}")
        row = max(arrived, key=lambda each: each["first_p99_ns"])
        return Latency(
            row["roots"], row["reached"], row["lost"] + row["dropped"], row["first_median_ns"],
            row["first_p95_ns"], row["first_p99_ns"], row["first_max_ns"],
        )  # fmt: skip


@contextmanager
def recorded(directory: str | Path, name: str = "test") -> Iterator[RecordedDatabase]:
    """Record what is started in the block, and read it behind it.

    Nodes are seen whole if they start in the block; those of rclpy too, if they are processes of
    their own. Sentences about what is wrong with the recording are warnings.

    Args:
        directory: for the trace and the database; it is made, and may have no recording yet.
        name: of the run.

    Yields:
        The database, which has the run behind the block.

    Raises:
        RecordingError: LTTng is missing or refuses.
        TraceError: nothing of ROS 2 happened in the block.
    """
    place = Path(directory).absolute()
    trace = place / "trace"
    trace.mkdir(parents=True)
    session = f"msgflow-test-{os.getpid()}-{time.monotonic_ns()}"
    database = RecordedDatabase(place / "msgflow.duckdb")
    with (
        session_daemon(with_kernel=False, note=warnings.warn),
        recording_session(session, trace, Channel()),
        pytest.MonkeyPatch.context() as patch,
    ):
        for variable, value in with_python_nodes(warnings.warn).items():
            patch.setenv(variable, value)
        yield database
    database.ingest(trace, name=name)


Recording: TypeAlias = Callable[[], AbstractContextManager[RecordedDatabase]]


@pytest.fixture
def msgflow_recorded(tmp_path: Path, request: pytest.FixtureRequest) -> Recording:
    """Records a block of the test, see `recorded`. Without LTTng the test is skipped."""
    missing = [word for word in ("lttng", "lttng-sessiond") if shutil.which(word) is None]
    if missing:
        pytest.skip(f"nothing can be recorded: {missing[0]} is not installed (lttng-tools)")
    return partial(recorded, tmp_path / "recorded", request.node.name)
