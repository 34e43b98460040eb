"""Loading: implausible values are left out, and errors of both threads come through."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from support.reading_threads import reading_threads

from msgflow.errors import UsageError
from msgflow.ingest import ingest
from msgflow.ingest.ingest import IngestProgress
from msgflow.ingest.load import plausible
from msgflow.trace.numpy_arrow import to_arrow

LATEST = (1 << 62) - 1


def test_times() -> None:
    """Of what is out of range, NULL is no matter, whatever stands in its place."""
    values = [LATEST, -LATEST, LATEST + 1, -LATEST - 1, -LATEST - 1, 0]
    is_missing = np.array([False, False, False, False, True, False])
    times = to_arrow(np.array(values), is_missing)
    batch = pa.RecordBatch.from_arrays([times, times], names=["timestamp", "handle"])
    found = Counter[tuple[str, str, str]]()
    assert plausible("ros2:rclcpp_take", batch, found).to_pydict() == {
        "timestamp": [LATEST, -LATEST, None, None, None, 0],
        "handle": times.to_pylist(),
    }
    plausible("ros2:rclcpp_take", batch.slice(2, 1), found)
    assert found == {("ros2:rclcpp_take", "timestamp", "times"): 3}


def test_names_and_symbols() -> None:
    names = ["é" * 512, "é" * 512 + "x", None]
    symbols = ["x" * (1 << 16), "x" * (1 + (1 << 16)), ""]
    batch = pa.RecordBatch.from_pydict({"topic_name": names, "symbol": symbols})
    found = Counter[tuple[str, str, str]]()
    assert plausible("some", batch, found).to_pydict() == {
        "topic_name": [names[0], None, None],
        "symbol": [symbols[0], None, ""],
    }
    what = "names: too long"
    assert found == {("some", "symbol", what): 1, ("some", "topic_name", what): 1}


def test_what_can_be_stays_as_it_is() -> None:
    values = to_arrow(np.array([LATEST + 1, 5]), np.array([True, False]))
    for batch in (
        pa.RecordBatch.from_arrays([values], names=["period"]),
        pa.RecordBatch.from_arrays([values.slice(2)], names=["period"]),
        pa.RecordBatch.from_arrays([pa.nulls(2, pa.string())], names=["topic_name"]),
    ):
        found = Counter[tuple[str, str, str]]()
        assert plausible("some", batch, found) is batch
        assert not found


def test_an_error_of_the_thread_that_reads_comes_through(trace: Path, new_database: Path) -> None:
    def fail(state: IngestProgress) -> None:
        if state.fraction is not None:
            raise ValueError("from the progress of the reader")

    with pytest.raises(ValueError, match="from the progress"):
        ingest([trace], new_database, progress=fail)
    assert reading_threads() == 0
    assert not new_database.exists()


def test_an_error_of_the_thread_that_inserts_ends_the_other(trace: Path, database: Path) -> None:
    with pytest.raises(UsageError, match="these packets are in the database already"):
        ingest([trace], database)
    assert reading_threads() == 0
