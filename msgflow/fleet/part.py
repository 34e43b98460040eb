"""Parts of a lake: the files of one run, which become visible with its commit.

The name of a part depends on the run and on all that its files depend on. A second writer, after a
crash or at the same time, writes the same bytes to the same paths.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import duckdb

from msgflow.errors import TraceError
from msgflow.fleet.answers import answers
from msgflow.fleet.layout import (
    LAKE_REVISION,
    RUN,
    database_path,
    metadata,
    part_path,
    view_path,
)
from msgflow.sql.statement import internal_sql
from msgflow.version import __version__

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    import pyarrow as pa

    from msgflow.fleet.file_store import Store

KEY = "run"
_ROWS_AT_ONCE = 100_000
_RUN_ID = "run_id"
# Public views that a lake does not hold: its own table `run` has the useful columns.
_LEFT_OUT = (RUN,)


@dataclass(frozen=True)
class Part:
    """The written files of a run.

    Attributes:
        values: columns of the table `run` that the database knows.
        file_count: number of files.
        size: their bytes.
    """

    values: Mapping[str, Any]
    file_count: int
    size: int


@dataclass(frozen=True)
class Content:
    """What to write besides the answers.

    Attributes:
        views: the public views.
        database: the database itself.
    """

    views: bool = True
    database: bool = True


def run_key(connection: duckdb.DuckDBPyConnection, run_id: int) -> str:
    """Return the key of a run: equal for equal packets, whatever their paths."""
    ((key,),) = internal_sql().run(connection, "run_identity", {"runs": [run_id]}).fetchall()
    if key is None:
        raise TraceError("the recording has no packets by which it could be known", None)
    return str(key)


def part_name(key: str, source: str, options: Mapping[str, Any]) -> str:
    """Return the name of the part of a run, with a hash of all that its files depend on."""
    import pyarrow as pa

    facts = [source, dict(options), __version__, LAKE_REVISION, pa.__version__, duckdb.__version__]
    digest = hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()
    return f"{key}-{digest[:10]}"


def write_part(
    connection: duckdb.DuckDBPyConnection,
    database: Path,
    store: Store,
    scratch: Path,
    *,
    source: str,
    options: Mapping[str, Any],
    content: Content,
) -> Part:
    """Write all files of the only run of a database; commit nothing."""
    from msgflow.db.connection import recorded_revision

    ((run_id, name, start_ns, end_ns, event_count),) = connection.execute(
        "SELECT run_id, name, start_ns, end_ns, event_count FROM main.run"
    ).fetchall()
    key = run_key(connection, run_id)
    part = part_name(key, source, options)
    revision = recorded_revision(connection.cursor()) or ""
    written = _Writer(store, scratch, key, revision)
    for answer in answers():
        rows = answer.read(connection, run_id).to_reader(_ROWS_AT_ONCE)
        written.table(answer.table, part_path(answer.table, part), rows)
    if content.views:
        for view in _views(connection):
            # A name of the catalogue: it needs no more than quotes.
            relation = connection.sql(f'SELECT * FROM main."{view}" ORDER BY ALL')
            rows = relation.to_arrow_reader(_ROWS_AT_ONCE)
            written.table(view, view_path(view, part), rows)
    if content.database:
        written.database(database, database_path(part))
    values = {
        KEY: key,
        "part": part,
        "view_part": part if content.views else None,
        "database_part": part if content.database else None,
        "is_removed": False,
        "name": name,
        "start_ns": start_ns,
        "end_ns": end_ns,
        "event_count": event_count,
        "msgflow_version": __version__,
        "schema_revision": revision,
    }
    return Part(values, written.file_count, written.size)


def _keyed(schema: pa.Schema) -> pa.Schema:
    """Return the columns of a table of the lake: the key of the run, in place of its id, first."""
    import pyarrow as pa

    rest = [field for field in schema if field.name != _RUN_ID]
    return pa.schema([pa.field(KEY, pa.string()), *rest])


def _views(connection: duckdb.DuckDBPyConnection) -> list[str]:
    found = connection.execute(
        "SELECT view_name FROM duckdb_views() WHERE database_name = current_database() "
        "AND schema_name = 'main' AND NOT internal ORDER BY view_name"
    ).fetchall()
    return [name for (name,) in found if name not in _LEFT_OUT]


class _Writer:
    """Writes files to the lake by way of the scratch directory, and counts them."""

    def __init__(self, store: Store, scratch: Path, key: str, revision: str) -> None:
        self._store = store
        self._scratch = scratch
        self._key = key
        self._revision = revision
        self.file_count = 0
        self.size = 0

    def table(self, name: str, path: str, rows: pa.RecordBatchReader) -> None:
        """Write the rows of a table."""
        import pyarrow as pa
        import pyarrow.parquet

        schema = _keyed(rows.schema).with_metadata(metadata(name, self._revision))
        file = self._scratch / "table.parquet"
        with pyarrow.parquet.ParquetWriter(file, schema, compression="zstd") as writer:
            for batch in rows:
                keys = pa.repeat(pa.scalar(self._key), len(batch))
                rest = [batch[name] for name in schema.names[1:]]
                writer.write_batch(pa.record_batch([keys, *rest], schema=schema))
        self._put(path, file)

    def database(self, database: Path, path: str) -> None:
        """Write the database, compressed."""
        import pyarrow as pa

        file = self._scratch / "compressed"
        with (
            database.open("rb") as source,
            pa.CompressedOutputStream(str(file), "zstd") as target,
        ):
            while chunk := source.read(1 << 20):
                target.write(chunk)
        self._put(path, file)

    def _put(self, path: str, file: Path) -> None:
        self.file_count += 1
        self.size += file.stat().st_size
        self._store.put(path, file)
        file.unlink()
