from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from msgflow.cli.app import app

Msgflow = Callable[..., Result]


@pytest.fixture
def msgflow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Msgflow:
    """Run a command line in an empty directory, without a database in the environment."""
    directory = tmp_path / "here"
    directory.mkdir()
    monkeypatch.chdir(directory)
    monkeypatch.delenv("MSGFLOW_DB", raising=False)
    monkeypatch.delenv("MSGFLOW_DEBUG", raising=False)
    monkeypatch.delenv("MSGFLOW_MEMORY_LIMIT", raising=False)

    def run(*arguments: object, stdin: str | None = None) -> Result:
        return CliRunner().invoke(app, [str(argument) for argument in arguments], input=stdin)

    return run
