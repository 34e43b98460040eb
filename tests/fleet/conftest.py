from __future__ import annotations

from pathlib import Path

import pytest

from msgflow.ingest import ingest
from msgflow.sim import simulate

_LENGTH = 0.05


@pytest.fixture(scope="session")
def databases(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Two databases with one run each, of two recordings."""
    directory = tmp_path_factory.mktemp("databases")
    paths = []
    for name, scenario in (("first", "pipeline"), ("second", "two_hosts")):
        trace = simulate(scenario, directory / name, factor=_LENGTH, seed=len(paths))
        paths.append(directory / f"{name}.duckdb")
        ingest([trace.directory], paths[-1])
    return paths[0], paths[1]
