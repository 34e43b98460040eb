"""Lines of a result on a terminal: headings, a table or records, and the paths below."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import takewhile
from typing import TYPE_CHECKING

from rich.cells import cell_len

from msgflow.result.layout import GAP
from msgflow.text.values import ARROW
from msgflow.text.wrapping import wrap, wrap_path

if TYPE_CHECKING:
    from msgflow.result.layout import Layout, ShownColumn

# A path that begins or ends like an earlier one is cut if that saves more than so many steps.
_SPARED = 4


def screen_lines(shown: Layout, width: int) -> Iterator[str]:
    """Yield the lines of a layout, none longer than `width` cells."""
    for heading in shown.headings:
        yield from wrap(heading, width)
    if shown.columns and shown.columns[0].cells:
        if shown.widths is None:
            yield from _records(shown.columns, width)
        else:
            yield from _table(shown.columns, shown.widths)
    if shown.paths:
        yield ""
        yield from _paths(shown.paths, width)


def _table(columns: Sequence[ShownColumn], widths: Sequence[int]) -> Iterator[str]:
    yield _line([column.title for column in columns], columns, widths)
    yield "─" * (sum(widths) + GAP * (len(widths) - 1))
    for row in zip(*(column.cells for column in columns), strict=True):
        parts = [wrap(cell, width) for cell, width in zip(row, widths, strict=True)]
        for number in range(max(map(len, parts))):
            line = [part[number] if number < len(part) else "" for part in parts]
            yield _line(line, columns, widths)


def _line(cells: Sequence[str], columns: Sequence[ShownColumn], widths: Sequence[int]) -> str:
    parts = []
    for cell, column, width in zip(cells, columns, widths, strict=True):
        padding = " " * (width - cell_len(cell))
        parts.append(padding + cell if column.is_number else cell + padding)
    return (" " * GAP).join(parts).rstrip()


def _records(columns: Sequence[ShownColumn], width: int) -> Iterator[str]:
    label = max(cell_len(column.title) for column in columns)
    room = max(10, width - label - GAP)
    count = len(columns[0].cells)
    for number in range(count):
        if count > 1:
            head = f"── {number + 1} "
            yield head + "─" * (min(width, label + GAP + 20) - len(head))
        for column in columns:
            first, *more = wrap(column.cells[number], room)
            yield f"{column.title:<{label}}  {first}".rstrip()
            for line in more:
                yield " " * (label + GAP) + line


def _paths(paths: Mapping[int, str], width: int) -> Iterator[str]:
    labels = ["path"] if len(paths) == 1 else [f"path {number}" for number in paths]
    indent = max(map(len, labels)) + GAP
    before: dict[int, list[str]] = {}
    for label, (number, path) in zip(labels, paths.items(), strict=True):
        steps = path.split(ARROW)
        text = _shortened(steps, before)
        for place, line in enumerate(wrap_path(text, max(20, width - indent))):
            yield f"{'' if place else label:<{indent}}{line}"
        before[number] = steps


def _shortened(steps: list[str], before: Mapping[int, list[str]]) -> str:
    """Return a path without the begin and the end that it shares with earlier paths."""
    head, first = _most_shared(steps, before)
    tail, last = _most_shared(steps[head:], before, is_end=True)
    parts = steps[head : len(steps) - tail]
    if head:
        parts = [f"(as {first} to {steps[head - 1]})", *parts]
    if tail:
        parts = [*parts, f"(as {last} from {steps[-tail]})"]
    return ARROW.join(parts)


def _most_shared(
    steps: list[str], before: Mapping[int, list[str]], *, is_end: bool = False
) -> tuple[int, int]:
    """Return the most steps that an earlier path has in common at its begin or end, and its number.

    The steps are 0 if cutting them saves too little.
    """
    most, of = 0, 0
    for number, other in before.items():
        one, two = (steps[::-1], other[::-1]) if is_end else (steps, other)
        alike = takewhile(lambda steps: steps[0] == steps[1], zip(one, two, strict=False))
        count = len(list(alike))
        # A topic may have the name of its node: the cut is clear only behind both.
        while 0 < count < len(two) and two[count] == two[count - 1]:
            count -= 1
        if count > max(most, _SPARED):
            most, of = count, number
    return most, of
