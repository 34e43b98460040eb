"""When a run changed: its changes, in words too, and the values over time that show them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow.query.catalogue import load_query
from msgflow.query.runner import Steps, run_query
from msgflow.sql.statement import internal_sql, registered
from msgflow.text.values import printable

if TYPE_CHECKING:
    import duckdb
    import pyarrow as pa

    from msgflow.result.query_result import QueryResult
    from msgflow.run.choice import Run
    from msgflow.run.slice import Slice


@dataclass(frozen=True)
class Course:
    """What changed during a run.

    Attributes:
        changes: rows of `changes`.
        lines: the values in which they were looked for, a row for each path, callback or topic.
        sentences: the changes in words, those that explain most first.
    """

    changes: QueryResult
    lines: pa.Table
    sentences: pa.Table

    def picture(self) -> Iterator[str]:
        """Yield the first sentence, and its values over time as text; nothing without a change."""
        for row in self.sentences.slice(0, 1).to_pylist():
            yield printable(row["sentence"])
            if row["picture"]:
                yield f"  {row['picture']}  at most {row['most']}"
                yield f"  {' ' * row['cell']}▲"


def read_course(connection: duckdb.DuckDBPyConnection, run: Run, times: Slice) -> Course:
    """Return what changed during a run."""
    with Steps(connection) as steps:
        changes = run_query(connection, load_query("changes"), {}, times, steps=steps)
        return course_of(connection, run, changes)


def course_of(connection: duckdb.DuckDBPyConnection, run: Run, changes: QueryResult) -> Course:
    """Return changes with their values, and in words; the steps of the query are there yet."""
    start_ns, end_ns = run.start_ns or 0, run.end_ns or 0
    values = {"origin_ns": start_ns, "length_ns": max(end_ns - start_ns, 1)}
    lines = internal_sql().run(connection, "course_line", values).to_arrow_table()
    with registered(connection, change=changes.table, course_line=lines):
        sentences = internal_sql().run(connection, "course_sentence", values).to_arrow_table()
    return Course(changes, lines, sentences)
