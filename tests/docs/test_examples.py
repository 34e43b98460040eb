"""Pages with commands show what these print."""

from __future__ import annotations

import contextlib
import importlib.util
import io
import re
from functools import cache
from pathlib import Path
from types import ModuleType

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"


@cache
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("examples", DOCS / "examples.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@cache
def produced() -> dict[str, str]:
    return script().pages()


@pytest.mark.thorough
@pytest.mark.parametrize("page", script().PAGES)
def test_it_shows_what_its_commands_print(page: str) -> None:
    assert produced()[page] == (DOCS / page).read_text("utf-8")


@pytest.mark.parametrize("page", script().PAGES)
def test_its_answers_fit_the_terminal_and_are_answers(page: str) -> None:
    text = (DOCS / page).read_text("utf-8")
    shown = [block[1] for block in script().CONSOLE.finditer(text)]
    shown += [block[0].partition("```text\n")[2] for block in script().SQL.finditer(text)]
    assert len(shown) > (4 if page in ("why-late.md", "tour.md", "cookbook.md") else 0)
    for answer in shown:
        lines = [line for line in answer.splitlines() if not line.startswith("$ ")]
        assert [line for line in lines if len(line) > script().COLUMNS] == []
        assert not any(line.startswith(("error:", "Traceback")) for line in lines)
        # No simulated recording has samples of functions or of the system, or a loop of its own;
        # nothing is wrong with that of the examples.
        is_empty = "note: no rows" in lines and page not in ("queries/loops.md", "queries/info.md")
        is_sampled = any("sampled: msgflow record" in line for line in lines)
        assert not is_empty or "show no difference" in answer or is_sampled
        assert lines


def test_the_demo_is_that_of_the_readme_and_what_it_suggests_answers(tmp_path: Path) -> None:
    makefile = (DOCS.parent / "Makefile").read_text("utf-8")
    command = "msgflow ingest examples/pipeline.tar.xz"
    assert command in makefile
    assert script().SETUP.findall((DOCS.parent / "README.md").read_text("utf-8")) == [
        f"{command}\n"
    ]
    (tmp_path / "examples").symlink_to(DOCS.parent / "examples")
    script().run(command, tmp_path)
    suggested = re.findall(r"@echo '  (msgflow .*?)  ", makefile)
    assert len(suggested) > 3
    for command in suggested:
        answer = script().run(f"{command} && echo good", tmp_path)
        assert answer.endswith("good\n"), answer
        assert "note: no rows" not in answer


@pytest.mark.thorough
def test_commands_of_the_gallery_run(tmp_path: Path) -> None:
    blocks = re.findall(r"```sh\n(.*?)```", (DOCS / "gallery.md").read_text("utf-8"), re.DOTALL)
    assert len(blocks) == 6
    for number, block in enumerate(blocks):
        folder = tmp_path / str(number)
        folder.mkdir()
        (folder / "examples").symlink_to(DOCS.parent / "examples")
        # The browser stays closed, and Graphviz may not be here.
        lines = [line for line in block.splitlines() if not line.startswith("msgflow ui")]
        commands = "".join(f"{line.partition(' |')[0]}\n" for line in lines)
        answer = script().run(f"set -e\n{commands}echo good", folder)
        assert answer.endswith("good\n"), answer


def test_snippets_of_the_readme_run(small_database: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (DOCS.parent / "README.md").read_text("utf-8")
    (snippet,) = re.findall(r"```python\n(import duckdb\n.*?)```", text, re.DOTALL)
    assert small_database.name == "msgflow.duckdb"
    monkeypatch.chdir(small_database.parent)
    shown = io.StringIO()
    with contextlib.redirect_stdout(shown):
        exec(compile(snippet, "README.md", "exec"), {})
    assert "/chatter" in shown.getvalue()


def test_a_page_that_differs_is_found(tmp_path: Path) -> None:
    text = (
        '```sh title="Setup"\ntrue\n```\n\n'
        "```console\n$ echo ä; echo b >&2\nwrong\n\n$ tput cols\n```\n"
    )
    assert script().filled(text, tmp_path) == text.replace("wrong\n", "ä\nb\n").replace(
        "cols\n", "cols\n100\n"
    )
