"""Stacks of flame graphs: of a run, or of the slowest flows of a path beside the others."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.query.catalogue import load_query
from msgflow.query.runner import Steps, bind
from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pyarrow as pa

    from msgflow.view.question import Question


def stacks(asked: Question, instances: Sequence[int] | None = None) -> pa.Table:
    """Return stacks of callback instances, else of the window; those with most samples first."""
    values = {"run_id": asked.run.run_id, "instances": instances, **asked.window.bindings}
    table = internal_sql().run(asked.connection, "folded_stack", values).to_arrow_table()
    return table.sort_by([("samples", "descending"), ("stack", "ascending")])


def stacks_of_path(asked: Question, path: str, slowest: int) -> tuple[pa.Table, pa.Table]:
    """Return stacks on the way of so many slowest flows of a path, and of its other flows."""
    header = load_query("functions")
    chosen = bind(header, {"via": [path]})
    with Steps(asked.connection) as steps:
        steps.make(header, {"runs": [asked.run.run_id], **chosen, **asked.window.bindings})
        found = asked.connection.table("function_instance").fetchall()
    slow = [instance for instance, place in found if place <= slowest]
    others = [instance for instance, place in found if place > slowest]
    return stacks(asked, slow), stacks(asked, others)
