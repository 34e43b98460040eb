"""Layout of a result on a terminal: which columns have a place, and how wide they are.

Columns with nothing in them are left out, unless the header of the query lists them under `answer`:
that nothing was lost is an answer. Paths get numbers and stand once, below the table. A table that
is still too wide loses its least important columns, by the order of `brief` in the header. The
first of `brief` never yield: if they do not fit, every row becomes a record. One line says what is
not shown.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import permutations
from typing import TYPE_CHECKING

from rich.cells import cell_len

from msgflow.result.rows import is_number
from msgflow.text.parts import PART_COLUMNS, part_words
from msgflow.text.values import ARROW, MOMENT, NULL, column_title, format_cell, short_symbol
from msgflow.text.wrapping import longest_piece, longest_word, wrap

if TYPE_CHECKING:
    import pyarrow as pa

    from msgflow.result.rows import Rows
    from msgflow.sql.header import Header

MOST_ROWS = 50
_NARROWEST = 40
GAP = 2
PATH = "path"
PATH_ID = "path_id"
RUN = "run_id"
_SYMBOLS = ("symbol", "symbols")
# So many of the most important columns never yield. For so many, names may be broken.
_ESSENTIAL = 5
_WANTED = 6
# The narrowest column of text, in cells, and the most lines of a cell. Where all columns are to be
# shown, as those of plain SQL, columns may be narrower and cells have more lines.
_NARROW = 16
_NARROW_OF_ALL = 12
_WORD = 40
# Shorter text is broken only to make room for the most important columns, as names are.
_SHORT = 20
_LINES = 4
_LINES_OF_ALL = 10


@dataclass(frozen=True)
class ShownColumn:
    """A column as people read it; widths are in cells of the terminal."""

    name: str  # in the result
    title: str  # in the table
    cells: tuple[str, ...]  # one for each row that is shown
    is_number: bool  # aligned to the right, and never in several lines
    width: int  # the width of its content
    least: int  # the least width
    broken: int  # the least width if names may be broken


@dataclass(frozen=True)
class Layout:
    """The part of a result that a terminal shows."""

    headings: tuple[str, ...]  # lines above the rows
    columns: tuple[ShownColumn, ...]  # in the order of the result, after the number of the path
    widths: tuple[int, ...] | None  # of the columns, in cells; None if each row is a record
    paths: dict[int, str]  # the paths, by their numbers
    notes: tuple[str, ...]  # what is left out, a sentence each
    not_shown: str | None  # which columns are left out, in one line; None if none are


def screen_width() -> int:
    """Return the width of a line in cells: the variable COLUMNS, else the terminal's, else 100."""
    return max(_NARROWEST, shutil.get_terminal_size((100, 24)).columns)


def lay_out(
    result: Rows,
    width: int,
    *,
    most_rows: int | None = MOST_ROWS,
    is_chosen: bool = False,
    is_whole: bool = False,
    remedy: str = "--wide shows all",
) -> Layout:
    """Return the layout of a result."""
    # Without it, all columns are kept.
    header = None if is_chosen else result.header
    zero_rows = 0
    if header is not None:
        result, zero_rows = _without_zero_rows(result, header)
    kept, nothing = _columns_with_content(result, header)
    first = result.table if most_rows is None else result.table.slice(0, most_rows)
    lines = _LINES_OF_ALL if is_whole or result.header is None else _LINES
    columns = [_column(result, name, first[name], lines) for name in kept]
    columns, paths = _with_numbered_paths(columns, result.path_numbers)
    headings: tuple[str, ...] = ()
    if header is not None:
        columns, headings = _with_headings(header, columns)
    cut = f"the first {first.num_rows} of {len(result):,} rows: {remedy}"
    notes = (cut,) if first.num_rows < len(result) else ()
    if header is not None and not is_whole:
        shown = _columns_that_fit(header, result.order, columns, width)
    else:
        shown = columns if _least_width(columns) <= width else _with_broken_names(columns)
    names = {column.name for column in shown}
    left_out = [column for column in columns if column.name not in names]
    is_table = _least_width(shown) <= width and not (left_out and first.num_rows == 1)
    if header is not None:
        important = {*(*result.order, *header.brief)[:_ESSENTIAL]}
        is_table = is_table and important.isdisjoint(column.name for column in left_out)
    if not is_table:
        shown, left_out = columns, []
    widths = tuple(_widths(shown, width)) if is_table else None
    not_shown = _not_shown(left_out, nothing, zero_rows, width, remedy) if first.num_rows else None
    return Layout(headings, tuple(shown), widths, paths, notes, not_shown)


