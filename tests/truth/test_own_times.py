"""Times in the views are those of the trace, where each process has an offset of its own."""

from __future__ import annotations

from collections.abc import Iterator

import duckdb
import pytest
from support.ingested import Ingested

from msgflow.ingest import ingest
from msgflow_sim import Buffers, Recording, simulate

TIMES = {
    "publication": (
        "rmw_ns",
        "SELECT p.pid, b.rmw_ns FROM publication AS b JOIN process AS p USING (process_id)",
    ),
    "callback_instance": (
        "start_ns",
        "SELECT p.pid, i.start_ns FROM callback_instance AS i "
        "JOIN callback AS c USING (callback_id) JOIN process AS p ON c.process_id = p.process_id",
    ),
}


@pytest.fixture(scope="module")
def per_process(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ingested]:
    directory = tmp_path_factory.mktemp("per_process")
    done = simulate(
        "pipeline",
        directory / "traces",
        factor=0.05,
        recording=Recording(buffers=Buffers.PER_PROCESS, clock_error_ns=40),
    )
    path = directory / "msgflow.duckdb"
    ingest([done.directory], path)
    with duckdb.connect(str(path)) as connection:
        for table, file in done.truth.items():
            connection.execute(f"CREATE TEMP VIEW truth_{table} AS FROM '{file}'")
        yield Ingested(connection, path)


@pytest.mark.thorough
@pytest.mark.parametrize("table", TIMES)
def test_each_process_keeps_its_own_offset(per_process: Ingested, table: str) -> None:
    column, actual = TIMES[table]
    expected = (
        f"SELECT h.pid, h.{column} + t.clock_error_ns FROM truth_{table} AS h "
        "JOIN truth_trace AS t ON h.host = t.host AND h.pid = t.pid"
    )
    assert per_process.rows("SELECT count(DISTINCT clock_error_ns) FROM truth_trace") == [(3,)]
    assert per_process.rows(f"SELECT count(*) > 100 FROM ({actual})") == [(True,)]
    assert per_process.differences(expected, actual) == ([], [])
