from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
from lakes import copied

from msgflow import Database
from msgflow.fleet.lake import Lake
from msgflow.fleet.part import Content, write_part
from msgflow.ingest import ingest
from msgflow_sim import simulate

_LENGTH = 0.05
COPY = "c" * 20


@pytest.fixture(scope="session")
def databases(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Two databases with one run each, of the recordings r0 and r1 in a folder beside them."""
    directory = tmp_path_factory.mktemp("databases")
    paths = []
    for name, scenario in (("first", "pipeline"), ("second", "two_hosts")):
        recording = directory / "recordings" / f"r{len(paths)}"
        simulate(scenario, recording, factor=_LENGTH, seed=len(paths))
        paths.append(directory / f"{name}.duckdb")
        ingest([recording], paths[-1], name=name)
    return paths[0], paths[1]


@pytest.fixture(scope="session")
def written(
    databases: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, dict[str, Any], dict[str, Any]]:
    """A lake with all files of both, and what `run` is to have of each, without a commit."""
    folder = tmp_path_factory.mktemp("written")
    lake = Lake.open_or_create(folder / "lake")
    parts = []
    for database in databases:
        with Database(database) as opened:
            content = Content(views=True)
            parts.append(write_part(opened.connection, database, lake.store, folder, content))
    return folder / "lake", parts[0], parts[1]


@pytest.fixture(scope="session")
def night(
    written: tuple[Path, dict[str, Any], dict[str, Any]], tmp_path_factory: pytest.TempPathFactory
) -> Lake:
    """A lake of three runs, not to be changed: both databases, and the first once more.

    The copy has a key of its own, and takes twice as long for its flows; it has no views.
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
