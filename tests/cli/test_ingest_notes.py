"""What msgflow ingest prints of the findings of a new run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

from msgflow.db.finding import Finding
from msgflow.ingest import IngestReport

Msgflow = Callable[..., Result]


def finding(name: str, count: int, subject: str, **more: object) -> Finding:
    values: dict[str, object] = {
        "run_id": 1, "trace_id": None, "phase": "recording", "severity": "warning",
        "detail": "numbers", "cause": "", "cure": "", "title": "", "description": "",
    }  # fmt: skip
    return Finding(name=name, count=count, subject=subject, **{**values, **more})  # type: ignore[arg-type]


def test_errors_and_warnings_are_printed_and_many_places_are_cut(
    msgflow: Msgflow, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    findings = (
        finding("lost_packets", 3, "robot/ust", trace_id=1, severity="error"),
        finding("ignored_nothing", 1, "the input", phase="input"),
        *(finding("started_late", n, f"node {n} on robot") for n in range(12)),
        finding("open_callback", 4, "robot/ust", severity="info"),
    )
    report = IngestReport(1, "night", findings, 9, {"reading": 1.0})
    monkeypatch.setattr("msgflow.ingest.ingest", lambda *_, **__: report)
    lines = msgflow("ingest", tmp_path, "--db", tmp_path / "x.duckdb").stderr.splitlines()
    assert [line for line in lines if line.startswith("note: ")] == [
        "note: lost_packets (3): robot/ust — numbers",
        "note: ignored_nothing (1): numbers",
        *(f"note: started_late ({n}): node {n} on robot — numbers" for n in range(10)),
        "note: started_late: 2 more places: msgflow check",
    ]
