"""Tables of events: one per name, with a column for each of its fields."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from msgflow.errors import UsageError
from msgflow.events.formats import EventFormat, table_writer
from msgflow.events.sequence import COLUMNS, Sequencer, common_columns
from msgflow.files.atomic_directory import replacing_entries
from msgflow.result.plain import any_within
from msgflow.sql.json_fields import column_name, exact
from msgflow.sql.quoting import identifier

if TYPE_CHECKING:
    from msgflow.events.selection import Selection
    from msgflow.trace import Progress

MOST_BYTES_HELD = 64 << 20
"""Bytes of all rows that are gathered before they are written."""

_UNSAFE = re.compile(r"[^\w.-]+", re.ASCII)


def write_event_tables(
    selection: Selection,
    form: EventFormat,
    directory: Path,
    progress: Callable[[Progress], None] | None = None,
) -> int:
    """Write one file per event name to an empty or new directory; return the number of events.

    `ros2:rcl_init` goes to `ros2.rcl_init.parquet`. The columns are those of `COLUMNS`, then the
    fields; one that is called like a column before it is called `field_` and its name. In CSV,
    lists and structures are JSON. The files appear when all is written.
    """
    names: list[str] = []
    with (
        replacing_entries(directory, names) as temporary,
        contextlib.ExitStack() as opened,
    ):
        if any(path != temporary for path in directory.iterdir()):
            raise UsageError(f"the directory is not empty — {directory}", "choose another with -o")
        files = _Files(temporary, form, opened, names)
        # CSV holds no nested values, Parquet no structure without a member.
        is_text = pa.types.is_nested if form is EventFormat.CSV else _has_empty_structure
        sequencer = opened.enter_context(Sequencer(selection.traces.traces, partial(_row, is_text)))
        count = 0
        for events in selection.rounds(progress):
            for item in events:
                rows = sequencer.rows([item])
                files.add(item.name, rows)
                count += len(rows)
        files.flush()
    return count


class _Files:
    """The files being written; few large pieces go to each, rather than many small ones."""

    def __init__(
        self, directory: Path, form: EventFormat, opened: contextlib.ExitStack, names: list[str]
    ) -> None:
        self._directory = directory
        self._names = names
        self._form = form
        self._opened = opened
        self._writers: dict[str, Any] = {}
        self._held: dict[str, list[pa.Table]] = {}
        self._bytes = 0

    def add(self, name: str, rows: pa.Table) -> None:
        self._held.setdefault(name, []).append(rows)
        self._bytes += rows.nbytes
        if self._bytes > MOST_BYTES_HELD:
            self.flush()

    def flush(self) -> None:
        for name, parts in self._held.items():
            rows = pa.concat_tables(parts)
            if name not in self._writers:
                self._writers[name] = self._opened.enter_context(
                    table_writer(self._form, self._directory / self._file_name(name), rows.schema)
                )
            self._writers[name].write_table(rows)
        self._held.clear()
        self._bytes = 0

    def _file_name(self, name: str) -> str:
        stem = base = _UNSAFE.sub("_", name.replace(":", ".")).lstrip(".") or "event"
        number = 1
        # Some file systems do not tell upper from lower case.
        taken = {name.lower() for name in self._names}
        while f"{stem}.{self._form}".lower() in taken:
            number += 1
            stem = f"{base}-{number}"
        self._names.append(f"{stem}.{self._form}")
        return self._names[-1]


def _has_empty_structure(data_type: pa.DataType) -> bool:
    return any_within(data_type, lambda kind: pa.types.is_struct(kind) and not kind.num_fields)


def _row(is_text: Callable[[pa.DataType], bool], name: str, payload: pa.Schema) -> str:
    taken = set(COLUMNS)
    parts = [common_columns(name)]
    for position, field in enumerate(payload):
        expression = column_name(position)
        if is_text(field.type):
            expression = f"CAST(to_json({exact(expression, field.type)}) AS VARCHAR)"
        column = field.name
        while column.lower() in taken:
            column = f"field_{column}"
        taken.add(column.lower())
        parts.append(f"{expression} AS {identifier(column)}")
    return ", ".join(parts)
