"""Which event follows which on a thread: in recordings of real ROS 2, and in simulations."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pyarrow as pa
import pytest

from msgflow import trace
from msgflow.sim import simulate

Pair = tuple[str, str]

# Real recordings, and simulations of such systems.
REAL = ("real_pipeline", "real_services", "real_intra")
# With those that end while the recording goes on.
SIMULATED = {
    "services": 0.1,
    "calls": 0.1,
    "mixed_intra_process": 0.1,
    "demo": 0.1,
    "restarts": 0.6,
}
LAYOUT = "kilted"
# Objects are created in many orders, and most of them only once.
_AT_WORK = "NOT regexp_matches(name, '_(init|added|register|node|buffer|subscription|ipb)$')"
# What simulations do not show yet: nodes that use intra-process communication publish their
# parameter events that way, before further objects are announced.
NOT_SIMULATED = {
    ("rclcpp_ring_buffer_enqueue", "rmw_publish"),
    ("rclcpp_intra_publish", "rmw_publish"),
}


def pairs_of(path: Path) -> set[Pair]:
    """Return what follows what, without the begin and the end of threads."""
    with duckdb.connect() as con, trace.open([path]) as traces:
        con.execute("CREATE TABLE event (name VARCHAR, pid INT, tid INT, id BIGINT, taken INT)")
        for batch in traces.batches(None):
            if batch.name.startswith("ros2:"):
                rows = pa.Table.from_batches([batch.batch])
                con.register("rows", rows)
                taken = "taken" if "taken" in rows.column_names else "NULL"
                con.execute(
                    f"INSERT INTO event SELECT $1, vpid, vtid, event_id, {taken} FROM rows",
                    [batch.name.removeprefix("ros2:")],
                )
        found = con.execute(
            "SELECT DISTINCT before, after FROM ("
            "SELECT concat_ws(' ', name, taken) AS after, lag(after) OVER thread AS before "
            f"FROM event WHERE {_AT_WORK} WINDOW thread AS (PARTITION BY pid, tid ORDER BY id)"
            ") WHERE before IS NOT NULL"
        )
        return set(found.fetchall())


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> set[Pair]:
    directory = tmp_path_factory.mktemp("pairs")
    made = (
        simulate(name, directory / name, factor=factor, layout=LAYOUT).directory
        for name, factor in SIMULATED.items()
    )
    return set().union(*map(pairs_of, made))


@pytest.mark.parametrize("name", REAL)
def test_simulations_have_what_real_recordings_have(
    shared_traces: Path, simulated: set[Pair], name: str
) -> None:
    real = pairs_of(shared_traces / name / "ust")
    assert real - simulated <= NOT_SIMULATED
    assert len(real & simulated) > 5
