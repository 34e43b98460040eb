"""Names that are not UTF-8: the system takes them, databases do not."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from msgflow.cli.app import COMMANDS, app

NOT_UTF8 = os.fsdecode(b"d\xff")


def said(*words: str | Path) -> tuple[int, str]:
    result = CliRunner().invoke(app, [str(word) for word in words])
    return result.exit_code, " ".join(result.stderr.split())


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_refuses_such_a_word(command: str) -> None:
    code, text = said(command, NOT_UTF8)
    assert code == 2
    assert text == "error: not UTF-8 — d\\xff hint: give it a name in UTF-8 first"


def test_a_program_may_have_any_words() -> None:
    code, text = said("watch", "-o", "/dev/null/x", "--", "/no/such/program", NOT_UTF8)
    assert code
    assert "not UTF-8" not in text


def test_a_trace_below_such_a_folder_and_a_database_in_one(
    tmp_path: Path, shared_traces: Path
) -> None:
    """The words of the command are fine; nothing is written."""
    place = tmp_path / NOT_UTF8
    place.mkdir()
    trace = shared_traces / "real_py_timer" / "ust"
    (place / "trace").symlink_to(trace)
    shutil.copytree(trace, place / "copy")
    (place / "old.duckdb").touch()
    code, text = said("ingest", tmp_path, "--db", tmp_path / "new.duckdb")
    assert (code, "not UTF-8 — " in text) == (3, True)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        for words, expected in (
            (("ingest", trace, "--db", "new.duckdb"), 4),
            (("query", "e2e-latency", "--db", "old.duckdb"), 4),
            (("fleet", "ingest", trace, "--lake", "lake"), 2),
        ):
            code, text = said(*words)
            assert (code, "not UTF-8 — " in text) == (expected, True), words
    assert {path.name for path in place.iterdir()} == {"trace", "copy", "old.duckdb"}
    assert not (tmp_path / "new.duckdb").exists()
