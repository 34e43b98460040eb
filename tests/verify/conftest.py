"""A database whose values are known from the golden cases of the queries."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import duckdb
import pytest
from support.golden import SYSTEMS, fill, fill_case

from msgflow.database import Database
from msgflow.db.derivation import derive
from msgflow.verify.verify import Verification


@pytest.fixture(scope="session")
def _system(empty_database: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = Path(shutil.copy(empty_database, tmp_path_factory.mktemp("system") / "msgflow.duckdb"))
    with duckdb.connect(str(path)) as connection:
        fill(connection)
        connection.execute((SYSTEMS / "many_messages.sql").read_text())
        derive(connection, 1)
    return path


@pytest.fixture
def system(_system: Path, tmp_path: Path) -> Path:
    """A copy, to change it."""
    path = tmp_path / "msgflow.duckdb"
    shutil.copyfile(_system, path)
    return path


@pytest.fixture
def goals(empty_database: Path, tmp_path: Path) -> Path:
    """A database with goals of an action."""
    path = Path(shutil.copy(empty_database, tmp_path / "goals.duckdb"))
    with duckdb.connect(str(path)) as connection:
        fill(connection)
        connection.execute((SYSTEMS / "many_goals.sql").read_text())
    return path


@pytest.fixture
def traced(empty_database: Path, tmp_path: Path) -> Path:
    """A database with callbacks that the kernel's trace covers."""
    path = Path(shutil.copy(empty_database, tmp_path / "traced.duckdb"))
    cases = Path(__file__).parents[1] / "query" / "cases"
    with duckdb.connect(str(path)) as connection:
        fill_case(connection, cases / "callbacks" / "traced_by_the_kernel.case")
        connection.execute(
            "INSERT INTO store.thread_state BY NAME SELECT 1 AS run_id, 1 AS thread_id, "
            "100 AS start_ns, 130 AS end_ns, 'runnable' AS state, false AS is_loss_affected"
        )
    return path


@pytest.fixture
def overwritten(empty_database: Path, tmp_path: Path) -> Path:
    """A database with a queue that is full now and then."""
    path = Path(shutil.copy(empty_database, tmp_path / "overwritten.duckdb"))
    cases = Path(__file__).parents[1] / "query" / "cases"
    with duckdb.connect(str(path)) as connection:
        fill_case(connection, cases / "e2e-latency" / "lost_and_edge.case")
    return path


@pytest.fixture
def check(system: Path, tmp_path: Path) -> Callable[..., Verification]:
    """Verifies the text of a file of requirements, on `system` or another database."""

    def verify(text: str, path: Path = system) -> Verification:
        targets = tmp_path / "targets.yaml"
        targets.write_text(text, encoding="utf-8")
        with Database(path) as database:
            return database.verify(targets)

    return verify
