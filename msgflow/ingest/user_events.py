"""Events of the user's own programs: patterns of their names, and rows with fields as JSON."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterator, Mapping, Sequence

import duckdb
import pyarrow as pa

from msgflow.ingest.catalogue import load
from msgflow.sql.json_fields import column_name, json_fields
from msgflow.sql.statement import registered
from msgflow.trace import TraceInfo
from msgflow.trace.columns import COMMON_SCHEMA

_SCHEMA = pa.schema([*COMMON_SCHEMA, ("name", pa.string()), ("fields", pa.string())])


def is_match(name: str, patterns: Sequence[str]) -> bool:
    """Tell whether a name of events matches one of the patterns, such as 'dds:*'."""
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def matches(
    patterns: Sequence[str], counts: Mapping[tuple[int, str], int]
) -> Iterator[tuple[int, str, str | None]]:
    """Yield (place, pattern, event) for each event that a pattern matches, else with None."""
    occurred = sorted({name for (_, name), count in counts.items() if count})
    for place, pattern in enumerate(dict.fromkeys(patterns)):
        found = [name for name in occurred if is_match(name, [pattern])]
        yield from ((place, pattern, name) for name in found or (None,))


def names_of(patterns: Sequence[str], traces: Sequence[TraceInfo]) -> frozenset[str]:
    """Return the names of events to load, of those that the traces declare.

    They match a pattern, msgflow does not read them in any case, and their traces say of each
    event which process and thread it comes from (the kernel's do not).
    """
    known = load().in_traces
    return frozenset(
        name
        for trace in traces
        if trace.domain != "kernel" and trace.has_process_context
        for name in trace.event_names
        if name not in known and is_match(name, patterns)
    )


def user_rows(con: duckdb.DuckDBPyConnection, name: str, batch: pa.RecordBatch) -> pa.RecordBatch:
    """Return events with `COMMON_SCHEMA`, their name, and their fields as one column of JSON."""
    common = len(COMMON_SCHEMA)
    # By position: a field may have the name of a common column, or of another in upper case.
    payload = pa.schema(list(batch.schema)[common:])
    columns = [column_name(position) for position in range(len(payload))]
    if columns:
        rows = pa.RecordBatch.from_arrays(batch.columns[common:], names=columns)
        with registered(con, user_event_batch=rows):
            found = con.sql(f"SELECT CAST({json_fields(payload)} AS VARCHAR) FROM user_event_batch")
            fields = found.to_arrow_table().column(0).combine_chunks()
    else:
        fields = pa.repeat("{}", batch.num_rows)
    named = pa.repeat(name, batch.num_rows)
    return pa.RecordBatch.from_arrays([*batch.columns[:common], named, fields], schema=_SCHEMA)
