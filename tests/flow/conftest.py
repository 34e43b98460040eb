from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from analysis import Analysis


@pytest.fixture(scope="session")
def analysis(empty_database: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Analysis]:
    """A database for one system after the other."""
    bench = Analysis(empty_database, tmp_path_factory.mktemp("analysis"))
    yield bench
    bench.close()
