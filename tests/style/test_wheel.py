"""What users install is complete, and finds its files without a checkout."""

from __future__ import annotations

import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = """
import sys
from msgflow.files.resources import resource_directory
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


def build(project: Path, directory: Path) -> tuple[Path, Path]:
    """Have the build backend itself make the wheel and the sources of a project."""
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-d", str(directory)],
        cwd=project,
        check=True,
        capture_output=True,
    )
    (wheel,), (sources,) = directory.glob("*.whl"), directory.glob("*.tar.gz")
    return wheel, sources


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The wheel and the sources of msgflow."""
    return build(ROOT, tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def wheel(built: tuple[Path, Path]) -> Path:
    """The wheel of msgflow."""
    return built[0]


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


def names(sources: Path) -> set[str]:
    """Return what lies in the folder of an archive of sources."""
    with tarfile.open(sources) as archive:
        return {name.partition("/")[2] for name in archive.getnames()}


def test_the_simulator_is_in_the_sources_only(built: tuple[Path, Path]) -> None:
    """The tests, which are there too, need it."""
    wheel, sources = built
    held = zipfile.ZipFile(wheel).namelist()
    assert not [name for name in held if "simulator" in name or "msgflow_sim" in name]
    assert {"Makefile", "simulator/pyproject.toml"} <= names(sources)


def test_the_simulator_is_in_a_wheel_of_its_own(tmp_path: Path) -> None:
    wheel, sources = build(ROOT / "simulator", tmp_path)
    held = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    code = (ROOT / "simulator" / "msgflow_sim").rglob("*")
    assert held == {"msgflow_simulate.py"} | {
        path.relative_to(ROOT / "simulator").as_posix()
        for path in code
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert held | {"LICENSE", "README.md", "tests/test_command.py"} <= names(sources)
