"""`msgflow simulate`, by the entry point of this distribution."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import metadata
from inspect import getdoc
from pathlib import Path

import pytest
from rich.cells import cell_len
from typer.testing import Result

import msgflow_simulate

Msgflow = Callable[..., Result]


def test_the_help_begins_with_the_summary_of_the_distribution() -> None:
    summary = metadata("ros2-msgflow-sim")["Summary"]
    assert (getdoc(msgflow_simulate.command) or "").startswith(summary)


def test_it_is_the_last_in_the_help_of_all(msgflow: Msgflow) -> None:
    listed = [line.split()[0] for line in msgflow().stdout.splitlines() if line.startswith("  ")]
    assert "simulate" in listed[listed.index("mcp") :]


def test_its_help_fits_two_screens(msgflow: Msgflow, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    result = msgflow("simulate", "--help")
    lines = result.stdout.splitlines()
    assert result.exit_code == 0
    assert result.stderr == ""
    assert "Usage: msgflow simulate" in lines[0]
    assert len(lines) <= 80
    assert max(map(cell_len, lines)) <= 80


@pytest.mark.parametrize(
    ("arguments", "error", "hint"),
    [
        (("nothing", "-o", "out"), "nothing", ""),
        (
            ("pipeline", "-o", "out", "--layout", "turtle"),
            "layout — turtle",
            "galactic",
        ),
        (
            ("pipeline", "-o", "out", "--pause", "2", "1"),
            "must end after",
            "begin first",
        ),
        (
            ("pipeline", "-o", "out", "--dual-session"),
            "needs a late start",
            "session starts",
        ),
    ],
)
def test_usage_errors(msgflow: Msgflow, arguments: tuple[str, ...], error: str, hint: str) -> None:
    result = msgflow("simulate", *arguments)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr.startswith("error: ")
    assert error in result.stderr
    assert hint in result.stderr.partition("\n\nhint: ")[2]


def test_simulate(msgflow: Msgflow) -> None:
    result = msgflow("simulate", "pipeline", "-o", "out", "--factor", 0.02)
    assert result.exit_code == 0
    assert result.stdout == ""
    assert result.stderr.startswith("1 trace, ")
    assert list(Path("out").rglob("metadata"))


def test_simulate_into_a_folder_of_the_name_of_the_system(msgflow: Msgflow) -> None:
    result = msgflow("simulate", "pipeline", "--factor", 0.02)
    assert result.exit_code == 0
    assert result.stderr.endswith(" written to pipeline\n")
    assert list(Path("pipeline").rglob("metadata"))


def test_perf_records_the_kernel_if_asked(msgflow: Msgflow) -> None:
    msgflow("simulate", "cpu_hog", "-o", "out", "--factor", 0.02, "--perf")
    assert (Path("out/robot/perf/metadata")).exists()


def test_simulate_a_layout_and_a_recording_with_faults(msgflow: Msgflow) -> None:
    arguments = ("--factor", 0.03, "--layout", "humble-fastdds", "--start-late", 0.05)
    result = msgflow(
        "simulate",
        "pipeline",
        "-o",
        "out",
        *arguments,
        "--pause",
        0.1,
        0.15,
        "--rotate",
        0.2,
        "--rotate",
        0.25,
        "--lose-events",
        0.1,
        "--lose-packets",
        0.1,
        "--per-process",
        "--cut",
        1,
        "--slew",
        20,
    )
    assert result.exit_code == 0, result.stderr
    # Three processes in three chunks each.
    assert result.stderr.startswith("9 traces, ")
    assert len(list(Path("out").glob("alpha/archives/*/ust/pid/*/metadata"))) == 9
    counts = msgflow("events", "out", "--count").stdout
    assert "dds:write_pre" in counts
    assert "rcl_init" not in counts


def test_simulate_lists_the_systems(msgflow: Msgflow) -> None:
    lines = msgflow("simulate", "--list").stdout.splitlines()
    names = [line.split()[0] for line in lines]
    assert {"pipeline", "demo", "intra_process", "restarts", "services"} < set(names)
    assert all(len(line.split()) > 4 for line in lines)
