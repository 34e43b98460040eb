"""What is generated from the definitions is what lies in the repository."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def _generated_pages() -> dict[Path, str]:
    spec = importlib.util.spec_from_file_location("generate", ROOT / "docs" / "generate.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    pages: dict[Path, str] = module.pages()
    return pages


@pytest.mark.parametrize("page", ["data-model.md", "health.md", "queries.md"])
def test_page_is_current(page: str) -> None:
    path = ROOT / "docs" / page
    assert path.read_text() == _generated_pages()[path], "run: python docs/generate.py"
