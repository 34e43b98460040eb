"""A Python that is too old is said to be so, before pip looks for anything."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from msgflow.backports import tomllib

ROOT = Path(__file__).resolve().parents[2]
SAID = "msgflow needs Python 3.10 or newer"


def build(version: tuple[int, int]) -> subprocess.CompletedProcess[str]:
    """Load the build backend, as pip does, under a Python that calls itself `version`."""
    program = f"import sys; sys.version_info = ({version[0]}, {version[1]}, 0, 'final', 0)\n"
    return subprocess.run(
        [sys.executable, "-c", program + "import checked_hatchling as c; c.build_wheel"],
        env={"PYTHONPATH": str(ROOT / "packaging")},
        capture_output=True,
        text=True,
        check=False,
    )


def test_the_build_says_which_python_it_needs() -> None:
    done = build((3, 9))
    assert done.returncode == 1
    assert done.stderr.startswith(f"{SAID}; this is Python 3.9.\n")
    assert "Traceback" not in done.stderr
    assert build((3, 10)).returncode == 0


def test_make_says_it_too(tmp_path: Path) -> None:
    old = tmp_path / "python3"
    old.write_text('#!/bin/sh\ncase "$*" in *version_info*) exit 1;; esac\nexit 0\n')
    old.chmod(0o755)
    done = subprocess.run(
        ["make", f"PYTHON={old}", f"VENV={tmp_path}/venv", f"{tmp_path}/venv/.made"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert SAID in done.stderr
    assert not (tmp_path / "venv").exists()


def test_the_oldest_python_is_the_same_everywhere() -> None:
    for name in ("pyproject.toml", "simulator/pyproject.toml"):
        project = tomllib.loads((ROOT / name).read_text("utf-8"))["project"]
        assert project["requires-python"] == ">=3.10"
    for name in ("README.md", "Makefile", "packaging/checked_hatchling.py"):
        text = (ROOT / name).read_text("utf-8")
        assert re.search(r"Python (3\.10 or newer|≥ 3\.10)", text), name
