"""Initialisation events that CARET reports again when a recording starts late.

Such an event tells of an object that was initialised before the recording. Its own time is only
that of the report. It replaces the event that was not recorded: it comes before all recorded
events, in the order in which the objects were initialised. Events of Agnocast keep their name when
they are reported; that they have the time of initialisation shows it.
"""

from __future__ import annotations

from collections.abc import Collection

import duckdb

from msgflow.ingest.catalogue import Tracepoint, load

_AGAIN = "ros2_caret:"
_FIRST = "ros2:"
_UNDER_ITS_NAME = "agnocast:"

# Ids of events from before the recording: below all ids that readers give.
_BEFORE = -(1 << 61)

_LEADING = ("ts_ns", "trace_index", "cpu_id", "thread_index")


def restore(con: duckdb.DuckDBPyConnection, empty: Collection[str]) -> bool:
    """Add events that were reported again to `raw`, unless the originals were recorded too.

    It tells whether there were any.
    """
    known = load().tracepoints
    again = [each for each in _initialisations(_AGAIN) if _FIRST + each.event in known]
    pairs = [(each, known[_FIRST + each.event]) for each in again]
    pairs += [(each, each) for each in _initialisations(_UNDER_ITS_NAME)]
    if all(f"raw.{each.table}" in empty for each, _ in pairs):
        return False
    events = " UNION ALL ".join(
        f"SELECT event_id, init_timestamp FROM raw.{each.table}"
        + (" WHERE init_timestamp IS NOT NULL" if each is first else "")
        for each, first in pairs
    )
    con.execute(
        "CREATE TEMP TABLE reported AS SELECT event_id, "
        f"{_BEFORE} + row_number() OVER (ORDER BY init_timestamp NULLS FIRST, event_id) AS place "
        f"FROM ({events})"
    )
    for each, first in pairs:
        con.execute(_moved(each, first))
    con.execute("DROP TABLE reported")
    return True


def _initialisations(prefix: str) -> list[Tracepoint]:
    """Return the tracepoints that say when an object was initialised."""
    return [
        tracepoint
        for name, tracepoint in load().tracepoints.items()
        if name.startswith(prefix)
        and tracepoint.is_staged
        and any(field.name == "init_timestamp" for field in tracepoint.fields)
    ]


def _moved(again: Tracepoint, first: Tracepoint) -> str:
    """Return the SQL that puts events into the table of the first ones, each once in a process."""
    known = {field.name for field in first.fields}
    payload = [field.name for field in again.fields if field.name in known]
    columns = ", ".join(f'"{name}"' for name in ("event_id", *_LEADING, *payload))
    values = ", ".join(f'a."{name}"' for name in (*_LEADING, *payload))
    same = " AND ".join(f'a."{name}" IS NOT DISTINCT FROM o."{name}"' for name in payload)
    reported = ", ".join(f'e."{field.name}"' for field in again.fields)
    process = "p.trace_index AS host, p.pid_ns, p.vpid"
    return f"""
INSERT INTO raw.{first.table} ({columns})
SELECT r.place, {values}
FROM (
    SELECT e.*, {process}
    FROM raw.{again.table} AS e
    JOIN raw.thread AS p ON e.thread_index = p.thread_index
    QUALIFY row_number() OVER (
        PARTITION BY p.trace_index, p.pid_ns, p.vpid, {reported}
        ORDER BY e.event_id
    ) = 1
) AS a
JOIN reported AS r ON a.event_id = r.event_id
ANTI JOIN (
    SELECT e.*, {process}
    FROM raw.{first.table} AS e
    JOIN raw.thread AS p ON e.thread_index = p.thread_index
    ANTI JOIN reported AS r ON e.event_id = r.event_id
) AS o
    ON a.host = o.host AND a.pid_ns IS NOT DISTINCT FROM o.pid_ns AND a.vpid = o.vpid
    AND o.ts_ns <= a.ts_ns AND {same};
DELETE FROM raw.{first.table} WHERE event_id IN (SELECT event_id FROM reported)
"""
