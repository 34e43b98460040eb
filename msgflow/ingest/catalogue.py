"""Catalogue of tracepoints: the fields to load of each event, and its staging table.

The data is in `tracepoints.toml`; this gives it Arrow and SQL form.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any, Literal

import pyarrow as pa

from msgflow.backports import tomllib

COMMON_COLUMNS = (
    ("event_id", "BIGINT"),
    ("ts_ns", "BIGINT"),
    ("trace_index", "INTEGER"),
    ("cpu_id", "INTEGER"),
    ("thread_index", "INTEGER"),
)
"""First columns of every staging table; those of kernel events have no thread."""

# For readers of the file alone: what an event means, and which versions of tracetools have it.
_WORDS = ("description", "since", "until", "where")
_FILE = Path(__file__).with_name("tracepoints.toml")


@dataclass(frozen=True)
class Field:
    """A payload field."""

    name: str  # the column, and the name in most traces
    type: str  # DuckDB's type of the column
    aliases: Sequence[str] = ()  # other names in traces


# A property of a preceding event, and the suffix of the column that holds it.
Origin = Literal["event_id", "ts_ns", "label"]
# What an event of the kernel's scheduler says of the CPU on which it happens.
CpuRole = Literal["switch", "waking", "begin", "end"]


@dataclass(frozen=True)
class Predecessor:
    """A column about the latest earlier event of a sequence on the same thread."""

    sequence: str  # the sequence of events
    origin: Origin  # the property of the earlier event that the column holds

    @property
    def column(self) -> str:
        """Name of the column, which is NULL where there is no such event."""
        return f"previous_{self.sequence}_{self.origin}"


@dataclass(frozen=True)
class Tracepoint:
    """An event."""

    name: str  # provider and event, such as 'ros2:rcl_publish'
    fields: Sequence[Field]  # its payload, over all versions
    aliases: Sequence[str] = ()  # other names that it has in traces
    sequences: Sequence[str] = ()  # sequences of its thread that the event belongs to
    predecessors: Sequence[Predecessor] = ()  # columns about the events before it
    # The name that columns of its successors show, None if no column shows it.
    label: str | None = None
    # The kernel emits it: it has no provider, and nothing to do with the thread that it
    # interrupted.
    is_kernel: bool = False
    # What it says stays true: of objects, their names and states. Who reads a part of a recording
    # needs it from all that came before.
    is_lasting: bool = False
    # Events of ROS 2 that are made of it have its id, and take its place.
    is_translated: bool = False
    is_staged: bool = True  # answers are made of it. Else it is known by its name, and left unread
    # What it says of its CPU; the begin and end of interrupts have no staging table.
    role: CpuRole | None = None
    interrupt: str | None = None  # the kind of interrupt that begins or ends

    @property
    def event(self) -> str:
        """The part after the colon."""
        return self.name.rpartition(":")[2]

    @property
    def table(self) -> str:
        """Name of the staging table."""
        return self.name.replace(":", "_")

    @property
    def common_columns(self) -> tuple[tuple[str, str], ...]:
        """First columns of the staging table."""
        return COMMON_COLUMNS[:-1] if self.is_kernel else COMMON_COLUMNS

    def arrow_schema(self) -> pa.Schema:
        """Return the payload columns as `TraceSet.batches` wants them."""
        return pa.schema(
            pa.field(
                field.name,
                _arrow_type(field.type),
                metadata={"aliases": ",".join(field.aliases)} if field.aliases else None,
            )
            for field in self.fields
        )

    def create_table_sql(self, catalog: str, known: Catalogue) -> str:
        """Return the statement that creates the staging table in this catalog or schema."""
        # Since when the thread had the CPU that leaves it (NULL: not known), and the number of the
        # switch there; the latest switch, and the interrupt that is handled.
        of_cpu = {
            "switch": (("run_start_ns", "BIGINT"), ("switch_number", "BIGINT")),
            "waking": (("switch_event_id", "BIGINT"), ("interrupt", enum_type(known.interrupts))),
        }
        label = {"label": enum_type(known.labels)}
        columns = (
            *self.common_columns,
            *((before.column, label.get(before.origin, "BIGINT")) for before in self.predecessors),
            *of_cpu.get(self.role or "", ()),
            *((field.name, field.type) for field in self.fields),
        )
        body = ",\n".join(f'    "{column}" {sql_type}' for column, sql_type in columns)
        return f'CREATE TABLE "{catalog}"."{self.table}" (\n{body}\n)'


USER_EVENT = Tracepoint(
    name="user_event",
    fields=(Field("name", "VARCHAR"), Field("fields", "VARCHAR")),
    predecessors=(Predecessor("call", "event_id"),),
)
"""What is staged of events that the user asks for, whatever they are called: their name, and their
fields as JSON. Behind a gap they tell, as calls do, that the thread went on."""


@dataclass(frozen=True)
class Catalogue:
    """All tracepoints."""

    tracepoints: Mapping[str, Tracepoint]  # by name, in the order of the file

    @cached_property
    def staged(self) -> Mapping[str, Tracepoint]:
        """What has a staging table, by name: tracepoints, and `USER_EVENT`."""
        staged = {n: t for n, t in self.tracepoints.items() if t.interrupt is None and t.is_staged}
        return {**staged, USER_EVENT.name: USER_EVENT}

    @property
    def interrupts(self) -> tuple[str, ...]:
        """Kinds of interrupts, in alphabetical order."""
        return tuple(sorted({t.interrupt for t in self.tracepoints.values() if t.interrupt}))

    @cached_property
    def in_traces(self) -> Mapping[str, Tracepoint]:
        """The tracepoints by every name that they have in traces."""
        return {
            name: tracepoint
            for tracepoint in self.tracepoints.values()
            for name in (tracepoint.name, *tracepoint.aliases)
        }

    @property
    def of_threads(self) -> tuple[Tracepoint, ...]:
        """What is staged of threads of processes: all but the kernel's tracepoints."""
        return tuple(t for t in self.staged.values() if not t.is_kernel)

    @property
    def sequences(self) -> tuple[str, ...]:
        """Names of all sequences, in alphabetical order."""
        return tuple(sorted({name for t in self.tracepoints.values() for name in t.sequences}))

    @property
    def labels(self) -> tuple[str, ...]:
        """All labels, in alphabetical order."""
        return tuple(sorted({t.label for t in self.tracepoints.values() if t.label is not None}))

    def arrow_schemas(self) -> dict[str, pa.Schema]:
        """Return the payload columns of all to read: the `wanted` of `TraceSet.batches`."""
        return {
            name: tracepoint.arrow_schema()
            for name, tracepoint in self.in_traces.items()
            if tracepoint.is_staged
        }


