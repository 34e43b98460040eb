"""What users install is complete, and finds its files without a checkout."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = """
import sys
from msgflow.resources import resource_directory
from msgflow.query.catalogue import load_queries
import msgflow
print(msgflow.__file__)
for name in ("schema", "migrations", "queries", "docs"):
    print(resource_directory(name))
assert load_queries()
from msgflow.view.sql_page import examples
assert examples().num_rows
from pathlib import Path
from msgflow.db.migration import create
create(Path(sys.argv[1]))
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built by the build backend itself."""
    directory = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(directory)],
        cwd=ROOT,
        check=True,
        capture_output=True,
    )
    (path,) = directory.glob("*.whl")
    return path


def test_it_fits_every_machine(wheel: Path) -> None:
    assert wheel.name.endswith("-py3-none-any.whl")


def test_it_holds_every_sql_file_and_every_data_file(wheel: Path) -> None:
    held = set(zipfile.ZipFile(wheel).namelist())
    for folder in ("schema", "migrations", "queries"):
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in {".sql", ".py"}:
                assert f"msgflow/_data/{path.relative_to(ROOT).as_posix()}" in held
    for path in (ROOT / "msgflow").rglob("*"):
        if path.is_file() and "__pycache__" not in path.parts:
            assert path.relative_to(ROOT).as_posix() in held
    assert not [name for name in held if name.startswith("tests/") or "__pycache__" in name]


def test_it_works_without_the_checkout(wheel: Path, tmp_path: Path) -> None:
    installed = tmp_path / "site"
    zipfile.ZipFile(wheel).extractall(installed)
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(tmp_path / "new.duckdb")],
        cwd=tmp_path,
        env={"PYTHONPATH": str(installed)},
        check=True,
        capture_output=True,
        text=True,
    )
    assert all(Path(line).is_relative_to(installed) for line in done.stdout.splitlines())
    assert (tmp_path / "new.duckdb").is_file()
