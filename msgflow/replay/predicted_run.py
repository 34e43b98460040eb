"""A replay as a run of a database: what ran and was sent becomes rows, links follow from them."""

from __future__ import annotations

import contextlib
import os
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from msgflow.db import migration
from msgflow.db.connection import attach
from msgflow.db.derivation import derive
from msgflow.db.sandbox import open_memory
from msgflow.db.store import empty, store
from msgflow.db.store_table import store_tables
from msgflow.db.transaction import transaction
from msgflow.db.workspace import creating, workspace
from msgflow.sql.failure import database_errors
from msgflow.sql.statement import internal_sql, registered

if TYPE_CHECKING:
    import duckdb

    from msgflow.db.store_table import StoreTable
    from msgflow.replay.change import Change
    from msgflow.replay.engine import Replay
    from msgflow.replay.system import System
    from msgflow.run.choice import Run

# What the changed system consists of, as the recorded one; a replay has one clock.
_OBJECTS = (
    "clock", "host", "trace", "process", "thread", "node", "publisher", "subscription", "timer",
    "service", "client", "callback", "annotation", "annotation_input", "annotation_output",
)  # fmt: skip
_EVENTS = ("publication", "take", "callback_instance", "executor_state")
_ONE_CLOCK = """
UPDATE staging.host SET clock_id = (SELECT min(clock_id) FROM staging.clock);
DELETE FROM staging.clock WHERE clock_id NOT IN (SELECT clock_id FROM staging.host);
UPDATE staging.clock SET offset_ns = 0, drift_ppb = 0, uncertainty_ns = NULL, method = 'none',
    drift_uncertainty_ppb = NULL, reference_clock_id = NULL;
"""
_CHANGED = """
UPDATE staging.timer SET period_ns = a.period_ns
FROM staging.callback AS c
JOIN altered AS a ON c.callback_id = a.callback_id
WHERE timer.timer_id = c.timer_id AND a.period_ns IS NOT NULL;
UPDATE staging.subscription SET queue_depth = a.depth
FROM staging.callback AS c
JOIN altered AS a ON c.callback_id = a.callback_id
WHERE subscription.subscription_id = c.subscription_id AND a.depth > 0;
"""


def write_predicted(
    connection: duckdb.DuckDBPyConnection,
    run: Run,
    system: System,
    replay: Replay,
    changes: Sequence[Change],
    target: Path,
    *,
    only_predicted: bool = False,
) -> str:
    """Write a database with a recorded run, and the same as it was replayed; return its name.

    `system` is the changed one. The file appears when it is complete, in place of one that is
    there. `only_predicted` leaves the recorded run out.
    """
    tables = store_tables()
    with (
        database_errors(target),
        creating(target),
        workspace(target) as directory,
        contextlib.closing(open_memory()) as con,
    ):
        fresh = directory / "target.duckdb"
        migration.create(fresh)
        attach(con, fresh, is_new=True)
        con.execute("ATTACH ':memory:' AS staging")
        for name in tables:
            con.execute(f"CREATE TABLE staging.{name} AS FROM store.{name} LIMIT 0")
        described = _of_run(connection, "store.run", run).read_all()
        if not only_predicted:
            for name, table in tables.items():
                if "run_id" in table.columns and name != "run":
                    _stage(con, name, _of_run(connection, f"store.{name}", run))
            _keep(con, run.run_id, run.name, (), described)
            empty(con, "staging")
        for name in _OBJECTS:
            _stage(con, name, _of_run(connection, _on_one_clock(tables[name]), run))
        con.execute(_ONE_CLOCK)
        _stage_replay(con, connection, run, system, replay)
        name = f"{run.name}-predicted"
        labels = [f"change={'; '.join(map(str, changes))}"] if changes else []
        _keep(con, run.run_id + 1, name, labels, described)
        con.execute("CHECKPOINT")
        con.close()
        os.replace(fresh, target)
    return name


def _of_run(connection: duckdb.DuckDBPyConnection, table: str, run: Run) -> pa.RecordBatchReader:
    return connection.sql(f"FROM {table} WHERE run_id = {run.run_id}").to_arrow_reader()


def _on_one_clock(table: StoreTable) -> str:
    """Return what follows FROM for the rows of a table, with their times on the common axis."""
    hidden = "".join(f", s.{each.name}" for each in table.columns.values() if each.is_hidden)
    if not hidden:
        return f"main.{table.name}"
    return (
        f"(SELECT m.*{hidden} FROM main.{table.name} AS m"
        f" JOIN store.{table.name} AS s ON m.{table.key} = s.{table.key})"
    )


def _stage(con: duckdb.DuckDBPyConnection, name: str, rows: Any) -> None:
    """Fill a table of staging with the columns that rows have of it."""
    known = [each for each in rows.schema.names if each in store_tables()[name].columns]
    with registered(con, incoming=rows):
        con.execute(f"INSERT INTO staging.{name} BY NAME SELECT {', '.join(known)} FROM incoming")


