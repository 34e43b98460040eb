"""Texts that would only make sense on the machine where they were written."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = (
    "msgflow",
    "schema",
    "migrations",
    "queries",
    "tests",
    "docs",
    "examples",
    "benchmarks",
    "simulator",
    ".ci",
)
TEXTS = {".py", ".sql", ".md", ".toml", ".csv", ".json", ".js", ".html", ".css", ".sh", ""}
MACHINE_PATH = re.compile(r"(?<![\w.])/(?:home/\w+|root|Users/\w+|work|mnt/\w+)/[\w.]")


def text_files() -> Iterator[Path]:
    # In a worktree .git is a file, which names the repository that it belongs to.
    yield from (
        path
        for path in ROOT.iterdir()
        if path.is_file() and path.suffix in TEXTS and path.name != ".git"
    )
    for folder in FOLDERS:
        for path in (ROOT / folder).rglob("*"):
            if path.is_file() and path.suffix in TEXTS and "__pycache__" not in path.parts:
                yield path


def test_no_file_names_a_place_on_one_machine() -> None:
    found = [
        f"{path.relative_to(ROOT)}: {match.group()}"
        for path in text_files()
        for match in MACHINE_PATH.finditer(path.read_text(encoding="utf-8", errors="replace"))
    ]
    assert not found


def test_files_end_with_one_line_break() -> None:
    wrong = []
    for path in text_files():
        text = path.read_text(encoding="utf-8", errors="replace")
        if text and (not text.endswith("\n") or text.endswith("\n\n")):
            wrong.append(str(path.relative_to(ROOT)))
    assert not wrong


def test_commands_ask_a_database_by_its_methods() -> None:
    """On a bare connection an error of a damaged file would look like a mistake of ours."""
    bare = re.compile(r"\bdatabase\.connection\.\w+\(")
    commands = (ROOT / "msgflow" / "cli").rglob("*.py")
    assert [path.name for path in commands if bare.search(path.read_text())] == []
