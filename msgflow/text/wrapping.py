"""Wrapping of text: lines of a given width, counted in cells of a terminal."""

from __future__ import annotations

import re

from rich.cells import cell_len, set_cell_size

from msgflow.text.values import ARROW

# Where a text may be broken: at a space, but not between a number and its unit.
_SPACE = re.compile(r"(?<!\d) | (?!(?:ns|µs|ms|s|Hz|%|ppb)(?!\w))")
# Where a name may be broken: behind a parenthesis, before a slash.
_PIECE = re.compile(r"[/(]?[^/(]*\(?")


def wrap(text: str, width: int) -> list[str]:
    """Return lines of at most `width` cells, broken at spaces, and within names if need be."""
    if cell_len(text) <= width:
        return [text]
    lines: list[str] = []
    line = ""
    for word in words(text):
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


def hanging(label: str, text: str, width: int) -> list[str]:
    """Return lines of at most `width` cells: a label and a text, which stays on its right."""
    first, *more = wrap(text, width - len(label))
    return [label + first, *(" " * len(label) + line for line in more)]


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


def words(text: str) -> list[str]:
    """Return the parts of `text` that stay together: words, and numbers with their units."""
    return _SPACE.split(text)


def longest_word(text: str) -> int:
    """Return the cells of the longest word of `text`."""
    return max(map(cell_len, words(text)), default=0)


def longest_piece(text: str) -> int:
    """Return the cells of the longest part of a name in `text`."""
    return max(
        (cell_len(piece) for word in words(text) for piece in _PIECE.findall(word)), default=0
    )


def _head(word: str, width: int) -> str:
    """Return the longest begin of a word that fits, at least one character."""
    # If it fits, the name in parentheses stays whole: people copy it.
    outer, bracket, inner = word.partition("(")
    if bracket and cell_len(inner) <= width and cell_len(outer) < width:
        return outer + bracket
    head = ""
    for piece in _PIECE.findall(word):
        if cell_len(head + piece) > width:
            break
        head += piece
    # A cut through a wide character leaves a space.
    return head or set_cell_size(word, width).rstrip() or word[:1]
