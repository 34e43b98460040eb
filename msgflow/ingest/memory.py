"""Ingest into a database in memory, which lasts as long as a question needs it."""

from __future__ import annotations

import contextlib
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from msgflow.clocks import set_clocks
from msgflow.db import empty_database
from msgflow.db.connection import attach
from msgflow.db.derivation import derive
from msgflow.db.sandbox import open_memory, shut_in
from msgflow.db.transaction import transaction
from msgflow.ingest import model, staging
from msgflow.ingest.load import load_traces
from msgflow.ingest.stored_run import store_run
from msgflow.links import declare_links
from msgflow.sql.interrupt import noted_interrupts

if TYPE_CHECKING:
    from collections.abc import Iterator

    import duckdb

    from msgflow.clocks import ClockSync
    from msgflow.links import LinksFile
    from msgflow.trace import TraceSet


@contextlib.contextmanager
def ingested_in_memory(
    traces: TraceSet, name: str, *, links: LinksFile | None, clocks: ClockSync
) -> Iterator[duckdb.DuckDBPyConnection]:
    """Have a database with the traces as its only run, made by the SQL of every ingest.

    Nothing is written but an empty database to start from. Findings are not looked for.

    Args:
        traces: what to read.
        name: of the run.
        links: indirect links to declare.
        clocks: how clocks of several hosts are brought together.

    Raises:
        UsageError: the links or clocks do not fit the traces.
        KeyboardInterrupt: Ctrl-C came.
    """
    with (
        noted_interrupts() as interrupts,
        tempfile.TemporaryDirectory(prefix="msgflow-") as directory,
        contextlib.closing(open_memory()) as con,
    ):
        target = Path(directory) / "target.duckdb"
        empty_database.write_empty(target)
        attach(con, target, is_new=True)
        staging.attach(con, None)
        # Closing must not write into the file what is of no use any more.
        staging.leave(con)
        con.execute("SET wal_autocheckpoint = '1TB'")
        shut_in(con, lock=False)
        loaded = load_traces(
            con,
            traces,
            hostnames={},
            ignore=(),
            may_hold=False,
            replace=False,
            interrupts=interrupts,
            progress=None,
        )
        model.build(con, findings=False)
        with transaction(con):
            run_id, _ = store_run(con, name, name, loaded)
            if links is not None:
                declare_links(con, run_id, links)
            derive(con, run_id, synchronise=lambda: set_clocks(con, run_id, clocks), findings=False)
        for catalog in ("raw", "staging"):
            con.execute(f"DETACH {catalog}")
        yield con
