"""Corrections of the clocks of a run, stored in place of earlier ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from msgflow.clocks.clocks_file import FIELDS
from msgflow.db.derivation import derive_from_clocks
from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    import duckdb

    from msgflow.clocks.clocks_file import ClockSync, GivenClock
    from msgflow.files.yaml_file import YamlFile
    from msgflow.run.choice import Run

# Columns of a correction.
_CORRECTION = (
    "offset_ns", "drift_ppb", "reference_ns", "uncertainty_ns", "drift_uncertainty_ppb",
    "reference_clock_id", "method",
)  # fmt: skip

_BOUNDS = """
INSERT INTO store.clock_uncertainty (run_id, clock_id, at_ns, uncertainty_ns)
SELECT $run_id, sync.clock_id, bound.at_ns, bound.uncertainty_ns
FROM clock_synchronised AS sync, unnest(sync.bounds) AS unnested (bound)
ORDER BY sync.clock_id, bound.at_ns
"""

_GIVEN = """
UPDATE store.clock SET
    offset_ns = $offset_ns, drift_ppb = $drift_ppb,
    reference_ns = coalesce($reference_ns, reference_ns), uncertainty_ns = $uncertainty_ns,
    drift_uncertainty_ppb = NULL, reference_clock_id = $reference_id, method = 'file'
WHERE clock_id = $clock_id
"""


def apply_clocks(
    con: duckdb.DuckDBPyConnection, runs: tuple[Run, ...], sync: ClockSync
) -> tuple[Run, ...]:
    """Correct the clocks of runs anew; see `Database.apply_clocks`."""
    for run in runs:
        set_clocks(con, run.run_id, sync)
        derive_from_clocks(con, run.run_id)
    return runs


def set_clocks(con: duckdb.DuckDBPyConnection, run_id: int, sync: ClockSync) -> None:
    """Store the corrections of the clocks of a run, inside the open transaction.

    The messages must be linked before. The caller derives afterwards what depends on clocks, such
    as the reasons of missing messages.
    """
    _correct(con, f"({internal_sql().text('clock_as_recorded')})", {"run_id": run_id})
    con.execute("DELETE FROM store.clock_uncertainty WHERE run_id = ?", [run_id])
    con.execute("UPDATE store.run SET clock_sync = ? WHERE run_id = ?", [sync.method, run_id])
    if sync.method == "messages":
        con.execute(
            "CREATE OR REPLACE TEMP TABLE clock_synchronised AS\n"
            + internal_sql().text("clock_from_messages"),
            {"run_id": run_id},
        )
        _correct(con, "(FROM clock_synchronised WHERE is_connected)")
        con.execute(_BOUNDS, {"run_id": run_id})
        con.execute("DROP TABLE temp.clock_synchronised")
    elif sync.file is not None:
        _set_given(con, run_id, sync.file, sync.clocks)


def _correct(
    con: duckdb.DuckDBPyConnection, source: str, values: Mapping[str, int] | None = None
) -> None:
    assigned = ", ".join(f"{column} = new.{column}" for column in _CORRECTION)
    con.execute(
        f"UPDATE store.clock SET {assigned} FROM {source} AS new "
        "WHERE clock.clock_id = new.clock_id",
        values or {},
    )


def _set_given(
    con: duckdb.DuckDBPyConnection, run_id: int, file: YamlFile, given_clocks: Sequence[GivenClock]
) -> None:
    clocks = internal_sql().run(con, "clock_known", {"run_id": run_id}).fetchall()
    chosen: dict[int, GivenClock] = {}
    for given in given_clocks:
        found = [clock for clock in clocks if given.name == clock[1]] or [
            clock for clock in clocks if given.name in clock[2]
        ]
        if not found:
            known = ", ".join(
                " and ".join(hostnames) + ("" if uuid is None else f" ({uuid})")
                for _, uuid, hostnames in clocks
            )
            file.fail(
                given.line,
                f"the run has no host or clock of that name — {given.name}",
                f"it has {known}",
            )
        if len(found) > 1:
            uuids = ", ".join(str(uuid) for _, uuid, _ in found)
            file.fail(
                given.line,
                f"several hosts have that name — {given.name}",
                f"name the clock by its uuid: {uuids}; or name hosts with ingest --host NAME=PATH",
            )
        clock_id = found[0][0]
        before = chosen.get(clock_id, given)
        if replace(before, name="", line=0) != replace(given, name="", line=0):
            file.fail(
                given.line,
                f"{given.name} and {before.name} (line {before.line}) have one clock, and are"
                " given different times",
                "leave out one of the two",
            )
        chosen[clock_id] = given
    # If the file leaves out one clock, offsets lead to the times of that clock.
    others = [clock_id for clock_id, _, _ in clocks if clock_id not in chosen]
    reference_id = others[0] if len(others) == 1 else min(chosen)
    for clock_id, given in chosen.items():
        values = {name: getattr(given, name) for name in FIELDS}
        con.execute(_GIVEN, values | {"reference_id": reference_id, "clock_id": clock_id})
    if len(others) == 1:
        con.execute(
            "UPDATE store.clock SET reference_clock_id = clock_id, uncertainty_ns = 0, "
            "drift_uncertainty_ppb = 0 WHERE clock_id = ?",
            others,
        )
