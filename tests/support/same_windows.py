"""Windows of a recording that is watched, compared with an ingest of the whole."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from msgflow.database import Database
from msgflow.watch.window_report import WindowReport

Row = dict[str, Any]


def by_path(rows: Sequence[Row]) -> dict[str, Row]:
    """Return the rows of paths with roots: others say that nothing happened."""
    return {row["path"]: as_shown(row) for row in rows if row["roots"]}


def as_shown(row: Row) -> Row:
    """Return a row with its reasons as an object: Arrow has the entries of a map as a list."""
    reasons = {"reasons": dict(row["reasons"] or {})} if "reasons" in row else {}
    return row | reasons


def require_equal(database: Database, report: WindowReport) -> None:
    """Require that a window has the numbers that the whole has for its time."""
    expected = by_path(_asked(database, "e2e-latency", report))
    found = by_path(report.paths)
    assert found.keys() == expected.keys()
    for path, row in found.items():
        assert row == {name: expected[path][name] for name in row}
    executors = _asked(database, "executor-usage", report)
    assert Counter((row["tid"], row["callbacks"], row["callback_ns"]) for row in executors) == (
        Counter((row["tid"], row["callbacks"], row["callback_ns"]) for row in report.executors)
    )
    topics = {row["topic_name"]: row for row in _asked(database, "topics-summary", report)}
    for shown in report.topics:
        row = as_shown(topics[shown["topic"]] | {"topic": shown["topic"]})
        assert as_shown(shown) == {name: row[name] for name in shown}
    losses = _asked(database, "topics-delivery", report)
    assert [(row["topic"], row["dropped"], row["lost"]) for row in report.losses] == [
        (row["topic_name"], row["dropped"], row["lost"])
        for row in losses
        if row["dropped"] or row["lost"]
    ]


def require_same_as_whole(found: Sequence[WindowReport], database: Path) -> None:
    """Require that each window has the numbers of the whole, and each root is counted once.

    Args:
        found: windows that follow each other, of all of a recording.
        database: one of its ingest as a whole.
    """
    assert len(found) > 2
    roots: Counter[str] = Counter()
    with Database(database) as whole:
        for report in found:
            require_equal(whole, report)
            roots.update({row["path"]: row["roots"] for row in report.paths})
        rows = whole.query("e2e-latency").to_arrow().to_pylist()
    assert +roots == Counter({row["path"]: row["roots"] for row in rows if row["roots"]})


def _asked(database: Database, query: str, report: WindowReport) -> list[Row]:
    window = report.window
    result = database.query(query, start=window.start_ns, end=window.end_ns)
    rows: list[Row] = result.to_arrow().to_pylist()
    return rows
