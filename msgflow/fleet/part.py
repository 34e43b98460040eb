"""Parts of a lake: the files of one run, which become visible with its commit.

Each time when a run is written, its part has a new name: what another writer wrote, at the same
time or before, stays as it is.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa
import pyarrow.parquet

from msgflow.db.connection import recorded_revision
from msgflow.errors import TraceError
from msgflow.fleet.file_store import Store
from msgflow.fleet.layout import database_path, metadata, new_part, part_path
from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow.run.slice import Slice
from msgflow.sql.statement import internal_sql
from msgflow.version import __version__

KEY, PART = "run", "part"
ROWS_AT_ONCE = 100_000
_RUN_ID = "run_id"
# Those of statements of the program; buckets of a distribution can be added up.
_OWN = ("flow", "distribution")
_FINDING = "finding"
ANSWERS = (
    *_OWN, _FINDING, "e2e_latency", "callbacks", "waits", "executor_usage", "topics_latency",
    "topics_delivery", "topics_rate", "timers", "service_latency", "action_latency", "info_quality",
)  # fmt: skip
"""The tables, as they are computed; others have the rows of the named query of that name."""


def run_key(connection: duckdb.DuckDBPyConnection, run_id: int) -> str:
    """Return the key of a run: equal for equal packets, whatever their paths."""
    ((key,),) = internal_sql().run(connection, "run_identity", {"runs": [run_id]}).fetchall()
    if key is None:
        raise TraceError("the recording has no packets by which it could be known", None)
    return str(key)


def write_part(
    connection: duckdb.DuckDBPyConnection,
    file: Path,
    store: Store,
    scratch: Path,
    *,
    database: bool = True,
) -> dict[str, Any]:
    """Write all files of the only run of a database, and return its row as far as that knows it.

    `database` says whether the file of the database itself is one of them.
    """
    ((run_id, name, start_ns, end_ns, event_count),) = connection.execute(
        "SELECT run_id, name, start_ns, end_ns, event_count FROM main.run"
    ).fetchall()
    key = run_key(connection, run_id)
    part = new_part(key)
    revision = recorded_revision(connection.cursor()) or ""
    first = {KEY: key, PART: part}
    table, compressed = scratch / "table.parquet", scratch / "compressed"
    for each in ANSWERS:
        rows = _answer(connection, run_id, each).to_reader(ROWS_AT_ONCE)
        write_rows(table, each, rows, first, revision)
        store.put(part_path(each, part), table)
    if database:
        with file.open("rb") as source, pa.CompressedOutputStream(str(compressed), "zstd") as sink:
            shutil.copyfileobj(source, sink, 1 << 20)
        store.put(database_path(part), compressed)
    return {
        KEY: key,
        PART: part,
        "database_part": part if database else None,
        "name": name,
        "start_ns": start_ns,
        "end_ns": end_ns,
        "event_count": event_count,
        "msgflow_version": __version__,
        "schema_revision": revision,
    }


def _answer(con: duckdb.DuckDBPyConnection, run_id: int, table: str) -> pa.Table:
    """Return the rows of a run, with `run_id`, in a fixed order."""
    if table in _OWN:
        return internal_sql().run(con, f"fleet_{table}", {"runs": [run_id]}).to_arrow_table()
    if table == _FINDING:
        statement = "FROM main.finding WHERE run_id = $run_id ORDER BY ALL"
        return con.sql(statement, params={"run_id": run_id}).to_arrow_table()
    query = load_query(table.replace("_", "-"))
    return run_query(con, query, {}, Slice(run_id), internal=True).to_arrow()


def write_rows(
    file: Path, table: str, rows: pa.RecordBatchReader, first: Mapping[str, str], revision: str
) -> None:
    """Write rows of a run into a file, behind columns with the same value in each of them."""
    same = [pa.field(name, pa.string()) for name in first]
    own = [field for field in rows.schema if field.name != _RUN_ID]
    schema = pa.schema([*same, *own], metadata=metadata(table, revision))
    with pyarrow.parquet.ParquetWriter(file, schema, compression="zstd") as writer:
        for batch in rows:
            values = [pa.repeat(pa.scalar(value), len(batch)) for value in first.values()]
            columns = [*values, *(batch[field.name] for field in own)]
            writer.write_batch(pa.record_batch(columns, schema=schema))
