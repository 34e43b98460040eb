"""What msgflow ingest prints of the findings of a new run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

from msgflow.db.finding import Finding
from msgflow.ingest import IngestReport
from msgflow.ingest.recordings import Recording

Msgflow = Callable[..., Result]


def finding(name: str, count: int, subject: str, **more: object) -> Finding:
    values: dict[str, object] = {
        "run_id": 1,
        "trace_id": None,
        "phase": "recording",
        "severity": "warning",
        "detail": "numbers",
        "cause": "",
        "cure": "",
        "title": "",
        "description": "",
    }
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
    said = msgflow("ingest", tmp_path, "--together", "--db", tmp_path / "x.duckdb").stderr
    lines = said.splitlines()
    assert [line for line in lines if line.startswith("note: ")] == [
        "note: lost_packets (3): robot/ust — numbers",
        "note: ignored_nothing (1): the input — numbers",
        *(f"note: started_late ({n}): node {n} on robot — numbers" for n in range(10)),
        "note: started_late: 2 more places: msgflow check",
    ]


def test_recordings_of_different_times_are_runs_of_their_own(
    msgflow: Msgflow, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = []
    wrong: list[Finding] = []

    def ingest(paths: object, *_: object, **__: object) -> IngestReport:
        given.append(paths)
        return IngestReport(len(given), f"run{len(given)}", tuple(wrong), 9, {"reading": 1.0})

    recordings = [Recording([tmp_path / name], {}) for name in ("a", "b")]
    monkeypatch.setattr("msgflow.ingest.ingest", ingest)
    monkeypatch.setattr("msgflow.ingest.recordings.find_recordings", lambda *_, **__: recordings)
    database = ("--db", tmp_path / "x.duckdb")
    said = msgflow("ingest", tmp_path, *database).stderr.splitlines()
    assert said[0] == (
        "note: 2 recordings, whose times do not overlap, become as many runs: --together makes one"
    )
    assert ["as run run1 (1)" in said[1], "as run run2 (2)" in said[2]] == [True, True]
    every = f"--run all --db {tmp_path / 'x.duckdb'}"
    assert said[-1] == f"next: msgflow query e2e-latency {every}"
    assert msgflow("ingest", tmp_path, *database, "--quiet").stderr == ""
    for option in ("--name", "--keep-staging"):
        refused = msgflow("ingest", tmp_path, *database, option, "x")
        assert refused.exit_code == 2
        assert f"{option} is for one run" in refused.stderr
    assert given == [[tmp_path / "a"], [tmp_path / "b"]] * 2
    wrong.append(finding("lost_packets", 3, "robot/ust", trace_id=1))
    said = msgflow("ingest", tmp_path, *database).stderr.splitlines()
    assert said[-1] == f"next: msgflow check {every}"
    given.clear()
    for options in (["--together"], ["--clock-sync", "messages"]):
        assert msgflow("ingest", tmp_path, *database, *options).exit_code == 0
    assert given == [[str(tmp_path)]] * 2
