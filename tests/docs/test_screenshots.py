"""The pictures of the README can be taken anew, and something is on them."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def colors(path: Path) -> int:
    """Return how many colours a picture has; a blank one has few."""
    images = pytest.importorskip("PIL.Image")
    with images.open(path) as picture:
        assert picture.size == (1280, 800)
        return len(picture.convert("RGB").getcolors(1280 * 800))


def test_the_readme_shows_pictures_that_are_not_blank() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for name in ("timeline", "graph"):
        assert f"(docs/images/{name}.png)" in text
        assert colors(ROOT / "docs" / "images" / f"{name}.png") > 100


def test_they_can_be_taken_anew(tmp_path: Path) -> None:
    pytest.importorskip("playwright")
    if shutil.which("chromium") is None and shutil.which("chromium-browser") is None:
        pytest.skip("no Chromium here: apt install chromium")
    # By a process of its own: two of Playwright cannot be in one.
    subprocess.run([sys.executable, ROOT / "docs" / "screenshots.py", tmp_path], check=True)
    files = [tmp_path / "timeline.png", tmp_path / "graph.png"]
    for file in files:
        kept = ROOT / "docs" / "images" / file.name
        assert 0.5 < colors(file) / colors(kept) < 2
