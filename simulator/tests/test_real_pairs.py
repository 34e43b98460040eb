"""Which event follows which on a thread: in recordings of real ROS 2, and in simulations."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import duckdb
import pyarrow as pa
import pytest
from support.thorough import few

from msgflow import trace
from msgflow_sim import simulate

Pair = tuple[str, str]

# Real recordings and the layout of their release, and simulations of such systems.
REAL = {
    "real_pipeline": "kilted",
    "real_services": "kilted",
    "real_intra": "kilted",
    "real_container": "kilted",
    "real_overload": "kilted",
    "real_reference": "kilted",
    "real_filters": "kilted",
    "real_py_mixed": "kilted",
    "real_cache": "kilted",
    "real_late": "kilted",
    "real_rotate": "kilted",
    "real_lifecycle": "kilted",
    "real_jazzy_container": "jazzy",
    "real_jazzy_pipeline": "jazzy",
    "real_jazzy_services": "jazzy",
}
# With those that end while the recording goes on.
SIMULATED = {
    "services": 0.3,
    "calls": 0.1,
    "intra_process": 0.1,
    "mixed_intra_process": 0.1,
    "demo": 0.1,
    "restarts": 0.6,
    "python": 0.1,
}
# Objects are created in many orders, and most of them only once.
_AT_WORK = "NOT regexp_matches(name, '_(init|added|register|node|buffer|subscription|ipb)$')"
# A node that is configured creates objects, and its process announces them.
NOT_SIMULATED = {"real_lifecycle": {("rcl_lifecycle_transition", "rmw_publish")}}


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
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], set[Pair]]:
    """The pairs of all simulations in a layout."""

    @cache
    def pairs(layout: str) -> set[Pair]:
        directory = tmp_path_factory.mktemp(layout)
        made = (
            simulate(name, directory / name, factor=factor, layout=layout).directory
            for name, factor in SIMULATED.items()
        )
        return set().union(*map(pairs_of, made))

    return pairs


@pytest.mark.parametrize(
    ("name", "layout"),
    few(
        REAL.items(),
        ("real_lifecycle", REAL["real_lifecycle"]),
    ),
)
def test_simulations_have_what_real_recordings_have(
    shared_traces: Path, simulated: Callable[[str], set[Pair]], name: str, layout: str
) -> None:
    real = pairs_of(shared_traces / name / "ust")
    assert real - simulated(layout) == NOT_SIMULATED.get(name, set())
    assert len(real & simulated(layout)) > 5
