"""Findings: what is worth knowing about the input, a recording or the database.

Each file of `schema/health` is one kind of finding: an SQL query that returns a row for each place
where it holds, with title, description, severity, cause and cure in its header. Its folder is its
phase, which decides when the query runs and what it reads:

| phase | runs | reads |
| --- | --- | --- |
| input | once the model of an ingest is built | `staging` |
| recording | whenever links or clocks of a run change | `store`, `derive`, `main` |
| database | for `msgflow check --detail` | `store` |

A query returns columns of the table `store.finding`: `count` and `detail`, the place as a column
(`node_id`, `topic_name`), else in words (`subject`); those that do not read `staging` return
`run_id` too, and may use `$run_id`. The rows of the first two phases are stored in that table. The
view `main.finding` adds what the headers say. The phase database is about msgflow itself: no ingest
looks for what it can find.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

from msgflow.db.store_table import store_tables
from msgflow.sql.header import Header
from msgflow.sql.quoting import literal
from msgflow.sql.statement import health_sql, with_rows

if TYPE_CHECKING:
    import duckdb

SEVERITIES = ("error", "warning", "info")

# What the header of a kind says of each of its findings.
_OF_KIND = "name, phase, severity, title, description, cause, cure"


@dataclass(frozen=True)
class Finding:
    """Something worth knowing, at one place: a row of the view `main.finding`, or a broken rule.

    Attributes:
        run_id: the run.
        trace_id: the trace; None: not one trace alone.
        name: kind of finding, which is its file in `schema/health`.
        phase: what it is about: 'input', 'recording' or 'database'.
        severity: 'error' where results are wrong or missing, 'warning' where they may be, or
            'info'.
        subject: where, in words: a trace, process, host, node, topic.
        count: how often.
        detail: numbers.
        cause: where it comes from, as a rule.
        cure: what to do about it.
        title: what was found.
        description: what it means for results.
        host_id: the host, also of a process; None: not one host alone.
        process_id: the process, also of a thread or node.
        thread_id: the thread.
        node_id: the node; of two that a topic joins, the one that subscribes.
        publishing_node_id: of two nodes, the one that publishes.
        topic_name: the topic.
        layer: kind of event that is missing, such as 'requests'.
    """

    run_id: int
    trace_id: int | None
    name: str
    phase: str
    severity: str
    subject: str
    count: int
    detail: str
    cause: str
    cure: str
    title: str
    description: str
    host_id: int | None = None
    process_id: int | None = None
    thread_id: int | None = None
    node_id: int | None = None
    publishing_node_id: int | None = None
    topic_name: str | None = None
    layer: str | None = None


@cache
def kinds() -> tuple[Header, ...]:
    """Return the headers of all kinds of findings, sorted by name."""
    headers = (health_sql().header(name) for name in health_sql().names())
    return tuple(header for header in headers if header.kind != "inline")


def kinds_of(phase: str) -> tuple[Header, ...]:
    """Return the headers of the kinds of a phase, sorted by name."""
    return tuple(header for header in kinds() if phase_of(header) == phase)


def kinds_with_rows(
    con: duckdb.DuckDBPyConnection,
    phase: str,
    values: Mapping[str, Any],
    rows_of: Callable[[str], str] = str,
    empty: Collection[str] = (),
) -> list[Header]:
    """Return the kinds of a phase that may find something; of tables in `empty` nothing is read."""
    sources = {source for kind in kinds_of(phase) for source in kind.sources}
    filled = with_rows(con, [each for each in sources if each[0] not in empty], values, rows_of)
    return [
        kind for kind in kinds_of(phase) if not kind.sources or filled.intersection(kind.sources)
    ]


def phase_of(header: Header) -> str:
    """Return the phase of a kind of finding."""
    return header.path.parent.name


def short_name(header: Header) -> str:
    """Return the name of a kind of finding as people see it."""
    return header.name.partition(".")[2]


def composed(layer: str) -> tuple[Header, ...]:
    """Return the objects of a layer of `schema/` that are made of all kinds of findings."""
    if layer == "arrival":
        name, grain = "staging.finding", "one row per place"
        description = "What was found in the input while it was read and the model was built."
        body = statement(kinds_of("input"))
    elif layer == "stat":
        name, grain = "derive.finding_kind", "one row per kind of finding"
        description = (
            "What an ingest can find, and what the headers in `schema/health` say about it."
        )
        rows = _rows((*kinds_of("input"), *kinds_of("recording")))
        body = f"SELECT {_OF_KIND}\nFROM (\nVALUES\n{rows}\n) AS kind ({_OF_KIND})\n"
    else:
        return ()
    path = health_sql().directory
    return (Header(name, name, description, grain, "view", body, path),)


def statement(headers: Sequence[Header]) -> str:
    """Return the SQL that finds the places of these kinds, with the columns of `store.finding`.

    `run_id` is NULL in those of the phase input.
    """
    # Gives the columns that a query may leave out, and the types of all.
    columns = store_tables()["finding"].columns.values()
    no_row = ", ".join(f"NULL::{column.type} AS {column.name}" for column in columns)
    return "\nUNION ALL\n".join(
        f"SELECT * REPLACE ('{short_name(header)}' AS name, count::BIGINT AS count)\n"
        f"FROM (\nSELECT {no_row} WHERE false\n"
        f"UNION ALL BY NAME (\n{health_sql().text(short_name(header))})\n)"
        for header in headers
    )


def store_findings(con: duckdb.DuckDBPyConnection, run_id: int, headers: Sequence[Header]) -> None:
    """Store what kinds of the phase recording find, in place of all that this phase had.

    This happens inside the open transaction.
    """
    con.execute(
        "DELETE FROM store.finding WHERE run_id = ? AND list_contains(?, name)",
        [run_id, [short_name(header) for header in kinds_of("recording")]],
    )
    for header in headers:
        con.execute(
            f"INSERT INTO store.finding BY NAME FROM (\n{statement([header])}\n) "
            "WHERE run_id = $run_id",
            {"run_id": run_id},
        )


def read_findings(
    con: duckdb.DuckDBPyConnection, run_ids: Sequence[int], *, info: bool = False
) -> list[Finding]:
    """Return the stored findings of runs: errors first, those of one kind together.

    `info` also returns those of severity 'info'.
    """
    rows = con.execute(
        f"SELECT {', '.join(Finding.__dataclass_fields__)} FROM main.finding "
        "WHERE list_contains(?, run_id)",
        [list(run_ids)],
    ).fetchall()
    findings = (Finding(*row) for row in rows)
    return sorted((each for each in findings if info or each.severity != "info"), key=_order)


def first_command(findings: Sequence[Finding]) -> tuple[str, ...]:
    """Return the command that comes next: first for what is wrong, then for what is late."""
    is_sound = all(finding.severity == "info" for finding in findings)
    return ("why",) if is_sound else ("check",)


def commands_after(findings: Sequence[Finding]) -> list[tuple[str, ...]]:
    """Return the commands that a reader of the findings runs next; the last one is `why`."""
    after = (health_sql().header(each.name).next_command(asdict(each)) for each in findings)
    return [*dict.fromkeys(words for words in after if words), ("why",)]


def broken_rules(con: duckdb.DuckDBPyConnection, run_id: int | None = None) -> list[Finding]:
    """Return the broken rules of all runs, or of one, in the order of `read_findings`."""
    headers = kinds_of("database")
    rows = con.execute(
        f"SELECT {', '.join(Finding.__dataclass_fields__)} "
        "FROM (SELECT * REPLACE (coalesce(subject, 'the database') AS subject) "
        f"FROM (\n{statement(headers)}\n)) "
        f"JOIN (VALUES\n{_rows(headers)}\n) AS kind ({_OF_KIND}) USING (name) "
        "WHERE run_id = coalesce($run_id, run_id)",
        {"run_id": run_id, "broken": broken_relations(con, run_id)},
    ).fetchall()
    return sorted((Finding(*row) for row in rows), key=_order)


def broken_relations(
    con: duckdb.DuckDBPyConnection, run_id: int | None = None
) -> list[dict[str, Any]]:
    """Return the columns with identities that no row of their run has where they refer to.

    `store.sql` marks the columns that refer to another table. The databases have no foreign keys.
    A row of another run does not count: nothing is linked across runs.

    Returns:
        For each run and column: `run_id`, `child` ('table.column'), `parent` (a table) and `count`.
    """
    of_run = "" if run_id is None else f"AND run_id = {run_id:d} "
    selects = [
        f"SELECT run_id, '{name}.{column.name}', '{column.to}', count(*) "
        f"FROM store.{name} AS child ANTI JOIN store.{column.to} AS parent "
        f"ON child.{column.name} = parent.{column.to}_id AND child.run_id = parent.run_id "
        f"WHERE {column.name} IS NOT NULL {of_run}GROUP BY run_id"
        for name, table in sorted(store_tables().items())
        for column in table.columns.values()
        if column.to
    ]
    # One statement: each takes longer to plan than its few rows to count.
    rows = con.execute(" UNION ALL ".join(selects)).fetchall()
    return [dict(zip(("run_id", "child", "parent", "count"), row, strict=True)) for row in rows]


def _order(finding: Finding) -> tuple[int, str, int, str, int, str]:
    severity = SEVERITIES.index(finding.severity)
    count, detail = finding.count or 0, finding.detail or ""
    return severity, finding.name, finding.run_id, finding.subject, count, detail


def _rows(headers: Iterable[Header]) -> str:
    rows = (
        (short_name(each), phase_of(each), each.severity, each.title, each.description, each.cause,
         each.cure)
        for each in headers
    )  # fmt: skip
    return ",\n".join(f"    ({', '.join(literal(text or '') for text in row)})" for row in rows)
