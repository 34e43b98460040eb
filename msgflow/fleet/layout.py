"""The layout of a lake: paths of its files, columns of its tables of runs and failures, and rows.

Paths and names are an interface: users read them with DuckDB, Spark and others, see docs/fleet.md.
"""

from __future__ import annotations

import hashlib
import json
import re
import secrets

import pyarrow as pa
import pyarrow.parquet

from msgflow.errors import DatabaseError
from msgflow.version import __version__

LAKE_REVISION = 3
ABOUT = "lake.json"
RUN = "run"
FAILURE = "fleet_failure"
DATABASE = "database"
_FORMAT = "msgflow lake"
# A name without a part is one of a killed writer: it has a dot before it and .part behind.
_FILE = re.compile(
    r"(?:.+/)?(?:(?P<part>[0-9a-f]{20}-[0-9a-f]{10})\.(?:parquet|duckdb\.zst)"
    r"|\.[^/]+\.(?:parquet|zst)\.[^/]+\.part)"
)


def about() -> bytes:
    """Return the content of the file that marks a lake and names its revision."""
    text = json.dumps({"format": _FORMAT, "revision": LAKE_REVISION})
    return f"{text}\n".encode()


def require_readable(content: bytes, url: str) -> None:
    """Raise unless a lake has a revision that this msgflow reads."""
    try:
        read = json.loads(content)
        revision = read["revision"]
        is_ours = read["format"] == _FORMAT and isinstance(revision, int)
    except (ValueError, TypeError, KeyError, RecursionError):
        is_ours, revision = False, 0
    if not is_ours:
        raise DatabaseError(f"its {ABOUT} is not that of a lake — {url}", "give another --lake")
    if revision == LAKE_REVISION:
        return
    if revision > LAKE_REVISION:
        words, hint = "newer than this msgflow knows", "upgrade msgflow, or give another --lake"
    else:
        words = "older than this msgflow reads"
        hint = "ingest the recordings into a new lake: msgflow fleet ingest SOURCE --lake LAKE"
    raise DatabaseError(
        f"the lake has revision {revision}, {words} ({LAKE_REVISION}) — {url}", hint
    )


def new_part(run: str) -> str:
    """Return the name of a new part with the files of one run."""
    return f"{run}-{secrets.token_hex(5)}"


def run_path(key: str) -> str:
    """Return the path of the row of a run."""
    return f"{RUN}/{key}.parquet"


def failure_path(source: str) -> str:
    """Return the path of the failure of a recording."""
    return f"{FAILURE}/{hashlib.sha256(source.encode(errors='replace')).hexdigest()[:24]}.parquet"


def part_path(table: str, part: str) -> str:
    """Return the path of the rows of a table in a part."""
    return f"{table}/{part}.parquet"


def database_path(part: str) -> str:
    """Return the path of the database of one run, compressed with Zstandard."""
    return f"{DATABASE}/{part}.duckdb.zst"


def part_of(path: str) -> str | None:
    """Return the part of a file; '' if a writer was killed before it was whole; None: not ours."""
    found = _FILE.fullmatch(path)
    return found and (found["part"] or "")


def metadata(table: str, schema_revision: str) -> dict[str, str]:
    """Return the metadata of a Parquet file in a lake."""
    return {
        "msgflow.table": table,
        "msgflow.version": __version__,
        "msgflow.schema_revision": schema_revision,
        "msgflow.lake_revision": str(LAKE_REVISION),
    }


def read_parquet(content: bytes, schema: pa.Schema) -> pa.Table:
    """Return the rows of a Parquet file with these columns, without pandas."""
    # `read_table` would import pandas if that is installed.
    file = pyarrow.parquet.ParquetFile(pa.BufferReader(content))
    # Files have one row: threads would cost more than they save.
    table = file.read(use_threads=False).replace_schema_metadata()
    if table.schema.equals(schema):
        return pa.Table.from_arrays(table.columns, schema=schema)
    columns = [
        table[field.name].cast(field.type)
        if field.name in table.column_names
        else pa.nulls(len(table), field.type)
        for field in schema
    ]
    return pa.table(columns, schema=schema)


def _schema(*columns: tuple[str, pa.DataType, str]) -> pa.Schema:
    return pa.schema(
        [pa.field(name, kind, metadata={"description": text}) for name, kind, text in columns]
    )


RUN_SCHEMA = _schema(
    ("run", pa.string(), "Key of the run, made of the identity of its packets"),
    ("part", pa.string(), "Where its answers lie: TABLE/PART.parquet"),
    ("database_part", pa.string(), "Where its database lies: database/PART…; NULL: nowhere"),
    ("name", pa.string(), "Name of the run, from that of its source"),
    ("source", pa.string(), "Path or address that it was read from"),
    ("source_signature", pa.string(), "Names, sizes and times of the files there, as a hash"),
    ("labels", pa.map_(pa.string(), pa.string()), "What was said of it: robot, version, …"),
    ("start_ns", pa.int64(), "First event of any trace but kernel traces [epoch ns]"),
    ("end_ns", pa.int64(), "Last event of any trace but kernel traces [epoch ns]"),
    ("event_count", pa.int64(), "Events read"),
    ("source_bytes", pa.int64(), "Size of the source"),
    ("options", pa.string(), "Options of the ingest, as JSON"),
    ("msgflow_version", pa.string(), "Version of msgflow that read it"),
    ("schema_revision", pa.string(), "Revision of the tables and views"),
    ("lake_revision", pa.int32(), "Revision of the layout of the lake"),
    ("seconds", pa.float64(), "How long fetching, ingesting and writing took"),
    ("tries", pa.int32(), "How often it was tried"),
    ("worker", pa.string(), "Machine that did it"),
    ("committed_ns", pa.int64(), "When the run was put here [epoch ns]"),
)
"""The columns of the table `run`."""

FAILURE_SCHEMA = _schema(
    ("source", pa.string(), "Path or address of the recording"),
    ("source_signature", pa.string(), "Names, sizes and times of the files there, as a hash"),
    ("labels", pa.map_(pa.string(), pa.string()), "What was said of it"),
    ("reason", pa.string(), "What kind of failure, see docs/fleet.md"),
    ("stage", pa.string(), "What was being done"),
    ("error", pa.string(), "What went wrong, in words"),
    ("hint", pa.string(), "What to do about it; NULL: nothing is known"),
    ("tries", pa.int32(), "How often it was tried"),
    ("worker", pa.string(), "Machine of the last try"),
    ("msgflow_version", pa.string(), "Version of msgflow that tried"),
    ("failed_ns", pa.int64(), "When the last try failed [epoch ns]"),
)
"""The columns of the table `fleet_failure`."""
