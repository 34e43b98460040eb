"""Notes: what the rows of a query or a comparison do not show, a sentence each."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from msgflow.query.selection import KINDS
from msgflow.run.window import format_epoch
from msgflow.sql.statement import internal_sql, registered
from msgflow.text.values import ARROW, format_duration

if TYPE_CHECKING:
    import duckdb

    from msgflow.query.selection import Selection
    from msgflow.result.query_result import QueryResult
    from msgflow.run.choice import Run
    from msgflow.run.window import Window
    from msgflow.sql.value import Value

# Notes of headers: a query with one of these has no rows where that was not recorded.
_SOURCES = ("requests", "goals", "kernel", "samples", "usage")
# How many values of a row pass such a link, or whether its flow does.
AMBIGUOUS = "ambiguous"
_MARKS = (AMBIGUOUS, "is_ambiguous")
# What has the nodes: a path, or in a verification what was measured.
_WAYS = ("path", "subject")
_MOST = 3
_SAMPLED = "SELECT count(DISTINCT run_id) FROM main.stack_sample WHERE run_id IN ($run_a, $run_b)"
_ASKED = ("run_a", "run_b", "skip_first", "a_window", "b_window")
_PARTS = {
    "running_ns": "CPU time",
    "queue_ns": "waiting for a CPU",
    "blocked_ns": "sleeping or blocked",
}


def outside(runs: Sequence[Run], window: Window) -> list[str]:
    """Return a note if the runs have nothing in the time window."""
    seen = [
        (run.start_ns, run.end_ns)
        for run in runs
        if run.start_ns is not None and run.end_ns is not None
    ]
    if any(first < window.end_ns and last >= window.start_ns for first, last in seen):
        return []
    if len(runs) > 1:
        return ["none of the runs has anything in this time window"]
    nothing = "the run has nothing in this time window"
    if not seen:
        return [nothing]
    ((first, last),) = seen
    return [f"{nothing}: it lasts {format_duration(last - first)}, from {format_epoch(first)}"]


def empty_notes(
    connection: duckdb.DuckDBPyConnection,
    runs: Sequence[Run],
    note: str | None,
    parameters: Mapping[str, Value],
    selection: Selection,
) -> list[str]:
    """Return why a query whose header has this note has no rows."""
    unrecorded = _unrecorded(connection, runs, note) if note in _SOURCES else []
    narrowing = _narrowing(parameters, selection)
    if unrecorded or not narrowing:
        return unrecorded
    why = _missing_way(connection, runs, parameters) or "try with less"
    return [f"nothing fits {' '.join(narrowing)}: {why}"]


def row_notes(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], note: str | None, table: pa.Table
) -> list[str]:
    """Return what the rows of a query whose header has this note do not show."""
    notes = doubt_notes(connection, runs, table)
    if note in {"clocks", "requests", "samples"} and table.num_rows:
        notes += clock_notes(connection, runs)
        notes += _untraced_notes(connection, runs, table)
    if note == "callbacks":
        notes += _unrecorded(connection, runs, note)
    return notes


def _unrecorded(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], note: str | None
) -> list[str]:
    chosen = {"runs": [run.run_id for run in runs], "note": note}
    return _sentences(connection, "unrecorded", chosen)


def _narrowing(parameters: Mapping[str, Value], selection: Selection) -> list[str]:
    """Return the options that leave rows out, as a user types them."""
    given: dict[str, Any] = {name: parameters.get(name) or () for name in ("from", "to")}
    given |= {name: getattr(selection, name) for name in (*KINDS, "via", "without")}
    given["where"] = (selection.where,) if selection.where else ()
    return [
        # It may come from a number, which is no longer known.
        "this path" if name == "via" and ARROW in each else f"--{name} {shlex.quote(each)}"
        for name, texts in given.items()
        for each in texts
    ]


def _missing_way(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], parameters: Mapping[str, Value]
) -> str | None:
    """Return why no path leads from one place to another, if both are given and none does."""
    places: dict[str, Any] = {name: parameters.get(name) for name in ("from", "to")}
    if not all(places.values()):
        return None
    chosen = {"runs": [run.run_id for run in runs], **places}
    found = internal_sql().run(connection, "missing_way", chosen).fetchall()
    return str(found[0][0]) if found else None


def clock_notes(connection: duckdb.DuckDBPyConnection, runs: Sequence[Run]) -> list[str]:
    """Return notes on how far times of several hosts can be compared, a sentence each."""
    chosen = {"runs": [run.run_id for run in runs]}
    # Most runs have one clock and need no note: this first statement takes no time.
    several = connection.execute(
        "SELECT 1 FROM main.clock WHERE list_contains($runs, run_id) "
        "GROUP BY run_id HAVING count(*) > 1 LIMIT 1",
        chosen,
    )
    if not several.fetchall():
        return []
    return _sentences(connection, "clock_note", chosen)


def _untraced_notes(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], table: pa.Table
) -> list[str]:
    """Return where flows begin whose first publisher is not traced, if paths have any."""
    if "path" not in table.column_names:
        return []
    with registered(connection, noted=table.select(["path"])):
        return _sentences(connection, "untraced_note", {"runs": [run.run_id for run in runs]})


def clock_verdicts(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], *, only_several: bool = False
) -> list[str]:
    """Return a sentence per run, or per run with several clocks: whether times of hosts compare."""
    chosen = {"runs": [run.run_id for run in runs], "only_several": only_several}
    return _sentences(connection, "clock_verdict", chosen)


def _sentences(
    connection: duckdb.DuckDBPyConnection, name: str, chosen: Mapping[str, Any]
) -> list[str]:
    found = internal_sql().run(connection, name, chosen)
    return [sentence for (sentence,) in found.fetchall()]


def doubt_notes(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], table: pa.Table
) -> list[str]:
    """Return a sentence for each node at which flows of these rows pass a link that is in doubt."""
    mark, way = (
        next((name for name in names if name in table.column_names), None)
        for names in (_MARKS, _WAYS)
    )
    if mark is None or way is None:
        return []
    noted = pa.table({"way": table[way], "mark": table[mark].cast(pa.bool_())})
    # Most results need no note. To import Arrow's functions takes longer than to look at each.
    if not any(noted["mark"].to_pylist()):
        return []
    with registered(connection, noted=noted):
        return _sentences(connection, "doubt_note", {"runs": [run.run_id for run in runs]})


def schedule_notes(
    connection: duckdb.DuckDBPyConnection, asked: Mapping[str, Value], result: QueryResult
) -> Iterator[str]:
    """Yield a sentence for each of the callbacks that changed most, where the kernel was traced."""
    rows = result.table.select(["subject", "verdict"]).to_pylist()
    changed = {row["subject"] for row in rows if row["verdict"] in ("B is longer", "B is shorter")}
    if not changed:
        return
    given = {name: asked[name] for name in _ASKED}
    found = internal_sql().rows(connection, "callback_time", given | {"subjects": sorted(changed)})
    for row in islice(found, _MOST):
        yield f"{row['subject']}, on average {_change(row, 'duration_ns')}: {_parts(row)}"


def function_notes(
    connection: duckdb.DuckDBPyConnection, asked: Mapping[str, Value]
) -> Iterator[str]:
    """Yield a sentence for each function that changed most, where both runs have samples."""
    runs = {name: asked[name] for name in ("run_a", "run_b")}
    ((sampled,),) = connection.execute(_SAMPLED, runs).fetchall()
    if sampled < len({*runs.values()}):
        return
    given = {name: asked[name] for name in (*_ASKED, "at_least")}
    for row in islice(internal_sql().rows(connection, "changed_function", given), _MOST):
        a, b = (format_duration(row[name]) for name in ("a_ns", "b_ns"))
        yield (
            f"{row['node']} · {row['callback']}: CPU time per call in {row['function']} {a} → {b}"
            f" ({row['a_samples']:,} and {row['b_samples']:,} samples)"
        )


def _parts(row: Mapping[str, Any]) -> str:
    parts = sorted(_PARTS, key=lambda name: -abs(row[name]))
    return ", ".join(f"{_change(row, name)} {_PARTS[name]}" for name in parts if row[name])


def _change(row: Mapping[str, Any], name: str) -> str:
    value = row[name]
    return f"{format_duration(abs(value))} {'more' if value >= 0 else 'less'}"
