"""Listing of events, as one sequence in a binary stream."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import IO, TYPE_CHECKING

import pyarrow as pa
import pyarrow.compute as pc

from msgflow.events.formats import TABLES, EventFormat, table_writer
from msgflow.events.sequence import COLUMNS, Sequencer, json_column, json_line, text_line

if TYPE_CHECKING:
    from msgflow.events.selection import Selection
    from msgflow.trace import Progress


_SCHEMA = pa.schema([*COLUMNS.items(), ("fields", pa.string())])
_ROW_GROUP_ROWS = 100_000


def write_events(
    selection: Selection,
    form: EventFormat,
    stream: IO[bytes],
    progress: Callable[[Progress], None] | None = None,
) -> int:
    """Write the selected events in order of time, text as UTF-8, and return their number."""
    count = 0
    if form in TABLES:
        with (
            Sequencer(selection.traces.traces, json_column) as sequencer,
            table_writer(form, stream, _SCHEMA) as writer,
        ):
            held = _SCHEMA.empty_table()
            for events in selection.rounds(progress):
                held = pa.concat_tables([held, sequencer.rows(events).cast(_SCHEMA)])
                if form is EventFormat.CSV or len(held) >= _ROW_GROUP_ROWS:
                    writer.write_table(held)
                    count += len(held)
                    held = held.slice(0, 0)
            if len(held):
                writer.write_table(held)
        return count + len(held)
    rendering = text_line if form is EventFormat.TEXT else json_line
    first, between, last = ("[", ",\n ", "]\n") if form is EventFormat.JSON else ("", "\n", "\n")
    with Sequencer(selection.traces.traces, rendering) as sequencer:
        for events in selection.rounds(progress):
            lines = sequencer.rows(events).column("line")
            stream.write((between if count else first).encode())
            for joined in _joined(lines, between):
                stream.write(joined)
            count += len(lines)
    if count:
        stream.write(last.encode())
    elif form is EventFormat.JSON:
        stream.write(b"[]\n")
    return count


def _joined(lines: pa.ChunkedArray, between: str) -> Iterator[memoryview]:
    """Yield the bytes of all lines with `between` between them; Arrow joins them."""
    for position, chunk in enumerate(lines.chunks):
        if position:
            yield memoryview(between.encode())
        whole = pa.LargeListArray.from_arrays([0, len(chunk)], chunk)
        yield memoryview(pc.binary_join(whole, between)[0].as_buffer())
