from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import duckdb
import pytest


@pytest.fixture(scope="module")
def bench(empty_database: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database for one set of clocks after the other: roll back what you do."""
    path = tmp_path_factory.mktemp("clocks") / "bench.duckdb"
    path.write_bytes(empty_database.read_bytes())
    return path


@pytest.fixture
def connection(bench: Path) -> Iterator[duckdb.DuckDBPyConnection]:
    """A connection without a run."""
    with duckdb.connect(str(bench)) as opened:
        yield opened