def _without_zero_rows(result: Rows, header: Header) -> tuple[Rows, int]:
    """Return the rows that are not 0 throughout, and how many are; all if each of them is."""
    if header.zero is None or header.zero not in result.columns:
        return result, 0
    from pyarrow import compute

    table = result.table.filter(compute.not_equal(result.table[header.zero], 0))
    count = len(result) - table.num_rows
    return (replace(result, table=table), count) if table.num_rows else (result, 0)


def _columns_with_content(result: Rows, header: Header | None) -> tuple[list[str], list[str]]:
    """Return the columns with content, and the titles of those that are 0 or empty in all rows."""
    if header is None or not len(result):
        return list(result.columns), []
    kept, nothing = [], []
    for name in result.columns:
        if name == RUN and len(result.runs) == 1:
            continue
        if name == PATH_ID and PATH in result.columns:
            continue
        if name not in header.answer and _is_nothing(result.table[name]):
            nothing.append(_title(result, name))
        else:
            kept.append(name)
    return kept, nothing


def _is_nothing(column: pa.ChunkedArray) -> bool:
    # Nothing is what Python counts as false: NULL, 0, false, an empty text or list. Where there is
    # something, the first rows mostly have it. Arrow's own functions take longer to import.
    first = column.slice(0, MOST_ROWS)
    is_empty = column.null_count == len(column)
    return is_empty or not (any(first.to_pylist()) or any(column.to_pylist()))


def _title(result: Rows, name: str) -> str:
    return column_title(name, result.units.get(name), result.columns)


def _column(result: Rows, name: str, values: pa.ChunkedArray, lines: int) -> ShownColumn:
    title, cells = _title(result, name), None
    has_numbers = is_number(values.type)
    listed = values.to_pylist()
    # Rows that are runs themselves have their names already, and begin at different times.
    are_runs = result.header is None or result.header.grain == "one row per run"
    names = {} if are_runs else {run.run_id: run.name for run in result.runs}
    if name == RUN and names and len(set(names.values())) == len(names):
        title, has_numbers = "run", False
        cells = [format_cell(names.get(value, value)) for value in listed]
    elif name in PART_COLUMNS and result.header is not None:
        cells = [NULL if value is None else part_words(value) for value in listed]
    elif name in _SYMBOLS:
        cells = [NULL if value is None else format_cell(short_symbol(value)) for value in listed]
    else:
        unit = result.units.get(name)
        is_handle = name.endswith("_handle")
        is_since = unit == MOMENT and not are_runs and len(result.runs) == 1
        begin = result.runs[0].start_ns if is_since else None
        cells = [
            format_cell(value, unit, is_handle=is_handle)
            if begin is None or value is None
            else _since(value - begin)
            for value in listed
        ]
    return _measured(name, title, cells, has_numbers, lines)


