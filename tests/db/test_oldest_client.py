"""Files can be read by other programs that carry an older DuckDB."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from msgflow.db import migration

OLDEST = "1.5.0"

READ = """
import json, sys
import duckdb
con = duckdb.connect(sys.argv[1], read_only=True)
views = con.execute(
    "SELECT view_name FROM duckdb_views() WHERE NOT internal AND schema_name = 'main'"
).fetchall()
for (view,) in views:
    con.execute(f"SELECT * FROM main.{view}").fetchall()
print(json.dumps([duckdb.__version__, len(views)]))
"""


@pytest.fixture(scope="session")
def old_client(tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("client")
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps"]
    done = subprocess.run(
        [*command, "--target", str(target), f"duckdb=={OLDEST}"], capture_output=True, text=True
    )
    if done.returncode != 0:
        pytest.skip(f"duckdb {OLDEST} cannot be installed here")
    return target


@pytest.mark.thorough
def test_every_public_view_can_be_read(old_client: Path, tmp_path: Path) -> None:
    database = tmp_path / "new.duckdb"
    migration.create(database)
    done = subprocess.run(
        [sys.executable, "-c", READ, str(database)],
        env={"PYTHONPATH": str(old_client)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    version, view_count = json.loads(done.stdout)
    assert version == OLDEST
    assert view_count > 30
