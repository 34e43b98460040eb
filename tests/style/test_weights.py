"""What msgflow weighs, in figures without a clock, is what weights.toml says."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FILE = Path(__file__).with_name("weights.toml")


def require(name: str, found: int) -> None:
    said = tomllib.loads(FILE.read_text())[name]
    assert found <= said, f"{name} = {found}: make it {said} again, or raise it in {FILE}"
    assert found >= 0.98 * said, f"{name} = {found}: lower it from {said} in {FILE}"


def test_operators_that_an_ingest_plans() -> None:
    program = ROOT / "tests" / "support" / "planned_operators.py"
    command = [sys.executable, program, ROOT / "examples" / "pipeline.tar.xz"]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    require("planned_operators", int(done.stdout))


def test_lines_of_python() -> None:
    files = (ROOT / "msgflow").rglob("*.py")
    require("python_lines", sum(len(path.read_text().splitlines()) for path in files))
