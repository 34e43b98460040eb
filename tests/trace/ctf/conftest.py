"""What the tests of the decoder share."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest


@pytest.fixture
def copy_of(shared_traces: Path, tmp_path: Path) -> Callable[[str], Path]:
    """Copy a recorded trace to where it can be changed."""

    def copy(name: str) -> Path:
        target = tmp_path / "copy" / name
        shutil.copytree(shared_traces / name, target)
        for path in [target, *target.rglob("*")]:
            path.chmod(0o755 if path.is_dir() else 0o644)
        return target

    return copy
