"""Ingest into a database in memory, run after run."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import duckdb

from msgflow.clocks.clocks_file import ClockSync
from msgflow.clocks.correction import set_clocks
from msgflow.db import empty_database
from msgflow.db.derivation import derive
from msgflow.db.sandbox import open_memory, shut_in
from msgflow.db.store import empty
from msgflow.db.transaction import transaction
from msgflow.errors import UsageError
from msgflow.ingest import model, staging
from msgflow.ingest.load import load_traces
from msgflow.ingest.stored_run import store_run
from msgflow.links.annotations import declare_links
from msgflow.links.links_file import DeclaredLink, LinksFile
from msgflow.sql.interrupt import noted_interrupts
from msgflow.sql.quoting import literal
from msgflow.trace import TraceSet


def database_in_memory() -> duckdb.DuckDBPyConnection:
    """Make an empty database in memory, for `ingest_again`.

    It works with one thread: to share few rows costs more than it saves, and the system that is
    watched needs the other CPUs.
    """
    con = open_memory()
    with tempfile.TemporaryDirectory(prefix="msgflow-") as directory:
        path = Path(directory) / "empty.duckdb"
        empty_database.write_empty(path)
        con.execute(f"ATTACH {literal(str(path))} AS empty (READ_ONLY)")
        con.execute("ATTACH ':memory:' AS target")
        con.execute("COPY FROM DATABASE empty TO target")
        con.execute("DETACH empty")
    con.execute("USE target")
    staging.attach(con, None)
    con.execute("SET threads = 1")
    shut_in(con, lock=False)
    return con


def ingest_again(
    con: duckdb.DuckDBPyConnection,
    traces: TraceSet,
    name: str,
    *,
    links: LinksFile | None,
    clocks: ClockSync,
    leave_out: Callable[[DeclaredLink, UsageError], None],
) -> None:
    """Put the traces in place of all runs, made by the SQL of every ingest.

    To make tables and views takes longer than to fill them with the rows of a few seconds. So those
    of the run before stay, and tables that remain empty cost nothing. Findings are not looked for.
    """
    with noted_interrupts() as interrupts:
        empty(con, "target")
        try:
            load_traces(
                con,
                traces,
                hostnames={},
                ignore=(),
                may_hold=False,
                replace=False,
                interrupts=interrupts,
                progress=None,
            )
            model.build(con, keep=True, findings=False)
            with transaction(con):
                run_id, _ = store_run(con, name, name)
                _derive(con, run_id, links, clocks, leave_out)
        finally:
            empty(con, "raw", "staging")


def link_again(
    con: duckdb.DuckDBPyConnection,
    *,
    links: LinksFile,
    clocks: ClockSync,
    leave_out: Callable[[DeclaredLink, UsageError], None],
) -> None:
    """Derive the links of the run anew, with other declared ones."""
    with transaction(con):
        ((run_id,),) = con.execute("SELECT run_id FROM store.run").fetchall()
        _derive(con, run_id, links, clocks, leave_out)


def _derive(
    con: duckdb.DuckDBPyConnection,
    run_id: int,
    links: LinksFile | None,
    clocks: ClockSync,
    leave_out: Callable[[DeclaredLink, UsageError], None],
) -> None:
    if links is not None:
        declare_links(con, run_id, links, leave_out)
    derive(con, run_id, synchronise=lambda: set_clocks(con, run_id, clocks), findings=False)
