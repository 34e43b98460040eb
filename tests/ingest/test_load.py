"""Payload values that cannot be times or names are left out while traces are loaded."""

from __future__ import annotations

import numpy as np
import pyarrow as pa

from msgflow.ingest.load import ImplausibleValues
from msgflow.trace.numpy_arrow import to_arrow

LATEST = (1 << 62) - 1


def test_times() -> None:
    """Of what is out of range, NULL is no matter, whatever stands in its place."""
    values = [LATEST, -LATEST, LATEST + 1, -LATEST - 1, -LATEST - 1, 0]
    is_missing = np.array([False, False, False, False, True, False])
    times = to_arrow(np.array(values), is_missing)
    batch = pa.RecordBatch.from_arrays([times, times], names=["timestamp", "handle"])
    found = ImplausibleValues()
    assert found.without("ros2:rclcpp_take", batch).to_pydict() == {
        "timestamp": [LATEST, -LATEST, None, None, None, 0],
        "handle": times.to_pylist(),
    }
    found.without("ros2:rclcpp_take", batch.slice(2, 1))
    assert list(found.rows()) == [("ros2:rclcpp_take", "timestamp", "times", 3)]


def test_names_and_symbols() -> None:
    names = ["é" * 512, "é" * 512 + "x", None]
    symbols = ["x" * (1 << 16), "x" * (1 + (1 << 16)), ""]
    batch = pa.RecordBatch.from_pydict({"topic_name": names, "symbol": symbols})
    found = ImplausibleValues()
    assert found.without("some", batch).to_pydict() == {
        "topic_name": [names[0], None, None],
        "symbol": [symbols[0], None, ""],
    }
    what = "names: too long"
    assert list(found.rows()) == [("some", "symbol", what, 1), ("some", "topic_name", what, 1)]


def test_what_can_be_stays_as_it_is() -> None:
    values = to_arrow(np.array([LATEST + 1, 5]), np.array([True, False]))
    for batch in (
        pa.RecordBatch.from_arrays([values], names=["period"]),
        pa.RecordBatch.from_arrays([values.slice(2)], names=["period"]),
        pa.RecordBatch.from_arrays([pa.nulls(2, pa.string())], names=["topic_name"]),
    ):
        found = ImplausibleValues()
        assert found.without("some", batch) is batch
        assert list(found.rows()) == []
