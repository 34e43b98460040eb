"""The model is the same, however many calls were put together while they were read."""

from __future__ import annotations

from random import Random
from typing import Any

import numpy as np
import pytest
from analysis import Analyse
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from random_system import random_system
from ros_system import RosSystem
from staged_events import Thread
from thorough import examples

from msgflow.db.tables import STORE
from msgflow.ingest import whole
from msgflow.ingest.catalogue import load

# What belongs to a call as well, or lies between two layers of it.
DISTURBANCES = (
    "dds:read",
    "dds:write",
    "dds:write_pre",
    "ros2:callback_end",
    "ros2:callback_start",
    "ros2:dispatch_subscription_callback",
    "ros2:rcl_init",
    "ros2:rclcpp_executor_execute",
    "ros2:rclcpp_intra_publish",
    "ros2:rclcpp_publish",
    "ros2:rclcpp_ring_buffer_dequeue",
    "ros2:rmw_take",
    "ros2_caret:dds_bind_addr_to_stamp",
    "ros2_caret:dds_write",
)


def disturbed(seed: int) -> RosSystem:
    """Return a random system; some of its events are lost, some are of other kinds."""
    random = Random(seed)
    losses, others = random.choice([(0, 0), (0, 0.1), (0.04, 0), (0.04, 0.1)])
    whole_system = random_system(seed, actions=30)
    system = RosSystem()
    system.sources = dict(whole_system.sources)
    for name, row in whole_system.ordered():
        thread = Thread(
            row["vpid"], row["vtid"], row["procname"], row["cpu_id"], row["trace_index"]
        )
        if random.random() < losses:
            system.lose(cpu=thread.cpu, trace=thread.trace)
            continue
        if random.random() < others:
            other = random.choice(DISTURBANCES)
            known = {field.name: field.type for field in load().tracepoints[other].fields}
            values = {key: value for key, value in row.items() if key in known}
            for alias in ("buffer", "data"):
                if alias in known and row.get("message") is not None:
                    values[alias] = row["message"]
            system.add(other, thread, ts=row["ts_ns"] - 1, **values)
        system.add_row(name, row)
    return system


def model(analyse: Analyse, system: RosSystem) -> dict[str, list[Any]]:
    """Return all rows that are stored of a system."""
    analysis = analyse(system)
    assert analysis.connection
    return {
        table.name: analysis.rows(f"SELECT * FROM {table.fullname} ORDER BY ALL")
        for table in STORE.tables.values()
        if "run_id" in table.columns and table.name != "run"
    }


@settings(
    max_examples=examples(2, 60),
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(seed=st.integers(0, 10_000))
def test_no_matter_which_are_put_together(analyse: Analyse, seed: int) -> None:
    """All that can be, some of them, as when others are not in memory at once, or none."""
    found_by = whole._found
    system = disturbed(seed)
    random = np.random.default_rng(seed)
    models = []
    for share in (1.0, 0.5, 0.0):

        def found(*given: Any, share: float = share) -> Any:
            rows = found_by(*given)
            chosen = random.random(rows[0].size) < share
            return [each[chosen] for each in rows]

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(whole, "_found", found)
            models.append(model(analyse, system))
    for name, rows in models[0].items():
        assert rows == models[1][name] == models[2][name], name
