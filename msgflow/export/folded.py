"""Folded stacks of a run, for tools that draw flame graphs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.files.atomic import replacing
from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    import duckdb

    from msgflow.run.choice import Run
    from msgflow.run.slice import Slice


@dataclass(frozen=True)
class FoldedStacks:
    """A file that was written.

    Attributes:
        path: the file.
        run: what it is of.
        stacks: different ones, each a line.
        samples: of all of them.
    """

    path: Path
    run: Run
    stacks: int
    samples: int


def write_folded(connection: duckdb.DuckDBPyConnection, path: Path, part: Slice) -> FoldedStacks:
    """Write a line for each stack: node, callback and functions, then how many samples saw it."""
    run = part.one_run(connection, "a flame graph")
    bindings = {"run_id": run.run_id, **part.window([run]).bindings}
    rows = internal_sql().run(connection, "folded_stack", bindings).fetchall()
    if not rows:
        raise UsageError(
            f"no functions were sampled then — run {run.name} ({run.run_id})",
            "msgflow record --profile 99, or perf beside the session (docs/functions.md)",
        )
    with replacing(path) as temporary:
        lines = (f"{stack} {samples}\n" for stack, samples in rows)
        temporary.write_text("".join(lines), encoding="utf-8")
    return FoldedStacks(path, run, len(rows), sum(samples for _, samples in rows))
