"""Public views that show a table as it is, with its times corrected: made of its declaration."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from msgflow.db import tables
from msgflow.sql.header import Column, Header

if TYPE_CHECKING:
    from collections.abc import Iterator

# Where the way from a row to its clock ends: who has it, with which key.
_CLOCKS = {"process": "derive.process_clock", "clock": "store.clock"}


def table_views() -> tuple[Header, ...]:
    """Return a header for each table that says what its view is."""
    return tuple(_view(table) for table in tables.TABLES.values() if table.view is not None)


def declared_columns(name: str) -> dict[str, Column]:
    """Return the columns by name that a table of `store` declares for public views."""
    return {column.name: _described(column) for column in tables.TABLES[name].declared}


def _view(table: tables.Table) -> Header:
    columns = [column for column in table.declared if column.is_public]
    ways = dict.fromkeys(column.clock_of for column in columns)
    joins = [join for way in ways if way is not None for join in _joins(table, way)]
    selected = ",\n".join(f"    {_expression(column)}" for column in columns)
    joined = "".join(
        f"\n{kind} {relation} AS {alias} ON {condition}"
        for kind, relation, alias, condition in joins
    )
    return Header(
        name=f"main.{table.name}",
        title=f"main.{table.name}",
        description=table.view or "",
        grain=f"{table.comment[:1].lower()}{table.comment[1:]}",
        kind="view",
        params=(),
        columns=tuple(_described(column) for column in columns),
        severity=None,
        cause=None,
        cure=None,
        note=None,
        body=f"SELECT\n{selected}\nFROM {table.full_name} AS self{joined}\n",
        path=Path(tables.__file__),
    )


def _described(column: tables.Column) -> Column:
    return Column(column.name, column.type, column.unit, column.description)


def _expression(column: tables.Column) -> str:
    sql, way = column.sql, column.clock_of
    if sql is not None:
        return f"{sql} AS {column.name}"
    if way is None:
        return f"self.{column.name}"
    clock = _clock_alias(way)
    return (
        f"derive.corrected_ns(self.{column.name}, {clock}.offset_ns, {clock}.drift_ppb, "
        f"{clock}.reference_ns) AS {column.name}"
    )


def _joins(table: tables.Table, way: str) -> Iterator[tuple[str, str, str, str]]:
    """Yield (kind, relation, alias, condition) of the joins from a row to its clock.

    Args:
        table: the table, which is called `self`.
        way: its column that leads there.
    """
    at, kind = "self", "JOIN"
    column = table.columns[way]
    while True:
        # Who has no thread or node has no clock either, and stays all the same.
        kind = kind if column.is_required else "LEFT JOIN"
        reference = column.references or f"{table.name}.{column.name}"
        target, _, key = reference.partition(".")
        if target in _CLOCKS:
            clock = _clock_alias(way)
            yield kind, _CLOCKS[target], clock, f"{at}.{column.name} = {clock}.{key}"
            return
        alias = way.removesuffix("_id") if at == "self" else f"{at}_{target}"
        yield kind, f"{tables.SCHEMA}.{target}", alias, f"{at}.{column.name} = {alias}.{key}"
        at, table = alias, tables.TABLES[target]
        column = _way_on(table)


def _way_on(table: tables.Table) -> tables.Column:
    """Return the column of a table that leads to a clock: where several do, the shortest way."""
    return next(
        table.columns[key] for key in ("clock_id", "host_id", "process_id") if key in table.columns
    )


def _clock_alias(way: str) -> str:
    return f"{way.removesuffix('_id')}_clock"
