"""`Database.why` on systems of golden cases."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import duckdb
import pytest
from golden import fill_case

import msgflow
from msgflow.errors import UsageError

CASES = Path(__file__).parent / "cases"
PATHS = {path.relative_to(CASES).as_posix(): path for path in CASES.glob("*/*.case")}


def why(database: Path, case: Path) -> msgflow.Explanation | None:
    with duckdb.connect(str(database)) as connection:
        fill_case(connection, case)
    with msgflow.open_db(database) as db, suppress(UsageError):
        return db.why(run=1)
    return None


def test_a_path_may_pass_services(fresh_database: Path) -> None:
    found = why(fresh_database, CASES / "critical-path" / "services.case")
    assert found is not None
    path = found.paths.table["path"][0].as_py()
    assert " → (/" in path
    assert set(found.slow_flow.table["path"].to_pylist()) <= {path, None}
    assert found.slow_flow.table["duration_ns"].to_pylist()


@pytest.mark.thorough
@pytest.mark.parametrize("name", PATHS)
def test_every_system_is_explained_or_has_no_flow(name: str, fresh_database: Path) -> None:
    found = why(fresh_database, PATHS[name])
    if found is not None:
        assert None not in found.verdict.table["sentence"].to_pylist()
