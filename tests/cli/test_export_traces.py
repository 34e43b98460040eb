"""`msgflow export otlp` and `msgflow export mcap` as commands."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Msgflow = Callable[..., Any]


@pytest.fixture
def demo(simulated: Callable[..., Path]) -> Path:
    return simulated("demo", 0.1)


def test_traces_are_counted(msgflow: Msgflow, demo: Path) -> None:
    result = msgflow("export", "otlp", "--slowest", 1, "--db", demo)
    assert result.exit_code == 0
    assert "1 trace, " in result.stderr
    assert "written to msgflow-traces.json" in result.stderr
    assert len(Path("msgflow-traces.json").read_text().splitlines()) == 1


@pytest.mark.thorough
def test_several_places_may_be_given(msgflow: Msgflow, demo: Path) -> None:
    both = ("--from", "/imu/data", "--from", "/camera/image")
    result = msgflow("export", "otlp", *both, "--db", demo)
    one = msgflow("export", "otlp", *both[2:], "--db", demo)
    assert result.exit_code == one.exit_code == 0
    assert result.stderr != one.stderr


def test_who_would_send_traces_learns_what_sends_a_file(msgflow: Msgflow, demo: Path) -> None:
    result = msgflow("export", "otlp", "--endpoint", "http://localhost:4318", "--db", demo)
    assert result.exit_code == 2
    assert "no such option: --endpoint" in result.stderr
    assert "a collector sends it on (docs/export.md)" in result.stderr


def test_values_and_warnings_are_counted(msgflow: Msgflow, demo: Path) -> None:
    pytest.importorskip("mcap_ros2")
    result = msgflow("export", "mcap", "-o", "run.mcap", "--db", demo)
    assert result.exit_code == 0
    assert " values of " in result.stderr
    assert "written to run.mcap" in result.stderr
    assert Path("run.mcap").read_bytes().startswith(b"\x89MCAP")
