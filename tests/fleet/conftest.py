from __future__ import annotations

import pickle
import shutil
from pathlib import Path
from typing import Any

import pytest
from support.ingested import made_once
from support.lakes import copied

from msgflow import Database
from msgflow.fleet.lake import Lake
from msgflow.fleet.part import write_part
from msgflow.ingest import ingest
from msgflow_sim import simulate

_LENGTH = 0.05
COPY = "c" * 20


@pytest.fixture(scope="session")
def databases(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Two databases with one run each, of the recordings r0 and r1 in a folder beside them."""
    names = "first", "second"

    def make(path: Path) -> None:
        for number, scenario in enumerate(("pipeline", "two_hosts")):
            recording = path.parent / "recordings" / f"r{number}"
            simulate(scenario, recording, factor=_LENGTH, seed=number)
            ingest([recording], path.parent / f"{names[number]}.duckdb", name=names[number])

    directory = made_once(tmp_path_factory, "fleet", make).parent
    return directory / f"{names[0]}.duckdb", directory / f"{names[1]}.duckdb"


@pytest.fixture(scope="session")
def written(
    databases: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, dict[str, Any], dict[str, Any]]:
    """A lake with all files of both, and what `run` is to have of each, without a commit."""

    def make(path: Path) -> None:
        lake = Lake.open(path.parent / "lake", create=True)
        parts = []
        for database in databases:
            with Database(database) as opened:
                folder = path.parent
                parts.append(write_part(opened.connection, database, lake.store, folder))
        (path.parent / "parts").write_bytes(pickle.dumps(parts))

    folder = made_once(tmp_path_factory, "written", make).parent
    first, second = pickle.loads((folder / "parts").read_bytes())
    return folder / "lake", first, second


@pytest.fixture(scope="session")
def night(
    written: tuple[Path, dict[str, Any], dict[str, Any]], tmp_path_factory: pytest.TempPathFactory
) -> Lake:
    """A lake of three runs, not to be changed: both databases, and the first once more.

    The copy has a key of its own, and takes twice as long for its flows; it has no database.
    """
    place, *parts = written
    lake = Lake.open(shutil.copytree(place, tmp_path_factory.mktemp("night") / "lake"))
    labels = ({"robot": "r1", "software_version": "1.0"}, {"robot": "r2", "soft-ware": "a'b"})
    rows = [
        {**part, "labels": given, "source": f"/recordings/{part['name']}"}
        for part, given in zip(parts, labels, strict=True)
    ]
    copy = copied(lake, rows[0], COPY, slower=2) | {
        "name": "copy",
        "labels": {"robot": "r1", "software_version": "1.1"},
    }
    lake.commit([*rows, copy])
    return lake