def _measured(
    name: str, title: str, cells: list[str], is_number: bool, lines: int = _LINES
) -> ShownColumn:
    width = max([cell_len(title), *map(cell_len, cells)])
    least = broken = width
    if not is_number:
        word = max((longest_word(cell) for cell in cells), default=0)
        most = max(map(cell_len, cells), default=0)
        piece = max(map(longest_piece, cells), default=0)
        narrow = _NARROW if lines == _LINES else _NARROW_OF_ALL
        broken = min(
            width, max(cell_len(title), min(piece, _WORD), narrow, -(-most * 5 // (4 * lines)))
        )
        least = width if width <= _SHORT else min(width, max(broken, min(word, _WORD)))
    return ShownColumn(name, title, tuple(cells), is_number, width, least, broken)


def _since(duration_ns: int) -> str:
    # Rounded down: given to --start or --at, the time must include this moment.
    microseconds = duration_ns // 1_000
    sign = "-" if microseconds < 0 else ""
    seconds, rest = divmod(abs(microseconds), 1_000_000)
    return f"{sign}{seconds}.{rest:06d} s"


def _with_numbered_paths(
    columns: list[ShownColumn], known: Mapping[str, int]
) -> tuple[list[ShownColumn], dict[int, str]]:
    """Return the columns with numbers in place of paths, and the paths by number."""
    texts = next((column.cells for column in columns if column.name == PATH), ())
    if not any(ARROW in text for text in texts):
        return columns, {}
    paths = tuple(dict.fromkeys(text for text in texts if ARROW in text))
    own = {text: place for place, text in enumerate(paths, start=1)}
    # Those of names with control characters are not known.
    numbers = {text: known[text] for text in paths} if known.keys() >= own.keys() else own
    column = _measured(PATH, PATH, [str(numbers.get(text, text)) for text in texts], True)
    others = [other for other in columns if other.name != PATH]
    listed = {number: text for text, number in sorted(numbers.items(), key=lambda item: item[1])}
    return ([column] if len(paths) > 1 else []) + others, listed


def _with_headings(
    header: Header, columns: list[ShownColumn]
) -> tuple[list[ShownColumn], tuple[str, ...]]:
    """Return the columns of the table, and the headings made of the other ones."""
    by_name = {column.name: column for column in columns}
    said = [by_name[name] for name in header.heading if name in by_name]
    if len(said) < 2 or said[0].name != header.heading[0] or not said[0].cells:
        return columns, ()
    key, *others = said
    rows: dict[str, tuple[str, ...]] = {}
    for number, *cells in zip(*(column.cells for column in said), strict=True):
        rows.setdefault(number, tuple(cells))
    if len(rows) == len(key.cells) > 1:
        return columns, ()
    # A single heading needs no number; otherwise the number says which rows it belongs to.
    is_alone = len(rows) == 1
    lines = tuple(
        ("" if is_alone else f"{key.title} {number}: ")
        + ", ".join(
            f"{column.title} {cell}"
            for column, cell in zip(others, cells, strict=True)
            if cell != NULL
        )
        for number, cells in rows.items()
    )
    left = [column for column in columns if column not in (said if is_alone else others)]
    return left, lines


def _by_importance(
    header: Header, order: Sequence[str], columns: list[ShownColumn]
) -> list[ShownColumn]:
    """Return the columns, the most important first; those alike in all rows come last."""
    others = [name for name in header.brief if name not in (PATH, RUN)]
    # Rows whose order nothing explains look like a mistake.
    first = (PATH, RUN, *order, *([] if header.slowest is None else [header.slowest]))
    kept = {*first, *others[:_WANTED], *header.answer}
    places = {name: place for place, name in enumerate(dict.fromkeys((*first, *header.brief)))}
    return sorted(
        columns,
        key=lambda column: (
            column.name not in kept and _is_alike(column),
            places.get(column.name, len(places)),
            column.name.endswith(("_id", "_handle")),
        ),
    )


def _columns_that_fit(
    header: Header, order: Sequence[str], columns: list[ShownColumn], width: int
) -> list[ShownColumn]:
    """Return the most important columns that fit, in the order of the result."""
    if _least_width(columns) <= width:
        return columns
    ranked = _by_importance(header, order, columns)
    chosen = _as_many_as_fit(ranked, width)
    # Paths and runs are shown besides those of `brief`.
    first = ranked[: _WANTED + sum(column.name in (PATH, RUN) for column in columns)]
    if any(column not in chosen for column in first):
        # Names are broken for the wanted columns only.
        wanted = {column.name for column in _as_many_as_fit(_with_broken_names(first), width)}
        first = [column for column in ranked if column.name in wanted]
        rest = [column for column in ranked if column.name not in wanted]
        chosen = (
            _as_many_as_fit(rest, width, first)
            if _least_width(first) <= width
            else _with_broken_names(first)
        )
    by_name = {column.name: column for column in chosen}
    return [by_name[column.name] for column in columns if column.name in by_name]


def _with_broken_names(columns: list[ShownColumn]) -> list[ShownColumn]:
    return [replace(column, least=column.broken) for column in columns]


def _as_many_as_fit(
    ranked: list[ShownColumn], width: int, first: Sequence[ShownColumn] = ()
) -> list[ShownColumn]:
    chosen = list(first)
    for column in ranked:
        if _least_width([*chosen, column]) <= width:
            chosen.append(column)
    return chosen


def _least_width(columns: list[ShownColumn]) -> int:
    return sum(column.least for column in columns) + GAP * max(0, len(columns) - 1)


def _widths(columns: list[ShownColumn], width: int) -> list[int]:
    """Return widths with which the columns fit and the rows take few lines."""
    widths = [column.width for column in columns]
    free = width - GAP * (len(columns) - 1)
    if sum(widths) <= free:
        return widths
    # First the widest columns become narrower; then columns trade cells.
    while sum(widths) > free:
        wide = [place for place, column in enumerate(columns) if widths[place] > column.least]
        widths[max(wide, key=widths.__getitem__)] -= 1
    return _balanced(columns, widths)


def _balanced(columns: list[ShownColumn], widths: list[int]) -> list[int]:
    """Return widths of the same sum with which the rows take the fewest lines."""
    texts = [place for place, column in enumerate(columns) if not column.is_number]
    first = [column.cells[:MOST_ROWS] for column in columns]
    heights = cache(lambda place, width: [len(wrap(cell, width)) for cell in first[place]])

    def lines(tried: list[int]) -> int:
        return sum(map(max, zip(*(heights(place, tried[place]) for place in texts), strict=True)))

    best = lines(widths)
    improves = len(texts) > 1
    while improves:
        improves = False
        for giver, taker in permutations(texts, 2):
            for cells in range(1, widths[giver] - columns[giver].least + 1):
                tried = list(widths)
                tried[giver] -= cells
                tried[taker] += cells
                if tried[taker] <= columns[taker].width and (count := lines(tried)) < best:
                    best, widths, improves = count, tried, True
                    break
    return widths


def _is_alike(column: ShownColumn) -> bool:
    return len(column.cells) > 1 and len(set(column.cells)) == 1 and column.width <= _WORD


def _not_shown(
    columns: Sequence[ShownColumn], nothing: Sequence[str], zero_rows: int, width: int, remedy: str
) -> str | None:
    """Return one line that names columns, with the value of those alike in all rows."""
    alike = [column for column in columns if _is_alike(column)]
    rows = "1 row" if zero_rows == 1 else f"{zero_rows} rows"
    words = [f"{rows} of 0"] if zero_rows else []
    words += [column.title for column in columns if column not in alike]
    words += [f"{column.title} ({column.cells[0]} in all rows)" for column in alike]
    words += [f"{title} (empty)" for title in nothing]
    if not words:
        return None
    lines = (
        f"not shown: {', '.join([*words[:count], *more])}; {remedy}"
        for count in range(len(words), 0, -1)
        for more in [[f"{len(words) - count} more"] if count < len(words) else []]
    )
    return next(
        (line for line in lines if cell_len(line) <= width),
        f"{len(words)} columns are not shown; {remedy}",
    )
