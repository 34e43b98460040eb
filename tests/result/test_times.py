"""Times of results as other programs read them."""

from __future__ import annotations

from pathlib import Path

import pyarrow as pa
import pytest

from msgflow.errors import UsageError
from msgflow.result.query_result import QueryResult
from msgflow.run.choice import Run
from msgflow.sql.header import parse

START = 1_741_944_413_000_000_000
HEADER = parse(
    "-- description: x\n-- column: run_id BIGINT  Run\n"
    "-- column: at_ns BIGINT [epoch ns]  When\n-- column: wait_ns BIGINT [ns]  How long\n"
    "-- column: end_ns BIGINT [epoch ns]  Until\n-- column: end_s VARCHAR  A name that is taken\n"
    "-- column: late BIGINT [ns]  Not named after its unit\n-- column: count BIGINT  n\nSELECT 1\n",
    Path("example.sql"),
)
TABLE = pa.table(
    {
        "run_id": [1, 2],
        "at_ns": [START + 1, START + 2_500_000_000],
        "wait_ns": pa.array([1_500_000, None], pa.int64()),
        "end_ns": pa.array([None, START], pa.int64()),
        "end_s": ["a", "b"],
        "late": [-20, 0],
        "count": [3, 4],
    }
)
RUNS = (Run(1, "one", START), Run(2, "two", START + 2_000_000_000))
RESULT = QueryResult(TABLE, HEADER, RUNS)


def test_nanoseconds_stay_as_they_are() -> None:
    assert RESULT.with_times("ns").table == TABLE


def test_seconds_count_from_the_epoch() -> None:
    rows = RESULT.with_times("seconds").table.to_pydict()
    assert list(rows) == ["run_id", "at_s", "wait_s", "end_ns", "end_s", "late", "count"]
    assert rows["at_s"] == pytest.approx([START / 1e9, START / 1e9 + 2.5], abs=3e-7)
    assert rows["wait_s"] == [0.0015, None]
    assert rows["late"] == [-2e-8, 0]
    assert rows["count"] == [3, 4]


def test_relative_times_count_from_the_start_of_the_run_of_the_row() -> None:
    rows = RESULT.with_times("relative").table.to_pydict()
    assert rows["at_s"] == [1e-9, 0.5]
    assert rows["end_ns"] == [None, -2.0]
    (one,) = RUNS[:1]
    alone = QueryResult(TABLE.select(["at_ns"]), HEADER, (one,)).with_times("relative")
    assert alone.table.to_pydict() == {"at_s": [1e-9, 2.5]}
    with pytest.raises(UsageError, match="which run"):
        QueryResult(TABLE.select(["at_ns"]), HEADER, RUNS).with_times("relative")


def test_iso_times_have_every_nanosecond() -> None:
    rows = RESULT.with_times("iso").table.to_pydict()
    assert rows["at_utc"] == ["2025-03-14T09:26:53.000000001Z", "2025-03-14T09:26:55.500000000Z"]
    assert rows["end_utc"] == [None, "2025-03-14T09:26:53.000000000Z"]
    assert rows["wait_s"] == [0.0015, None]


def test_what_cannot_be_converted_is_said() -> None:
    with pytest.raises(UsageError, match="no such times"):
        RESULT.with_times("minutes")
    with pytest.raises(UsageError, match="plain SQL"):
        QueryResult(TABLE).with_times("iso")


def test_simulated_times_run_evenly_between_known_moments() -> None:
    """And as fast as beside them before the first and after the last."""
    moments = ((START, 10**9), (START + 2 * 10**9, 2 * 10**9), (START + 3 * 10**9, 5 * 10**9))
    run = Run(1, "one", START, simulated=moments)
    times = [START - 10**9, START + 10**9, START + 2_500_000_000, START + 4 * 10**9, None]
    table = pa.table({"at_ns": pa.array(times, pa.int64())})
    rows = QueryResult(table, HEADER, (run,)).with_times("sim").table.to_pydict()
    assert rows == {"at_s": [0.5, 1.5, 3.5, 8.0, None]}
    with pytest.raises(UsageError, match="nothing tells the simulated time"):
        QueryResult(table, HEADER, RUNS[:1]).with_times("sim")
    with pytest.raises(UsageError, match="that of one run"):
        RESULT.with_times("sim")
