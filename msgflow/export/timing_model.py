"""The timing of a run as YAML, for analyses of response times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgflow.files.atomic import replacing
from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow.sql.statement import internal_sql, registered

if TYPE_CHECKING:
    import duckdb

    from msgflow.run.choice import Run
    from msgflow.run.slice import Slice

_DISTRIBUTION = ("shortest", "median", "p95", "p99", "longest")


@dataclass(frozen=True)
class TimingModel:
    """A file that was written.

    Attributes:
        path: the file.
        run: what it is of.
        callbacks: how many it has; `chains` likewise.
        exceeded: callbacks whose response took longer than the bound, though it should hold.
    """

    path: Path
    run: Run
    callbacks: int
    chains: int
    exceeded: int


def write_timing_model(
    connection: duckdb.DuckDBPyConnection, path: Path, part: Slice
) -> TimingModel:
    """Write executors with their callbacks, and chains; times in ns."""
    from ruamel.yaml import YAML

    run = part.one_run(connection, "a timing model")
    values = {"runs": [run.run_id]}
    found = run_query(connection, load_query("e2e-latency"), {}, part, runs=(run,))
    sql = internal_sql()
    sql.keep(connection, "callback_name", values)
    try:
        timing = sql.run(connection, "timing_callback", values).to_arrow_table()
        with registered(connection, timing_callback=timing, paths=found.table):
            chains = list(sql.rows(connection, "timing_chain", values))
    finally:
        connection.execute("DROP TABLE temp.callback_name")
    callbacks = timing.to_pylist()
    model = {
        "run": run.name,
        "executors": [
            _executor(number, list(rows))
            for number, rows in groupby(callbacks, lambda row: row["executor_id"])
        ],
        "chains": [_known(row) for row in chains],
    }
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8") as stream:
        YAML().dump(model, stream)
    exceeded = sum(
        row["is_sure"] is True and row["observed_ns"] > row["bound_ns"] for row in callbacks
    )
    return TimingModel(path, run, len(callbacks), len(chains), exceeded)


def _executor(number: int, rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    return {
        "executor": number,
        "kind": rows[0]["kind"],
        "threads": rows[0]["threads"],
        "callbacks": [
            _known(
                {
                    "name": f"{row['node']} {row['callback']}",
                    "function": row["function"],
                    "group": row["callback_group_id"],
                    "group_kind": row["group_kind"],
                    "period_ns": row["period_ns"],
                    "least_distance_ns": row["least_ns"],
                    "instances": row["instances"],
                    "execution_ns": _distribution(row["run_ns"]),
                    "cpu_ns": _distribution(row["cpu_ns"]),
                    "response_ns": _known(
                        {
                            "observed_at_least": row["observed_ns"],
                            "observed_at_most": row["observed_most_ns"],
                            "bound": row["bound_ns"],
                            "bound_holds": row["is_sure"],
                        }
                    ),
                }
            )
            for row in rows
        ],
    }


def _distribution(values: Sequence[int] | None) -> dict[str, int] | None:
    return None if values is None else dict(zip(_DISTRIBUTION, values, strict=True))


def _known(row: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in row.items() if value is not None}
