from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from ctf_writer import Event, Packet, TraceContent, write_trace

from msgflow.ingest import ingest
from msgflow_sim import simulate

_LENGTH = 0.01


@pytest.fixture(scope="session")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A very short trace, below a directory named robot."""
    return simulate(
        "pipeline", tmp_path_factory.mktemp("trace") / "robot", factor=_LENGTH
    ).directory


@pytest.fixture(scope="session")
def other_trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Another one, of two hosts."""
    return simulate(
        "two_hosts", tmp_path_factory.mktemp("trace") / "pair", factor=_LENGTH, seed=1
    ).directory


@pytest.fixture(scope="session")
def _ingested(trace: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ingested") / "msgflow.duckdb"
    ingest([trace], path)
    return path


@pytest.fixture
def database(_ingested: Path, tmp_path: Path) -> Path:
    """A database with `trace` as run 1, alone in its directory."""
    path = tmp_path / "db" / "msgflow.duckdb"
    path.parent.mkdir()
    shutil.copyfile(_ingested, path)
    return path


@pytest.fixture(scope="session")
def _both(_ingested: Path, other_trace: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("both") / "msgflow.duckdb"
    shutil.copyfile(_ingested, path)
    ingest([other_trace], path)
    return path


@pytest.fixture
def both(_both: Path, tmp_path: Path) -> Path:
    """A database with `trace` as run 1, and `other_trace` as run 2."""
    return Path(shutil.copy(_both, tmp_path / "both.duckdb"))


@pytest.fixture
def new_database(tmp_path: Path) -> Path:
    """A place for a database, alone in its directory."""
    path = tmp_path / "new" / "msgflow.duckdb"
    path.parent.mkdir()
    return path


@pytest.fixture
def make_trace(tmp_path: Path) -> Any:
    """Writes a trace of any events, all of one thread."""

    def make(
        fields: dict[str, dict[str, str]],
        events: Sequence[tuple[str, Sequence[Any]]] = (),
        *,
        name: str = "trace",
        **content: Any,
    ) -> Path:
        made = [
            Event(1_000 + 10 * number, event, values, **_context(content))
            for number, (event, values) in enumerate(events)
        ]
        return write_trace(
            tmp_path / name, TraceContent(fields, {0: [Packet(made, begin=1_000)]}, **content)
        )

    return make


def _context(content: dict[str, Any]) -> dict[str, Any]:
    contexts = content.get("contexts")
    values = {"vpid": 100, "vtid": 101, "procname": b"main"}
    return {} if contexts is None else {"context": [values[key] for key in contexts]}
