"""What happened at a moment: what changed around it, what began and ran, which paths were slow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.query.catalogue import load_query
from msgflow.query.runner import Steps, run_query
from msgflow.result.query_result import QueryResult
from msgflow.run.window import time_point
from msgflow.sql.statement import internal_sql, registered

if TYPE_CHECKING:
    import duckdb

    from msgflow.run.choice import Run
    from msgflow.run.slice import Slice

_SECTIONS = {
    "changes": "moment_change",
    "occasions": "moment_occasion",
    "callbacks": "moment_callback",
    "programs": "moment_program",
    "paths": "moment_path",
}


@dataclass(frozen=True)
class Moment:
    """What happened at a moment.

    Attributes:
        run: what was read.
        headline: the change that holds then and that no other explains, in words.
        sections: `changes`: what changed around it, or before and holds then; `occasions`: what
            began or happened within a second; `callbacks` that took most of the second around it,
            and `programs`; `paths`: latencies then, and in all of the run.
        steps: commands that show more of the second, as words behind `msgflow`.
    """

    run: Run
    headline: str
    sections: dict[str, QueryResult]
    steps: tuple[tuple[str, ...], ...]


def explain_moment(
    connection: duckdb.DuckDBPyConnection,
    run: Run,
    times: Slice,
    at: str | int,
    place: str | None = None,
) -> Moment:
    """Return what happened at a moment of a run; of paths those that end at a place."""
    at_ns, begin_ns = time_point(at, (run,), "--at"), run.start_ns or 0
    window = times.window((run,))
    if not max(begin_ns, window.start_ns) <= at_ns <= min(run.end_ns or 0, window.end_ns):
        raise UsageError(f"the run has no such moment — {at}", "msgflow runs says how long it is")
    values = {"runs": [run.run_id], "at_ns": at_ns}
    with Steps(connection) as steps:
        changes = run_query(
            connection, load_query("changes"), {"to": place}, times, steps=steps, runs=(run,)
        )
        with registered(connection, change=changes.table):
            sections = {
                name: QueryResult(
                    internal_sql().run(connection, statement, values).to_arrow_table(),
                    internal_sql().header(statement),
                    (run,),
                )
                for name, statement in _SECTIONS.items()
            }
    said = sections["changes"].table["headline"].to_pylist()
    start, end = (f"{max((at_ns - begin_ns) / 1e9 + by, 0):g}s" for by in (-0.5, 0.5))
    return Moment(
        run=run,
        headline=said[0] if said else "nothing changed before it, nor within a second of it",
        sections=sections,
        steps=(("query", "critical-path", "--start", start, "--end", end),),
    )
