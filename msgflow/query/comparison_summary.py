"""Summary of a comparison: a row for each subject, the greatest change first."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING

import duckdb

from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    import pyarrow as pa

    from msgflow.result.query_result import QueryResult
    from msgflow.sql.header import Header

_NONE = "none shown"
_CHANGED = ("longer", "shorter", "both", "only in A", "only in B")


def changes(result: QueryResult, only_different: bool) -> QueryResult:
    """Return a row for each subject of a comparison."""
    every = _summed(result.table, only_different=False)
    table = _summed(result.table, only_different) if only_different else every
    notes, when_empty = list(result.notes), result.when_empty
    alike = Counter(every["change"].to_pylist())
    for change in _CHANGED:
        alike.pop(change, None)
    if only_different and alike:
        subjects = every.num_rows
        none = alike.pop(_NONE, 0)
        parts = [f"{none} with no difference shown"] if none else []
        parts += [f"{number} with {reason}" for reason, number in sorted(alike.items())]
        text = f"{subjects} compared, {', '.join(parts)}: --all lists them"
        if table.num_rows:
            notes.insert(0, text)
        else:
            names = " and ".join(run.name for run in result.runs)
            between = f" between {names}" if names else ""
            when_empty = f"no difference is shown{between}: {text}"
    return replace(result, table=table, header=_header(), notes=notes, when_empty=when_empty)


def _summed(compared: pa.Table, only_different: bool) -> pa.Table:
    with duckdb.connect() as con:
        con.register("compared", compared)
        found = internal_sql().run(con, "changes", {"only_different": only_different})
        return found.to_arrow_table()


def _header() -> Header:
    return replace(internal_sql().header("changes"), name="changes")