def _keep(
    con: duckdb.DuckDBPyConnection,
    run_id: int,
    name: str,
    labels: Sequence[str],
    described: pa.Table,
) -> None:
    """Store what is staged as a run; of one that a replay made, derive the links."""
    is_new = run_id not in described["run_id"].to_pylist()
    with transaction(con):
        store(con, run_id)
        with registered(con, incoming=described):
            con.execute(
                "INSERT INTO store.run BY NAME SELECT * REPLACE ($run_id AS run_id, $name AS name,"
                " coalesce(labels, []) || $labels AS labels) FROM incoming",
                {"run_id": run_id, "name": name, "labels": list(labels)},
            )
        if is_new:
            derive(con, run_id, findings=False)


def _stage_replay(
    con: duckdb.DuckDBPyConnection,
    connection: duckdb.DuckDBPyConnection,
    run: Run,
    system: System,
    replay: Replay,
) -> None:
    """Fill staging with what happened in a replay."""
    callbacks = dict(
        connection.execute(
            "SELECT callback_id, process_id FROM main.callback WHERE run_id = ?", [run.run_id]
        ).fetchall()
    )
    threads: dict[int, list[int]] = defaultdict(list)
    for executor, thread in connection.execute(
        "SELECT executor_id, thread_id FROM main.executor_thread WHERE run_id = ? ORDER BY ALL",
        [run.run_id],
    ).fetchall():
        threads[executor].append(thread)
    ((last,),) = connection.execute("SELECT max(thread_id) FROM main.thread").fetchall()
    ran, added = _on_threads(system, replay, threads, last or 0)
    outside_id = (last or 0) + len(added)
    process_of = {each.executor: callbacks[each.number] for each in system.callbacks.values()}
    executors = [
        {
            "executor_id": number,
            "process_id": process_of[number],
            "kind": "multi_threaded"
            if executor.kind == "single_threaded" and executor.threads > 1
            else executor.kind,
            "is_inferred": True,
        }
        for number, executor in system.executors.items()
        if number in process_of
    ]
    sent = {
        "serial": range(1, len(replay.sent) + 1),
        **_columns(replay.sent, ("publication_id", "at_ns", "ran_id")),
    }
    values = {"run_id": run.run_id, "outside_id": outside_id}
    with registered(connection, replay_ran=pa.table(ran), replay_sent=pa.table(sent)):
        for name in _EVENTS:
            rows = internal_sql().run(connection, f"predicted_{name}", values).to_arrow_reader()
            _stage(con, name, rows)
    _stage(con, "executor", pa.Table.from_pylist(executors))
    _stage(
        con,
        "executor_thread",
        pa.Table.from_pylist(
            [
                {"executor_id": executor, "thread_id": thread}
                for executor, each in threads.items()
                for thread in each
                if executor in process_of
            ]
        ),
    )
    rows = [
        {"thread_id": thread, "process_id": process_of[executor], "tid": thread}
        for thread, executor in added.items()
    ]
    if rows:
        _stage(con, "thread", pa.Table.from_pylist(rows))
    con.execute(
        "INSERT INTO staging.thread BY NAME SELECT DISTINCT thread_id, process_id, 0 AS tid"
        " FROM staging.publication WHERE thread_id > ?",
        [outside_id],
    )
    con.execute(
        "UPDATE staging.thread SET first_seen_ns = ?, last_seen_ns = ? WHERE thread_id > ?",
        [run.start_ns, run.end_ns, last],
    )
    altered = {
        "callback_id": list(system.callbacks),
        "period_ns": [each.period for each in system.callbacks.values()],
        "depth": [each.depth for each in system.callbacks.values()],
    }
    with registered(con, altered=pa.table(altered)):
        con.execute(_CHANGED)


def _on_threads(
    system: System, replay: Replay, threads: Mapping[int, list[int]], last: int
) -> tuple[dict[str, Sequence[int | None]], dict[int, int]]:
    """Return columns of what ran, each on the first thread of its executor that is free then.

    Executors get further threads where they need them; these are returned, with their executors.
    """
    added: dict[int, int] = {}
    free: dict[int, dict[int, int]] = {
        key: dict.fromkeys(threads[key], 0) for key in system.executors
    }
    placed, looked = [], []
    for callback, since, begin, end, _, _ in replay.ran:
        executor = system.callbacks[callback].executor
        until = free[executor]
        thread = next((each for each, time in until.items() if time <= begin), None)
        if thread is None:
            thread = last + len(added) + 1
            added[thread] = executor
            threads[executor].append(thread)
        looked.append(max(since, until.get(thread, since)))
        until[thread] = end
        placed.append(thread)
    columns = _columns(
        replay.ran, ("callback_id", "looked_ns", "start_ns", "end_ns", "free_ns", "serial")
    )
    return {
        "ran_id": range(1, len(replay.ran) + 1),
        **columns,
        "looked_ns": looked,
        "thread_id": placed,
    }, added


def _columns(rows: Sequence[Sequence[int]], names: Sequence[str]) -> dict[str, list[int | None]]:
    """Return rows as columns; the last one says 0 where there is nothing."""
    columns: dict[str, list[int | None]] = {
        name: [row[place] for row in rows] for place, name in enumerate(names)
    }
    last = names[-1]
    return {**columns, last: [value or None for value in columns[last]]}
