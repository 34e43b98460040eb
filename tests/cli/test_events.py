"""`msgflow events`, and archives on the command line."""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from typer.testing import Result

from msgflow_sim import simulate

Msgflow = Callable[..., Result]


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short trace of a pipeline."""
    return simulate("pipeline", tmp_path_factory.mktemp("trace") / "robot", factor=0.1).directory


def test_lists_events_as_text(msgflow: Msgflow, trace: Path) -> None:
    result = msgflow("events", trace, "--event", "ros2:rcl_publish", "-e", "ros2:rcl_node_init")
    assert (result.exit_code, result.stderr) == (0, "")
    lines = result.stdout.splitlines()
    assert lines == sorted(lines)
    assert {line.split()[4] for line in lines} == {"ros2:rcl_publish", "ros2:rcl_node_init"}
    assert "publisher_handle=0x" in lines[-1]
    assert not Path("msgflow.duckdb").exists()


def test_counts_agree_with_the_listing(msgflow: Msgflow, trace: Path) -> None:
    table = msgflow("events", trace, "--count").stdout
    assert table.split()[:2] == ["name", "event_count"]
    counts = json.loads(msgflow("events", trace, "--count", "--format", "json").stdout)
    listed = msgflow("events", trace, "--format", "jsonl").stdout.splitlines()
    assert sum(row["event_count"] for row in counts) == len(listed)
    assert [json.loads(line)["event_id"] for line in listed] == list(range(len(listed)))


@pytest.mark.thorough
def test_the_suffix_chooses_the_format(msgflow: Msgflow, trace: Path) -> None:
    expected = [
        json.loads(x) for x in msgflow("events", trace, "--format=jsonl").stdout.split("\n")[:-1]
    ]
    for name in ("e.json", "e.jsonl", "e.csv", "e.parquet", "e.txt"):
        result = msgflow("events", trace, "-o", name)
        assert result.stdout == ""
        assert result.stderr == f"{len(expected):,} events written to {name}\n"
    assert json.loads(Path("e.json").read_text()) == expected
    assert Path("e.txt").read_text() == msgflow("events", trace).stdout
    assert pq.read_table("e.parquet").num_rows == len(expected)
    ids = [int(row["event_id"]) for row in csv.DictReader(io.StringIO(Path("e.csv").read_text()))]
    assert ids == [event["event_id"] for event in expected]


def test_a_suffix_of_no_format_is_refused(msgflow: Msgflow, trace: Path) -> None:
    for name in ("e.xlsx", "e.xyz"):
        refused = msgflow("events", trace, "-o", name)
        assert (refused.exit_code, refused.stdout) == (2, "")
        assert f"error: no format has this suffix — {name}" in refused.stderr
        assert "hint: end it with .txt, .json, .jsonl, .csv, .parquet" in refused.stderr
        assert not Path(name).exists()
    assert msgflow("events", trace, "-o", "e.log", "--format", "text").exit_code == 0
    assert Path("e.log").read_text() == msgflow("events", trace).stdout


def test_a_directory_gets_a_file_per_event(msgflow: Msgflow, trace: Path) -> None:
    assert msgflow("events", trace, "-o", "out").exit_code == 0
    assert "ros2.rcl_publish.parquet" in os.listdir("out")
    assert msgflow("events", trace, "-o", "texts", "--format", "csv").exit_code == 0
    assert "ros2.rcl_publish.csv" in os.listdir("texts")
    again = msgflow("events", trace, "-o", "out")
    assert (again.exit_code, "the directory is not empty" in again.stderr) == (2, True)
    text = msgflow("events", trace, "-o", "out", "--format", "json")
    assert text.exit_code == 2
    assert "hint: name a file: -o out/events.json" in text.stderr


def test_errors(msgflow: Msgflow, trace: Path) -> None:
    missing = msgflow("events", "nowhere")
    assert (missing.exit_code, missing.stdout) == (3, "")
    unknown = msgflow("events", trace, "--event", "ros2:nothing")
    assert unknown.exit_code == 2
    assert "--count" in unknown.stderr
    empty = msgflow("events", trace, "--start", "1h")
    assert (empty.exit_code, empty.stdout, empty.stderr) == (0, "", "note: no events\n")


@pytest.mark.thorough
def test_an_archive_is_ingested_under_its_name(
    msgflow: Msgflow, trace: Path, tmp_path: Path
) -> None:
    archive = Path(shutil.make_archive(str(tmp_path / "monday"), "gztar", trace.parent, trace.name))
    listed = msgflow("events", archive)
    assert listed.stdout == msgflow("events", trace).stdout
    result = msgflow("ingest", archive, "--host", f"other={archive}")
    assert result.exit_code == 0, result.stderr
    assert "as run monday (1)" in result.stderr
    rows = json.loads(msgflow("sql", "SELECT path FROM trace", "--format", "json").stdout)
    assert rows
    assert all(row["path"].startswith(f"{archive}/robot") for row in rows)
    assert '"other"' in msgflow("sql", "SELECT hostname FROM host", "--format", "csv").stdout


def command(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "msgflow", "events", *map(str, arguments)]


@pytest.mark.thorough
def test_a_reader_that_goes_away_is_no_error(trace: Path) -> None:
    process = subprocess.Popen(command(trace), stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.readline()
    process.stdout.close()
    errors = process.stderr.read()
    process.stderr.close()
    assert (process.wait(timeout=30), errors) == (0, b"")


@pytest.mark.thorough
def test_an_interrupt_removes_what_was_unpacked(trace: Path, tmp_path: Path) -> None:
    archive = shutil.make_archive(str(tmp_path / "packed"), "tar", trace.parent, trace.name)
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    process = subprocess.Popen(
        command(archive),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=os.environ | {"TMPDIR": str(temporary)},
    )
    try:
        # Its output fills the pipe, so that it waits with everything unpacked.
        deadline = time.monotonic() + 20
        while not list(temporary.glob("*/*/*")) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert process.stdout is not None
        process.stdout.read(1)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=20)
    finally:
        process.kill()
    assert (process.returncode, errors) == (130, b"error: interrupted\n")
    assert list(temporary.iterdir()) == []
