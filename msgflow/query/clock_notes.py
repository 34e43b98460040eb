"""Notes on clocks: how far times of several clocks can be compared."""

from __future__ import annotations

from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING

from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    from collections.abc import Sequence

    import duckdb
    import pyarrow as pa

    from msgflow.run.choice import Run


def clock_notes(connection: duckdb.DuckDBPyConnection, runs: Sequence[Run]) -> list[str]:
    """Return notes on how far times of several hosts can be compared, a sentence each."""
    chosen = {"runs": [run.run_id for run in runs]}
    # Most runs have one clock and need no note: this first statement takes no time.
    several = connection.execute(
        "SELECT 1 FROM main.clock WHERE list_contains($runs, run_id) "
        "GROUP BY run_id HAVING count(*) > 1 LIMIT 1",
        chosen,
    )
    if not several.fetchall():
        return []
    groups = internal_sql().run(connection, "clock_group", chosen).fetchall()
    clocks = {
        run_id: (len(together), "FILE" if together[0][-1] else "messages")
        for run_id, (*together,) in groupby(groups, key=itemgetter(0))
        if len(together) > 1
    }
    corrections = internal_sql().run(connection, "clock_correction", chosen).fetchall()
    return [
        f"{'the run' if len(runs) == 1 else f'run {run.title}'} has"
        f" {clocks[run.run_id][0]} clocks that are not synchronised: times between their hosts are"
        f" not comparable; msgflow clocks apply {clocks[run.run_id][1]}"
        for run in runs
        if run.run_id in clocks
    ] + [
        f"{'' if len(runs) == 1 else f'run {run.title}: '}times between {reference}"
        f" and {hosts} {_wrong_by(least, greatest)}; msgflow clocks"
        for run in runs
        for run_id, reference, hosts, least, greatest in corrections
        if run_id == run.run_id
    ]


def untraced_notes(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], table: pa.Table
) -> list[str]:
    """Return where flows begin whose first publisher is not traced, if paths have any."""
    if "path" not in table.column_names:
        return []
    chosen = {"runs": [run.run_id for run in runs]}
    begins = internal_sql().run(connection, "untraced_begin", chosen).fetchall()
    if not begins:
        return []
    paths = [path for path in table["path"].unique().to_pylist() if path is not None]
    where = {
        True: "the stamp of each message",
        False: "its take: its clock may be another one",
        None: "the stamp of each message, or its take where its clock may be another one",
    }
    return [
        f"what publishes {topic} is not traced: flows begin with {where[is_stamped]}"
        for topic, is_stamped in begins
        if any(path.startswith(f"(not traced) → {topic} → ") for path in paths)
    ]


def clock_verdicts(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], *, only_several: bool = False
) -> list[str]:
    """Return a sentence per run, or per run with several clocks: whether times of hosts compare."""
    chosen = {"runs": [run.run_id for run in runs]}
    rows = internal_sql().run(connection, "clock_group", chosen).fetchall()
    verdicts = []
    for run in runs:
        groups = [tuple(row[1:]) for row in rows if row[0] == run.run_id]
        if not groups or (only_several and len(groups) == 1 and groups[0][1] == 1):
            continue
        label = "" if len(runs) == 1 else f"run {run.title}: "
        verdicts.append(label + _verdict(groups))
    return verdicts


def _verdict(groups: Sequence[tuple[str, int, float | None, bool]]) -> str:
    if len(groups) > 1:
        cure = "FILE" if groups[0][3] else "messages"
        return (
            f"the clocks of {' | '.join(hosts for hosts, *_ in groups)} are not synchronised: times"
            f" between them cannot be compared; cure: msgflow clocks apply {cure}"
        )
    ((hosts, clocks, greatest_ms, _),) = groups
    if clocks == 1:
        return f"one clock ({hosts}): all times can be compared"
    if greatest_ms is None:
        return f"the clocks of {hosts} are together, as far as the file with their offsets is right"
    return f"the clocks of {hosts} are together within ±{greatest_ms:.3f} ms"


def _wrong_by(least_ms: float | None, greatest_ms: float | None) -> str:
    if least_ms is None or greatest_ms is None:
        return "are off by as much as the file with their offsets is"
    return f"are known to ±{least_ms:.3f} ms at best and ±{greatest_ms:.3f} ms at worst"
