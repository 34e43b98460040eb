"""What a newcomer asks first of real recordings, and must not be misled by."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from ingested import made_once
from typer.testing import Result

from msgflow.ingest import ingest

Msgflow = Callable[..., Result]
Rows = list[dict[str, Any]]


@pytest.fixture(scope="session")
def real(shared_traces: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Ingests a recording, once for all tests."""

    def database(name: str) -> Path:
        def make(path: Path) -> None:
            ingest([shared_traces / name], path)

        return made_once(tmp_path_factory, name, make)

    return database


@pytest.fixture
def ask(
    real: Callable[[str], Path], msgflow: Msgflow, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., Result]:
    """Runs a command on a recording in a terminal of so many columns."""

    def run(name: str, *words: str, columns: int = 80) -> Result:
        monkeypatch.setenv("COLUMNS", str(columns))
        monkeypatch.setenv("MSGFLOW_DB", str(real(name)))
        result = msgflow(*words)
        assert result.exit_code == 0, result.output
        return result

    return run


def section(text: str, title: str) -> str:
    """Return a section of `why`."""
    return text.partition(f"{title}\n")[2].partition("\n\n")[0]


@pytest.mark.parametrize("name", ["real_py_mixed", "real_overload", "real_reference"])
def test_the_way_of_a_message_is_the_work_of_no_node(ask: Msgflow, name: str) -> None:
    """All commands say so of the time in which the reader was not busy."""
    found = json.loads(ask(name, "why", "--format", "json").stdout)
    parts = json.loads(ask(name, "query", "path-breakdown", "--format", "json").stdout)
    pieces: Rows = []
    for detail in ("short", "full"):
        words = ("query", "critical-path", "--slowest", "20", "--detail", detail)
        pieces += json.loads(ask(name, *words, "--format", "json").stdout)
    rows = [(row["part"], row["node"]) for row in found["nodes"] + parts]
    rows += [(row["activity"], row["node"]) for row in found["slowest_flow"] + pieces]
    on_the_way = Counter(node for part, node in rows if part == "network_or_idle")
    assert set(on_the_way) == {"between nodes"}, on_the_way
    assert all(part == "network_or_idle" for part, node in rows if node == "between nodes")
    by_node = {row["node"]: row["total_ns"] for row in found["nodes"]}
    path = found["paths"][0]["path"]
    assert by_node["between nodes"] == sum(
        row["total_ns"] for row in parts if row["path"] == path and row["part"] == "network_or_idle"
    )


@pytest.mark.parametrize("columns", [80, 100])
def test_why_keeps_its_columns(ask: Msgflow, columns: int) -> None:
    paths = section(ask("real_overload", "why", columns=columns).stdout, "PATHS")
    assert paths.splitlines()[0].split() == [
        "path", "reached", "roots", "median", "p95", "max", "reasons",
    ]  # fmt: skip
    assert "overwritten 438" in paths
    for name in ("real_py_mixed", "real_overload", "real_reference", "real_container"):
        shown = ask(name, "why", columns=columns).stdout
        titles = section(shown, "TIME BY NODE, ON PATH 1").splitlines()[0].split()
        assert titles == ["node", "share", "part", "what", "median", "max"]
        titles = section(shown, "ITS SLOWEST FLOW").splitlines()[1].split()
        assert titles == ["at", "duration", "share", "activity", "node", "what"]
        assert "── 1 ──" not in shown
