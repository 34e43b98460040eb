"""Derivation of links: rows of an object in `derive` are stored in the table of its name."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING

from msgflow.db import objects
from msgflow.db.finding import kinds_with_rows, store_findings
from msgflow.db.store_table import store_tables
from msgflow.sql.statement import RECORDED, may_have_rows, recorded

if TYPE_CHECKING:
    import duckdb

    from msgflow.sql.header import Header

# Tables that `synchronise` writes.
_CLOCKS = {"store.clock", "store.clock_uncertainty"}

# Tables of `store` whose rows can learn their topic from messages.
_TOPIC_OWNERS = ("publisher", "subscription")
_TOPICS = "derive.topic_learned"


def derive(
    con: duckdb.DuckDBPyConnection,
    run_id: int,
    *,
    synchronise: Callable[[], None] | None = None,
    findings: bool = True,
) -> None:
    """Derive the links of a run anew, inside the open transaction.

    `synchronise` corrects the clocks. It is called once messages are linked; None leaves the clocks
    as they are. `findings` also finds what the recording shows.
    """
    learn_topics(con, run_id)
    for name in derived_tables():
        if not reads_clocks(name):
            derive_table(con, name, run_id)
    if synchronise is not None:
        synchronise()
    derive_from_clocks(con, run_id, findings=findings)
    con.execute(
        "UPDATE store.run SET derivation_hash = ? WHERE run_id = ?", [derivation_hash(), run_id]
    )


def derive_from_clocks(
    con: duckdb.DuckDBPyConnection, run_id: int, *, findings: bool = True
) -> None:
    """Derive anew what depends on corrected clocks, and all findings of the recording.

    This happens inside the open transaction.
    """
    for name in derived_tables():
        if reads_clocks(name):
            derive_table(con, name, run_id)
    if findings:
        derive_findings(con, run_id)


def derive_findings(con: duckdb.DuckDBPyConnection, run_id: int) -> None:
    """Find anew what a recording shows, inside the open transaction."""
    found = kinds_with_rows(con, "recording", {"run_id": run_id}, _of_run)
    store_findings(con, run_id, found)


@cache
def derived_tables() -> tuple[str, ...]:
    """Return the tables of `store` that hold the rows of the object of that name in `derive`.

    Each comes after those that it is derived from.
    """
    return tuple(
        name
        for header in objects.views()
        for schema, _, name in [header.name.partition(".")]
        if schema == "derive" and name in store_tables()
    )


@cache
def reads_clocks(name: str) -> bool:
    """Return whether the rows of one of `derived_tables` depend on corrected clocks."""
    return not _CLOCKS.isdisjoint(objects.sources_of([f"derive.{name}"]))


@cache
def derivation_hash() -> str:
    """Return the SHA-256 of the SQL that derives stored tables, learned topics and findings.

    What an object needs rows of, and what it takes together, decides as well as its statement.
    """
    found = objects.load("health/recording")
    tables = (f"derive.{name}" for name in derived_tables())
    needs = (need for header in found for need in header.needs)
    names = objects.sources_of([_TOPICS, *tables, *needs])
    headers = [*(header for header in objects.views() if header.name in names), *found]
    return objects.hash_of(
        text
        for header in headers
        for text in (header.name, header.body, str((header.sources, header.also, header.reads)))
    )


def derive_table(con: duckdb.DuckDBPyConnection, name: str, run_id: int) -> None:
    """Derive one of `derived_tables` anew, inside the open transaction."""
    columns = ", ".join(store_tables()[name].columns)
    con.execute(f"DELETE FROM store.{name} WHERE run_id = ?", [run_id])
    whole = _header(f"derive.{name}")
    for header in (whole, *map(_header, whole.also)):
        if may_have_rows(con, header.sources, {"run_id": run_id}, _of_run):
            text = (
                f"INSERT INTO store.{name} ({columns}) {_united(con, header, run_id)}"
                f"SELECT {columns} FROM {_of_run(header.name)}"
            )
            parts = [part for part in RECORDED if f"${part}" in text]
            con.execute(text, {"run_id": run_id, **recorded(con, parts)})


def _united(con: duckdb.DuckDBPyConnection, header: Header, run_id: int) -> str:
    """Return the WITH clause for the objects that one unites, of those that may have rows."""
    if not header.united:
        return ""
    values = {"run_id": run_id}
    parts = [
        name for name in header.united if may_have_rows(con, _header(name).sources, values, _of_run)
    ]
    rows = " UNION ALL BY NAME ".join(f"FROM {_of_run(name)}" for name in parts)
    return f"WITH united AS MATERIALIZED ({rows}) "


def _of_run(name: str) -> str:
    """Return what follows FROM for the rows of the run `$run_id`."""
    if name.startswith("store.") or _header(name).kind == "view":
        return f"(FROM {name} WHERE run_id = $run_id)"
    header = _header(name)
    words = ["'united'"] if header.united else []
    parts = (f"{part} := ${part}" for part in RECORDED if f"{part} := true" in header.body)
    return f"{name}({', '.join([*words, '$run_id', *parts])})"


@cache
def _header(name: str) -> Header:
    return next(header for header in objects.views() if header.name == name)


def learn_topics(con: duckdb.DuckDBPyConnection, run_id: int) -> None:
    """Learn unknown topics from messages anew, inside the open transaction."""
    for kind in _TOPIC_OWNERS:
        con.execute(
            f"UPDATE store.{kind} SET topic_name = NULL, is_internal = false, "
            "is_topic_learned = false WHERE run_id = ? AND is_topic_learned",
            [run_id],
        )
    for kind in _TOPIC_OWNERS:
        unnamed = f"SELECT 1 FROM store.{kind} WHERE run_id = ? AND topic_name IS NULL LIMIT 1"
        if not con.execute(unnamed, [run_id]).fetchall():
            continue
        con.execute(
            f"UPDATE store.{kind} SET topic_name = learned.topic_name, "
            "is_internal = learned.is_internal, is_topic_learned = true "
            f"FROM {_TOPICS}(?) AS learned "
            f"WHERE learned.kind = '{kind}' AND {kind}.{kind}_id = learned.id "
            f"AND {kind}.run_id = ?",
            [run_id, run_id],
        )


def stale_runs(con: duckdb.DuckDBPyConnection) -> list[tuple[int, str]]:
    """Return (run_id, name) of the runs whose links were derived by other SQL than today's."""
    return con.execute(
        "SELECT run_id, name FROM store.run WHERE derivation_hash <> ? ORDER BY run_id",
        [derivation_hash()],
    ).fetchall()
