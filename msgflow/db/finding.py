"""Findings: what is wrong with a recording, where it comes from, and what to do about it.

`schema/health/finding` holds one finding per file, a query that returns a row for each place where
it holds; its header has title, severity, phase, cause and cure.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow.db import objects

if TYPE_CHECKING:
    from collections.abc import Sequence

    import duckdb

    from msgflow.sql.header import Header

SEVERITIES = ("error", "warning")


@dataclass(frozen=True)
class Finding:
    """Something wrong with the recording, at one place.

    Attributes:
        name: which of `schema/health/finding`.
        severity: 'error' where results are wrong or missing, 'warning' where they may be.
        title: what was found.
        run_id: the run.
        subject: where: a trace, process, host, topic.
        count: how often.
        detail: numbers.
        description: what it means for results.
        cause: where it comes from, as a rule.
        cure: what to do about it.
    """

    name: str
    severity: str
    title: str
    run_id: int
    subject: str
    count: int
    detail: str
    description: str
    cause: str
    cure: str


def find(con: duckdb.DuckDBPyConnection, run_ids: Sequence[int]) -> list[Finding]:
    """Return all findings in these runs: errors first, those of one kind together."""
    headers = sorted(
        objects.load("health/finding"),
        key=lambda header: (SEVERITIES.index(header.severity or "error"), header.name),
    )
    return [finding for header in headers for finding in _findings(con, header, list(run_ids))]


def _findings(con: duckdb.DuckDBPyConnection, header: Header, run_ids: list[int]) -> list[Finding]:
    rows = con.execute(
        f"SELECT run_id, subject, count, detail FROM ({header.body}) "
        "WHERE list_contains(?, run_id) ORDER BY ALL",
        [run_ids],
    ).fetchall()
    return [
        Finding(
            name=header.name.partition(".")[2],
            severity=header.severity or "error",
            title=header.title,
            run_id=run_id,
            subject=subject,
            count=count,
            detail=detail,
            description=header.description,
            cause=header.cause or "",
            cure=header.cure or "",
        )
        for run_id, subject, count, detail in rows
    ]
