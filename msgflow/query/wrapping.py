"""Text in lines of a given width, as a terminal counts it."""

from __future__ import annotations

import re

from rich.cells import cell_len, set_cell_size

ARROW = " → "
# Where a name may be broken: behind a parenthesis, before a slash.
_PIECE = re.compile(r"[/(]?[^/(]*\(?")


def wrap(text: str, width: int) -> list[str]:
    """Return `text` in lines of at most `width` cells, broken at spaces, else within names."""
    if cell_len(text) <= width:
        return [text]
    lines: list[str] = []
    line = ""
    for word in text.split(" "):
        together = f"{line} {word}" if line else word
        if cell_len(together) <= width:
            line = together
            continue
        if line:
            lines.append(line)
        while cell_len(word) > width:
            head = _head(word, width)
            lines.append(head)
            word = word[len(head) :]
        line = word
    return [*lines, line]


def wrap_path(path: str, width: int) -> list[str]:
    """Return a path in lines of at most `width` cells; a line that goes on begins with an arrow."""
    lines: list[str] = []
    line = ""
    for step in path.split(ARROW):
        together = f"{line}{ARROW}{step}" if line else step
        if line and cell_len(together) > width:
            lines.append(line)
            together = f"{ARROW.lstrip()}{step}"
        line = together
    return [part for one in (*lines, line) for part in wrap(one, width)]


def longest_word(text: str) -> int:
    """Return how many cells the longest word of `text` takes."""
    return max(map(cell_len, text.split(" ")))


def longest_piece(text: str) -> int:
    """Return how many cells the longest part of a name in `text` takes."""
    return max(cell_len(piece) for word in text.split(" ") for piece in _PIECE.findall(word))


def _head(word: str, width: int) -> str:
    """Return the longest beginning of a word that fits, if need be one character too wide."""
    head = ""
    for piece in _PIECE.findall(word):
        if cell_len(head + piece) > width:
            break
        head += piece
    # What is cut through the middle of a wide character is filled with a space.
    return head or set_cell_size(word, width).rstrip() or word[:1]
