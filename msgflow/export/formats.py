"""Formats of results: a table, CSV, JSON, JSON lines, Parquet, Markdown."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import repeat
from operator import add
from pathlib import Path
from typing import IO, TYPE_CHECKING, TypeVar

from msgflow.backports import StrEnum
from msgflow.errors import UsageError
from msgflow.result.rows import cells
from msgflow.text.json_value import json_text, json_value
from msgflow.text.markdown import markdown_line, rule_line

if TYPE_CHECKING:
    import pyarrow as pa

    from msgflow.result.query_result import QueryResult

_ROWS_AT_ONCE = 10_000
# Patterns of texts, and what replaces them.
_FORMULAS = ((r"^([=+\-@\t\r])", r"'\1"),)
_ENDS = (("\n", r"\\n"),)
_GAP = "  "
Form = TypeVar("Form")


class Format(StrEnum):
    """A format of results; all but table, markdown and csv-safe are exact.

    Spreadsheets take text that begins with =, +, -, @, a tab or a carriage return for a formula.
    With csv-safe, an apostrophe precedes such text.
    """

    TABLE = "table"
    CSV = "csv"
    CSV_SAFE = "csv-safe"
    JSON = "json"
    JSONL = "jsonl"
    PARQUET = "parquet"
    MARKDOWN = "markdown"


SUFFIXES = {
    ".csv": Format.CSV,
    ".json": Format.JSON,
    ".jsonl": Format.JSONL,
    ".md": Format.MARKDOWN,
    ".parquet": Format.PARQUET,
    ".txt": Format.TABLE,
}


def format_of(path: Path | None) -> Format:
    """Return the format for the suffix of a file; a table without a file."""
    if path is None or not path.suffix:
        return Format.TABLE
    return by_suffix(path, SUFFIXES, "; spreadsheets open CSV, PlotJuggler CSV and Parquet")


def by_suffix(path: Path, known: Mapping[str, Form], more: str = "") -> Form:
    """Return the format that the suffix of a file asks for; `more` ends the hint of the error."""
    try:
        return known[path.suffix.lower()]
    except KeyError:
        raise UsageError(
            f"no format has this suffix — {path}",
            f"end it with {', '.join(known)}, or say --format{more}",
        ) from None


def write_result(result: QueryResult, form: Format, stream: IO[bytes]) -> None:
    """Write `result` to a binary stream, text as UTF-8."""
    if form in (Format.CSV, Format.CSV_SAFE):
        batches = result.table.to_batches(max_chunksize=_ROWS_AT_ONCE)
        write_csv(result.table.schema, batches, stream, is_safe=form is Format.CSV_SAFE)
    elif form is Format.PARQUET:
        import pyarrow.parquet

        pyarrow.parquet.write_table(result.table, stream, compression="zstd")
    else:
        writers = {
            Format.TABLE: table_lines,
            Format.MARKDOWN: markdown_lines,
            Format.JSONL: json_rows,
            Format.JSON: _json_array,
        }
        for line in writers[form](result):
            stream.write(f"{line}\n".encode())


def table_lines(result: QueryResult) -> Iterator[str]:
    """Yield the lines of a table: names, a rule, one line per row, numbers to the right."""
    names, columns, right = cells(result)
    if not names:
        return
    padded, widths = zip(*map(_aligned, names, columns, right), strict=True)
    lines = (_GAP.join(row).rstrip() for row in zip(*padded, strict=True))
    yield next(lines)
    yield "─" * (sum(widths) + len(_GAP) * (len(widths) - 1))
    yield from lines


def markdown_lines(result: QueryResult) -> Iterator[str]:
    """Yield the lines of a Markdown table."""
    names, columns, right = cells(result)
    if not names:
        return
    yield markdown_line(names)
    yield rule_line(right)
    for row in zip(*columns, strict=True):
        yield markdown_line(row)


def _aligned(name: str, column: Sequence[str], is_right: bool) -> tuple[Iterator[str], int]:
    """Return the title and cells of a column padded to one width, and that width."""
    from rich.cells import cell_len

    texts = [name, *column]
    characters = "".join(texts)
    if characters.isascii() or all(cell_len(character) == 1 for character in set(characters)):
        width = max(map(len, texts))
        return map(str.rjust if is_right else str.ljust, texts, repeat(width)), width
    width = max(map(cell_len, texts))
    padding = (" " * (width - cell_len(text)) for text in texts)
    return map(add, *((padding, texts) if is_right else (texts, padding))), width


def json_rows(result: QueryResult) -> Iterator[str]:
    """Yield each row as a JSON object on one line."""
    encode = json.JSONEncoder(ensure_ascii=False, allow_nan=False).encode
    for batch in result.table.to_batches(max_chunksize=_ROWS_AT_ONCE):
        for row in batch.to_pylist():
            yield encode(json_value(row))


def _json_array(result: QueryResult) -> Iterator[str]:
    yield "[" + ",\n ".join(json_rows(result)) + "]"


def write_csv(
    schema: pa.Schema, batches: Iterable[pa.RecordBatch], target: Path | IO[bytes], *, is_safe: bool
) -> int:
    """Write batches as CSV, and return how many rows; `is_safe`: without formulas.

    On a terminal a row is one line: ends of lines in names are printed as text.
    """
    import pyarrow.csv

    from msgflow.trace.numpy_arrow import empty_batch

    is_screen = not isinstance(target, Path) and target.isatty()

    def prepared(batch: pa.RecordBatch) -> pa.RecordBatch:
        batch = _csv_batch(batch)
        for pattern, by in (*_FORMULAS * is_safe, *_ENDS * is_screen):
            batch = _with_texts(batch, pattern, by)
        return batch

    count = 0
    with pyarrow.csv.CSVWriter(target, prepared(empty_batch(schema)).schema) as writer:
        for batch in batches:
            writer.write_batch(prepared(batch))
            count += batch.num_rows
    return count


def _csv_batch(batch: pa.RecordBatch) -> pa.RecordBatch:
    """Return a batch for CSV: integers, floats and truth values stay, all else becomes text.

    Text gets quotes, NULL does not: an empty text and a missing one stay different.
    """
    import pyarrow

    columns = [_csv_column(column) for column in batch.columns]
    return pyarrow.RecordBatch.from_arrays(columns, names=batch.schema.names)


def _with_texts(batch: pa.RecordBatch, pattern: str, by: str) -> pa.RecordBatch:
    """Return a batch with what matches a pattern in its texts and names replaced."""
    import pyarrow as pa
    import pyarrow.compute as pc

    def changed(texts: pa.Array) -> pa.Array:
        return pc.replace_substring_regex(texts, pattern, by)

    columns = [changed(each) if pa.types.is_string(each.type) else each for each in batch.columns]
    names = changed(pa.array(batch.schema.names, pa.string())).to_pylist()
    return pa.RecordBatch.from_arrays(columns, names=names)


def _csv_column(column: pa.Array) -> pa.Array:
    import pyarrow.types as types

    from msgflow.trace.numpy_arrow import texts_to_arrow

    kind = column.type
    if (
        types.is_integer(kind)
        or types.is_floating(kind)
        or types.is_boolean(kind)
        or types.is_string(kind)
    ):
        return column
    if types.is_decimal(kind) and kind.scale == 0:
        return column
    return texts_to_arrow(list(map(json_text, column.to_pylist())))
