"""What is generated from the definitions is what lies in the repository."""

from __future__ import annotations

import importlib.util
from functools import cache
from pathlib import Path
from types import ModuleType

import pytest

from msgflow.query.catalogue import query_names

ROOT = Path(__file__).resolve().parents[2]


@cache
def _script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("generate", ROOT / "docs" / "generate.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@cache
def _pages() -> dict[Path, str]:
    pages: dict[Path, str] = _script().pages()
    return pages


@pytest.mark.parametrize("path", _pages(), ids=lambda path: path.name)
def test_page_is_current(path: Path) -> None:
    text = path.read_text()
    assert text == _script().with_answers(_pages()[path], text), "run: python docs/generate.py"


def test_tables_of_the_model_are_current() -> None:
    script = _script()
    assert script.MODEL.read_text() == script.model_tables(), "run: python docs/generate.py"


def test_every_query_has_a_page_and_no_other() -> None:
    pages = {path.stem for path in (ROOT / "docs" / "queries").iterdir()}
    assert pages == set(query_names())
