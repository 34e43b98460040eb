"""The comparison of two checkouts: each runs its own code; the comparison names the differences."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pytest
import same_answers

ROOT = Path(__file__).resolve().parents[2]


def make_checkout(folder: Path) -> Path:
    (folder / "msgflow").mkdir(parents=True)
    (folder / "msgflow" / "__init__.py").write_text("answer = 42\n")
    return folder


def test_each_checkout_runs_its_own_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the command is given in a checkout, which Python would look into first."""
    other = make_checkout(tmp_path / "other")
    monkeypatch.chdir(ROOT)
    same_answers.require_checkout(other)
    assert same_answers.run(other, ["-c", "import msgflow; print(msgflow.answer)"]) == "42\n"


def test_a_folder_that_would_run_another_msgflow_is_refused(tmp_path: Path) -> None:
    (tmp_path / "msgflow").mkdir()
    with pytest.raises(SystemExit, match="not a checkout of msgflow"):
        same_answers.require_checkout(tmp_path)


def write(folder: Path, answers: dict[str, str]) -> Path:
    folder.mkdir()
    for name, sql in answers.items():
        duckdb.sql(sql).write_parquet(str(folder / f"{name}.parquet"))
    return folder


def test_what_differs_is_told(tmp_path: Path) -> None:
    before = write(
        tmp_path / "before",
        {
            "view same": "SELECT 1 AS a, 'then' AS created_at",
            "view order": "FROM (VALUES (1), (2)) AS t (a)",
            "query order": "FROM (VALUES (1), (2)) AS t (a)",
            "view row": "SELECT 1 AS a",
            "view column": "SELECT 1 AS a",
            "view gone": "SELECT 1 AS a",
        },
    )
    after = write(
        tmp_path / "after",
        {
            "view same": "SELECT 1 AS a, 'now' AS created_at",
            "view order": "FROM (VALUES (2), (1)) AS t (a)",
            "query order": "FROM (VALUES (2), (1)) AS t (a)",
            "view row": "SELECT 2 AS a",
            "view column": "SELECT 1 AS b",
        },
    )
    told = {line.partition(":")[0] for line in same_answers.differences(before, after)}
    assert told == {"query order", "view row", "view column", "view gone"}
