"""Tables of the schema `store`, as `schema/store.sql` defines them, and their public views.

The top of that file says how it is written. `msgflow.schema` makes tables of SQLAlchemy of them,
which takes longer to import than a small ingest takes to run.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from msgflow.files.resources import resource_directory
from msgflow.sql.header import Column, Header

_TABLE = re.compile(
    r"^-- (?P<grain>.*)\n(?:-- view: (?P<view>(?:.*\n-- )*.*)\n)?"
    r"CREATE TABLE store\.(?P<name>\w+) \(\n(?P<columns>(?: .*\n)+)\);",
    re.MULTILINE,
)
_COLUMN = re.compile(
    r"^    (?:-- )?(?P<name>\w+) (?P<type>[A-Z]+(?:\[\])*)(?P<more>[A-Za-z ]*),?"
    r"  -- (?P<meaning>.*(?:\n        -- .*)*)",
    re.MULTILINE,
)
_MEANING = re.compile(r"(?P<text>.*?)(?: \[(?P<unit>[^\]]+)\])?(?P<marks>(?: \{[^}]+\})*)")
_MARK = re.compile(r"\{(\w+) ?([^}]*)\}")
_BREAK = re.compile(r"\n *-- ")
# Tables at which the way from a row to its clock ends, each with the relation that has the clock.
_CLOCKS = {"process": "derive.process_clock", "clock": "store.clock"}


@dataclass(frozen=True)
class StoreColumn(Column):
    """A column of a table."""

    is_required: bool = False  # it is never NULL
    is_key: bool = False  # it is the primary key
    to: str | None = None  # table to whose rows it refers, by their key
    # Of a moment: column of the table that leads to the clock that showed it.
    clock: str | None = None
    is_hidden: bool = False  # the public view does not show it
    sql: str | None = None  # of a column that only the view has: its expression


@dataclass(frozen=True)
class StoreTable:
    """A table."""

    name: str  # without its schema
    grain: str  # what one row is
    view: str | None  # what the public view has, if that shows the table as it is
    columns: Mapping[str, StoreColumn]  # of the table, by name
    computed: tuple[StoreColumn, ...]  # columns that only this view has

    @property
    def key(self) -> str:
        """The name of the column with the identities of its rows, if it has one."""
        return f"{self.name}_id"


def store_file() -> Path:
    """Return the file that creates the tables."""
    return resource_directory("schema") / "store.sql"


@cache
def store_tables() -> Mapping[str, StoreTable]:
    """Return the tables by name."""
    text = store_file().read_text(encoding="utf-8")
    return {match["name"]: _table(match) for match in _TABLE.finditer(text)}


def _table(match: re.Match[str]) -> StoreTable:
    columns = [_column(each) for each in _COLUMN.finditer(match["columns"])]
    return StoreTable(
        name=match["name"],
        grain=match["grain"],
        view=match["view"] and _BREAK.sub(" ", match["view"]),
        columns={each.name: each for each in columns if each.sql is None},
        computed=tuple(each for each in columns if each.sql is not None),
    )


def _column(match: re.Match[str]) -> StoreColumn:
    meaning = _MEANING.fullmatch(_BREAK.sub(" ", match["meaning"]))
    assert meaning is not None
    marks = dict(_MARK.findall(meaning["marks"]))
    return StoreColumn(
        match["name"],
        match["type"],
        meaning["unit"],
        meaning["text"],
        is_required="NOT NULL" in match["more"] or "PRIMARY KEY" in match["more"],
        is_key="PRIMARY KEY" in match["more"],
        to=marks.get("to"),
        clock=marks.get("clock"),
        is_hidden="hidden" in marks,
        sql=marks.get("sql"),
    )


def table_views() -> tuple[Header, ...]:
    """Return a header for each table that says what its view is."""
    return tuple(_view(table, table.view) for table in store_tables().values() if table.view)


def _view(table: StoreTable, description: str) -> Header:
    columns = [column for column in table.columns.values() if not column.is_hidden]
    columns += table.computed
    ways = dict.fromkeys(column.clock for column in columns if column.clock)
    joins = [join for way in ways for join in _joins(table, way)]
    selected = ",\n".join(f"    {_expression(column)}" for column in columns)
    joined = "".join(
        f"\n{kind} {relation} AS {alias} ON {condition}"
        for kind, relation, alias, condition in joins
    )
    return Header(
        name=f"main.{table.name}",
        title=f"main.{table.name}",
        description=description,
        grain=f"{table.grain[:1].lower()}{table.grain[1:]}",
        kind="view",
        columns=tuple(columns),
        body=f"SELECT\n{selected}\nFROM store.{table.name} AS self{joined}\n",
        path=store_file(),
    )


def _expression(column: StoreColumn) -> str:
    if column.sql:
        return f"{column.sql} AS {column.name}"
    if not column.clock:
        return f"self.{column.name}"
    clock = _clock_alias(column.clock)
    return f"derive.corrected_ns(self.{column.name}, {clock}) AS {column.name}"


def _joins(table: StoreTable, way: str) -> Iterator[tuple[str, str, str, str]]:
    """Yield (kind, relation, alias, condition) of the joins from a row, `self`, to its clock."""
    at, kind, column = "self", "JOIN", table.columns[way]
    while True:
        # A row without a thread or node has no clock either. The view shows it all the same.
        kind = kind if column.is_required else "LEFT JOIN"
        target = store_tables()[column.to or table.name]
        if target.name in _CLOCKS:
            relation, clock = _CLOCKS[target.name], _clock_alias(way)
            yield kind, relation, clock, f"{at}.{column.name} = {clock}.{target.key}"
            return
        alias = way.removesuffix("_id") if at == "self" else f"{at}_{target.name}"
        condition = f"{at}.{column.name} = {alias}.{target.key}"
        yield kind, f"store.{target.name}", alias, condition
        # Of several columns that lead to a clock, that of the shortest way.
        ways_on = ("clock_id", "host_id", "process_id")
        at, column = alias, next(target.columns[on] for on in ways_on if on in target.columns)


def _clock_alias(way: str) -> str:
    return f"{way.removesuffix('_id')}_clock"
