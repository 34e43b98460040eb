"""Markdown: tables, and text that is nothing but text."""

from __future__ import annotations

import re
from collections.abc import Iterable

_TICKS = re.compile(r"`+")


def code(text: str) -> str:
    """Return a text as code: nothing in it is markup, a link or a mention."""
    longest = max(map(len, _TICKS.findall(text)), default=0)
    fence = "`" * (longest + 1)
    space = " " if longest else ""
    return f"{fence}{space}{text}{space}{fence}"


def code_lines(lines: Iterable[str]) -> list[str]:
    """Return lines as a block of code, also below a list, whatever is in them."""
    lines = list(lines)
    longest = max((len(ticks) for line in lines for ticks in _TICKS.findall(line)), default=0)
    fence = "`" * max(longest + 1, 3)
    return [fence, *lines, fence]


def markdown_line(cells: Iterable[str]) -> str:
    """Return a line of a table."""
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def rule_line(right: Iterable[bool]) -> str:
    """Return the line below the titles of a table: which columns are on the right."""
    return "|" + "|".join(" ---: " if is_right else " --- " for is_right in right) + "|"