@cache
def load() -> Catalogue:
    """Read the catalogue that comes with msgflow."""
    entries = tomllib.loads(_FILE.read_text(encoding="utf-8"))["tracepoint"]
    return Catalogue({entry["name"]: _tracepoint(entry) for entry in entries})


def _tracepoint(entry: dict[str, Any]) -> Tracepoint:
    given = {
        "fields": [Field(**_without_words(field)) for field in entry["fields"]],
        "predecessors": [Predecessor(*text.split(".")) for text in entry.get("predecessors", ())],
    }
    return Tracepoint(**{**_without_words(entry), **given})


def _without_words(entry: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in entry.items() if name not in _WORDS}


def _arrow_type(sql_type: str) -> pa.DataType:
    if sql_type.endswith("[]"):
        return pa.list_(_arrow_type(sql_type.removesuffix("[]")))
    return {
        "UBIGINT": pa.uint64(),
        "BIGINT": pa.int64(),
        "INTEGER": pa.int32(),
        "UTINYINT": pa.uint8(),
        "VARCHAR": pa.string(),
    }[sql_type]


def enum_type(values: Iterable[str]) -> str:
    """Return DuckDB's type of a column that holds some of these texts: a byte each, not a text."""
    return f"ENUM({', '.join(repr(value) for value in values)})"
