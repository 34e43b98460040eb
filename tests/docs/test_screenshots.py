"""The pictures of README and documents can be taken anew, and something is on them."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from support.browser import find_browser

ROOT = Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs" / "images"


def colors(path: Path) -> int:
    """Return how many colours a picture has; a blank one has few."""
    images = pytest.importorskip("PIL.Image")
    with images.open(path) as picture:
        assert picture.width == 1280
        return len(picture.convert("RGB").getcolors(picture.width * picture.height))


def test_documents_show_all_pictures_and_none_is_blank() -> None:
    shown = {
        name
        for document in (ROOT / "README.md", *(ROOT / "docs").glob("*.md"))
        for name in re.findall(
            r"^!\[[^\]]+\]\((?:docs/)?images/(\w+)\.png\)$",
            document.read_text(encoding="utf-8"),
            re.MULTILINE,
        )
    }
    assert shown == {path.stem for path in IMAGES.glob("*.png")}
    for name in shown:
        assert colors(IMAGES / f"{name}.png") > 100


@pytest.mark.thorough
def test_they_can_be_taken_anew(tmp_path: Path) -> None:
    pytest.importorskip("playwright")
    if find_browser() is None:
        pytest.skip("no Chromium here: apt install chromium")
    # By a process of its own: two of Playwright cannot be in one.
    subprocess.run([sys.executable, ROOT / "docs" / "screenshots.py", tmp_path], check=True)
    files = sorted(tmp_path.glob("*.png"))
    assert [file.name for file in files] == sorted(path.name for path in IMAGES.glob("*.png"))
    for file in files:
        assert 0.5 < colors(file) / colors(IMAGES / file.name) < 2
