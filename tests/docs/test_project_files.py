"""What other programs read of the project says the same as the project."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

from ruamel.yaml import YAML

from msgflow.backports import tomllib
from msgflow.version import __version__

ROOT = Path(__file__).resolve().parents[2]


def test_one_version_everywhere() -> None:
    cited = YAML(typ="safe").load(ROOT / "CITATION.cff")
    package = ElementTree.parse(ROOT / "packaging" / "colcon" / "package.xml")
    assert cited["version"] == package.findtext("version") == __version__
    simulator = tomllib.loads((ROOT / "simulator" / "pyproject.toml").read_text("utf-8"))["project"]
    assert simulator["version"] == __version__
    assert f"ros2-msgflow=={__version__}" in simulator["dependencies"]


def test_workflows_have_the_oldest_python_and_duckdb() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    tests = YAML(typ="safe").load(ROOT / ".github" / "workflows" / "tests.yml")["jobs"]["tests"]
    matrix = tests["strategy"]["matrix"]
    (oldest,) = (row for row in matrix["include"] if row["duckdb"] == "oldest")
    assert f">={oldest['python']}" == project["requires-python"]
    # The newest DuckDB has no wheel for it.
    assert matrix["python"][0] == "3.11"


def test_the_oldest_duckdb_is_found() -> None:
    """The workflow takes it from pyproject.toml with sed."""
    workflow = (ROOT / ".github" / "workflows" / "tests.yml").read_text(encoding="utf-8")
    (pattern,) = re.findall(r"sed -n 's/(.+)/duckdb==", workflow)
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    found = re.findall(pattern.replace(r"\(", "(").replace(r"\)", ")"), text)
    (wanted,) = re.findall(r'"duckdb>=([\d.]+)', text)
    assert found == [wanted]
