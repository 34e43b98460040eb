"""The story of a goal, or of a call of a service: what took longest, and who made it wait."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from msgflow.errors import UsageError
from msgflow.query.flow import Start, require_start
from msgflow.query.notes import clock_notes
from msgflow.query.runner import Steps
from msgflow.result.query_result import QueryResult
from msgflow.run.choice import choose_runs, read_runs
from msgflow.sql.statement import internal_sql
from msgflow.text.name_suggestions import meant_or
from msgflow.text.values import format_duration

if TYPE_CHECKING:
    import duckdb

    from msgflow.run.choice import Run

_LISTED = 'msgflow sql "SELECT goal_id, action_name, sent_ns, latency_ns FROM goal" lists all'
_SHOWN = 3


@dataclass(frozen=True)
class Story:
    """What became of a goal, or of a call of a service.

    Attributes:
        run: its run.
        verdict: a row: what it was, and how long it took (headline), what took longest, and who
            made it wait (evidence), and the command that shows more of that (next).
        steps: what happened, in order; stages follow each other, and their times add up.
        notes: a sentence each.
    """

    run: Run
    verdict: QueryResult
    steps: QueryResult
    notes: tuple[str, ...]

    @property
    def sections(self) -> dict[str, QueryResult]:
        """The results, by the names of the attributes."""
        return {"verdict": self.verdict, "steps": self.steps}


def goal_meant(
    connection: duckdb.DuckDBPyConnection, goal: str | int, run: str | int | None
) -> int:
    """Return the identity of the goal that somebody means by it, or by its first digits."""
    runs = choose_runs(read_runs(connection), "all" if run is None else run)
    values = {"runs": [each.run_id for each in runs], "goal": str(goal)}
    rows = list(internal_sql().rows(connection, "goal_meant", values))
    if not rows:
        # Before Kilted, what the servers published is all that is known.
        said = internal_sql().rows(connection, "unrecorded", values | {"note": "goals"})
        hint = "; ".join(row["sentence"] for row in said)
        raise UsageError(
            f"no goal is known — {goal}", hint or "msgflow query objects lists actions"
        )
    place = rows[0]["place"]
    near = [row for row in rows if row["place"] == place]
    if place == 0 or (place == 1 and len(near) == 1):
        return int(near[0]["goal_id"])
    what = "several goals begin like that" if place == 1 else "there is no such goal"
    raise UsageError(f"{what} — {goal}", meant_or([row["said"] for row in near[:_SHOWN]], _LISTED))


def read_story(connection: duckdb.DuckDBPyConnection, request_id: int) -> Story:
    """Return the story of the goal, or of the call, that a request began."""
    import pyarrow as pa

    run = require_start(connection, Start("request", request_id))
    header = internal_sql().header("story_step")
    values = {"request_id": request_id, "runs": [run.run_id]}
    with Steps(connection) as tables:
        tables.keep("callback_name", values)
        found = internal_sql().run(connection, "story_step", values).to_arrow_table()
    steps = QueryResult(found, header, (run,))
    rows = steps.table.to_pylist()
    stages = [row for row in rows if row["took_ns"] is not None and row["is_stage"]]
    total_ns = sum(row["took_ns"] for row in stages)
    last = (stages or rows[:1])[-1]
    worst = max(stages, key=lambda row: row["took_ns"], default=rows[0])
    words = header.next_command(worst)
    is_sent = rows[0]["step"] == "sent"
    at_s = (rows[0]["at_ns"] - (run.start_ns or 0)) / 1e9
    verdict = {
        "headline": [
            f"{rows[0]['what']} {request_id}, {'from' if is_sent else 'at'} {rows[0]['node']}"
            f" at {at_s:.3f} s:"
            f" {format_duration(total_ns)} until {last['step']}"
        ],
        "evidence": [[_longest(worst), *(_open(last["step"]) if is_sent else [])]],
        "next": [words and shlex.join(words)],
    }
    return Story(
        run=run,
        verdict=QueryResult(pa.table(verdict), runs=(run,)),
        steps=steps,
        notes=tuple(clock_notes(connection, [run])),
    )


def _open(step: str) -> list[str]:
    """Return that it is not over, unless a step is an end."""
    is_over = step in ("answer taken", "rejected", "result taken")
    return [] if is_over else [f"nothing more is recorded; the last that is known: {step}"]


def _longest(stage: Mapping[str, Any]) -> str:
    if stage["took_ns"] is None:
        return "nothing else is known of it"
    text = f"longest: {format_duration(stage['took_ns'])} until {stage['step']} of {stage['node']}"
    if stage["what"] is None:
        return f"{text}: no callback ran there meanwhile"
    function = "" if stage["function"] is None else f" ({stage['function']})"
    return f"{text}: {stage['what']}{function} for {100 * stage['share']:.0f} % of it"
