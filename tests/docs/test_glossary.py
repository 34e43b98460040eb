"""The glossary has the words of tables and pages, and every kind of culprit."""

from __future__ import annotations

import re
from pathlib import Path

from msgflow.text.parts import WORDS

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
ROW = re.compile(r"^  \| (`.*?) \| (.*) \|$", re.MULTILINE)


def test_parts_have_one_word_everywhere() -> None:
    said = {}
    for names, words in ROW.findall(TEXT.partition("- **part**")[2].partition("- **wait**")[0]):
        known = re.findall(r"`(\w+)`", names)
        every = words.split(", ")
        said |= dict(zip(known, every * len(known) if len(every) == 1 else every, strict=False))
    assert said == WORDS
    page = (ROOT / "msgflow" / "view" / "static" / "labels.js").read_text(encoding="utf-8")
    (shown,) = re.findall(r"^const PARTS = \{\n(.*?)^\};", page, re.MULTILINE | re.DOTALL)
    assert dict(re.findall(r'^  (\w+): "(.*)",$', shown, re.MULTILINE)) == WORDS


def test_every_kind_of_culprit_is_explained() -> None:
    rows = ROW.findall(TEXT.partition("- **kind**")[2].partition("- **nothing")[0])
    files = sorted((ROOT / "schema" / "culprit").glob("*.sql"))
    kinds = [path.stem for path in files if "-- kind: inline" not in path.read_text("utf-8")]
    assert sorted(names.strip("`") for names, _ in rows) == kinds
