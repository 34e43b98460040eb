"""Runs the comparison in DuckDB."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import duckdb

EXCUSE = "events are missing"
"""What `drops.sql` and `orphans.sql` say of a reason that a hole excuses."""

_SQL = Path(__file__).parent
_RECORDED_COLUMNS = """{
    t: 'VARCHAR', id: 'VARCHAR', name: 'VARCHAR', kind: 'VARCHAR', host: 'VARCHAR',
    vpid: 'INTEGER', vtid: 'INTEGER', topic: 'VARCHAR', src: 'BIGINT',
    ev: 'MAP(VARCHAR, BIGINT)', "start": 'BIGINT', "end": 'BIGINT', msg: 'VARCHAR', cb: 'VARCHAR',
    seen: 'INTEGER', "in": 'VARCHAR', "out": 'VARCHAR', type: 'VARCHAR', annot: 'INTEGER',
    flavour: 'VARCHAR', hosts: 'MAP(VARCHAR, STRUCT(hostname VARCHAR))'
}"""

_REAL_COLUMNS = """{
    k: 'VARCHAR', clock_offset_ns: 'BIGINT', node: 'VARCHAR', kind: 'VARCHAR', name: 'VARCHAR',
    topic: 'VARCHAR', id: 'BIGINT', n: 'BIGINT', cb: 'BIGINT', pid: 'INTEGER', tid: 'INTEGER',
    t0: 'BIGINT', t1: 'BIGINT', causes: 'JSON', accepted: 'BOOLEAN', goal: 'BIGINT',
    call: 'BIGINT'
}"""

_STEPS = {
    "simulated": ("holes", "simulated", "found", "score"),
    "recorded": ("recorded", "found", "score"),
    "real": ("real", "found", "known", "score"),
}


@dataclass(frozen=True)
class Score:
    """How good one kind of rows is.

    Attributes:
        kind: of link (`transport`, `direct`, …), or of row (`publication`, `take`, …); `excused`:
            of the pairs of a message and a subscription, reasons excused for want of events.
        happened: true ones.
        decided: those of them that the trace decides, which must be found.
        found: rows.
        wrong: rows that are not true.
        loss_affected: those of the wrong ones that are matched by time and say that events are
            missing (`is_loss_affected`).
        misguessed: rows that are not true, but say to be one of several possible ones.
        repeated: rows beyond the first for one true link.
        missing: decided, but not found.
        doubted: decided and found, but said to be one of several possible ones.
        precision: share of the rows that are true.
        recall: share of the decided ones that were found.
        labels: right and found rows by method or kind.
    """

    kind: str
    happened: int
    decided: int
    found: int
    wrong: int
    loss_affected: int
    misguessed: int
    repeated: int
    missing: int
    doubted: int
    precision: float
    recall: float
    labels: str


@dataclass(frozen=True)
class Drop:
    """Messages that were not taken, or whose publication is not known: the true reason, if there
    is one, or what became of their events, and the reason that was given.

    `undecided`: why the trace does not decide it; None where it does, so that the one given must be
    right.
    """

    truth: str
    reason: str
    undecided: str | None
    messages: int
    is_right: bool


def compare_simulated(
    database: Path, truth: Mapping[str, Path]
) -> tuple[list[Score], list[Drop] | None]:
    """Compare an ingested simulation with its truth tables.

    Returns the scores, and the reasons of what was not delivered; None if the database has none.
    """
    with _open(database) as connection:
        for name, path in truth.items():
            connection.execute(f"CREATE TEMP VIEW simulated_{name} AS FROM '{path}'")
        scores = _score(connection, "simulated")
        if connection.execute("SELECT count(*) > 0 FROM simulated_cpu_run").fetchone() == (True,):
            connection.execute((_SQL / "schedule.sql").read_text())
            scores += [Score(*row) for row in connection.execute("FROM schedule_score").fetchall()]
        columns = connection.execute(
            "SELECT column_name FROM duckdb_columns() "
            "WHERE database_name = 'analysed' AND schema_name = 'main' "
            "AND table_name = 'stat_delivery'"
        ).fetchall()
        if {("publication_id",), ("subscription_id",), ("status",), ("reason",)} - set(columns):
            return scores, None
        rows = []
        connection.execute((_SQL / "reasons.sql").read_text())
        for name in ("drops", "orphans"):
            rows += connection.execute((_SQL / f"{name}.sql").read_text()).fetchall()
        drops = [Drop(*row) for row in rows]
        excused = sum(drop.messages for drop in drops if drop.undecided == EXCUSE)
        return [*scores, _excused(connection, excused)], drops


def compare_recorded(database: Path, truth: Path) -> list[Score]:
    """Compare an ingested recording with its `truth.jsonl.gz`."""
    with _open(database) as connection:
        connection.execute(
            f"CREATE TEMP VIEW recorded AS FROM read_json('{truth}', "
            f"format = 'newline_delimited', columns = {_RECORDED_COLUMNS})"
        )
        return _score(connection, "recorded")


def compare_real(database: Path, truth: Path) -> list[Score]:
    """Compare a recording of real ROS 2 with the `truth.jsonl.gz` that its nodes wrote."""
    with _open(database) as connection:
        connection.execute(
            f"CREATE TEMP VIEW real AS FROM read_json('{truth}', "
            f"format = 'newline_delimited', columns = {_REAL_COLUMNS})"
        )
        scores = [*_score(connection, "real"), _lost(connection)]
        connection.execute((_SQL / "traced.sql").read_text())
        return scores + [Score(*row) for row in connection.execute("FROM traced_score").fetchall()]


def _open(database: Path) -> duckdb.DuckDBPyConnection:
    connection = duckdb.connect()
    connection.execute(f"ATTACH '{database}' AS analysed (READ_ONLY)")
    return connection


def _excused(connection: duckdb.DuckDBPyConnection, excused: int) -> Score:
    """Reasons that were excused; those beyond what the holes in the trace allow are wrong."""
    connection.execute((_SQL / "excused.sql").read_text())
    ((pairs, allowed),) = connection.execute("SELECT pairs, allowed FROM excused").fetchall()
    wrong = max(excused - allowed, 0)
    precision = 1 - wrong / excused if excused else 1.0
    return Score(
        "excused",
        pairs or 0,
        0,
        excused,
        wrong,
        0,
        0,
        0,
        0,
        0,
        precision,
        1.0,
        f"at most {allowed}",
    )


def _lost(connection: duckdb.DuckDBPyConnection) -> Score:
    """Messages that are called lost; those that were not are wrong."""
    connection.execute((_SQL / "lost.sql").read_text())
    ((found, wrong),) = connection.execute(
        "SELECT count(*), count(*) FILTER (NOT is_lost) FROM lost"
    ).fetchall()
    precision = 1 - wrong / found if found else 1.0
    return Score("lost", found - wrong, 0, found, wrong, 0, 0, 0, 0, 0, precision, 1.0, "")


def _score(connection: duckdb.DuckDBPyConnection, source: str) -> list[Score]:
    for name in _STEPS[source]:
        connection.execute((_SQL / f"{name}.sql").read_text())
    return [Score(*row) for row in connection.execute("FROM score").fetchall()]
