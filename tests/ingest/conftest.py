from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_trace
from support.ingested import made_once

from msgflow.ingest import ingest
from msgflow_sim import simulate

_LENGTH = 0.01


@pytest.fixture(scope="session")
def _ingested(tmp_path_factory: pytest.TempPathFactory) -> Path:
    def make(path: Path) -> None:
        ingest([simulate("pipeline", _trace_of(path, "robot"), factor=_LENGTH).directory], path)

    return made_once(tmp_path_factory, "ingested", make)


def _trace_of(database: Path, name: str) -> Path:
    return database.parent / "traces" / name


@pytest.fixture(scope="session")
def trace(_ingested: Path) -> Path:
    """A very short trace, below a directory named robot."""
    return _trace_of(_ingested, "robot")


@pytest.fixture(scope="session")
def other_trace(_both: Path) -> Path:
    """Another one, of two hosts."""
    return _trace_of(_both, "pair")


@pytest.fixture
def database(_ingested: Path, tmp_path: Path) -> Path:
    """A database with `trace` as run 1, alone in its directory."""
    path = tmp_path / "db" / "msgflow.duckdb"
    path.parent.mkdir()
    shutil.copyfile(_ingested, path)
    return path


@pytest.fixture(scope="session")
def _both(_ingested: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    def make(path: Path) -> None:
        shutil.copyfile(_ingested, path)
        pair = simulate("two_hosts", _trace_of(path, "pair"), factor=_LENGTH, seed=1)
        ingest([pair.directory], path)

    return made_once(tmp_path_factory, "both", make)


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
