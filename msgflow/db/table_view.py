"""Public views that show a table as it is, with its times corrected: made of its declaration."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgflow.db import tables
from msgflow.db.table_ddl import type_name
from msgflow.db.tables import STORE
from msgflow.sql.header import Column as HeaderColumn
from msgflow.sql.header import Header

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import Column, Table

# Tables at which the way from a row to its clock ends, each with the relation that has the clock.
_CLOCKS = {"process": "derive.process_clock", "clock": "store.clock"}


def table_views() -> tuple[Header, ...]:
    """Return a header for each table that says what its view is."""
    return tuple(_view(table) for table in STORE.tables.values() if "view" in table.info)


def declared_columns(name: str) -> dict[str, HeaderColumn]:
    """Return the columns by name that a table of `store` declares for public views."""
    columns = STORE.tables[f"store.{name}"].columns
    return {column.name: _described(column) for column in columns}


def _view(table: Table) -> Header:
    columns = [column for column in table.columns if "is_hidden" not in column.info]
    columns += table.info.get("computed", ())
    ways = dict.fromkeys(column.info["clock"] for column in columns if "clock" in column.info)
    joins = [join for way in ways for join in _joins(table.columns[way])]
    selected = ",\n".join(f"    {_expression(column)}" for column in columns)
    joined = "".join(
        f"\n{kind} {relation} AS {alias} ON {condition}"
        for kind, relation, alias, condition in joins
    )
    grain = table.comment or ""
    return Header(
        name=f"main.{table.name}",
        title=f"main.{table.name}",
        description=table.info["view"],
        grain=f"{grain[:1].lower()}{grain[1:]}",
        kind="view",
        params=(),
        columns=tuple(_described(column) for column in columns),
        severity=None,
        cause=None,
        cure=None,
        note=None,
        body=f"SELECT\n{selected}\nFROM {table.fullname} AS self{joined}\n",
        path=Path(tables.__file__),
    )


def _described(column: Column[Any]) -> HeaderColumn:
    unit = column.info.get("unit")
    comment = (column.comment or "").removesuffix(f" [{unit}]")
    return HeaderColumn(column.name, type_name(column), unit, comment)


def _expression(column: Column[Any]) -> str:
    if "sql" in column.info:
        return f"{column.info['sql']} AS {column.name}"
    if "clock" not in column.info:
        return f"self.{column.name}"
    clock = _clock_alias(column.info["clock"])
    return (
        f"derive.corrected_ns(self.{column.name}, {clock}.offset_ns, {clock}.drift_ppb, "
        f"{clock}.reference_ns) AS {column.name}"
    )


def _joins(way: Column[Any]) -> Iterator[tuple[str, str, str, str]]:
    """Yield (kind, relation, alias, condition) of the joins from a row, `self`, to its clock.

    Args:
        way: the column of the row that leads there.
    """
    at, kind, column = "self", "JOIN", way
    while True:
        # A row without a thread or node has no clock either. The view shows it all the same.
        kind = "LEFT JOIN" if column.nullable else kind
        target = next((key.column for key in column.foreign_keys), column)
        if target.table.name in _CLOCKS:
            relation, clock = _CLOCKS[target.table.name], _clock_alias(way.name)
            yield kind, relation, clock, f"{at}.{column.name} = {clock}.{target.name}"
            return
        alias = way.name.removesuffix("_id") if at == "self" else f"{at}_{target.table.name}"
        condition = f"{at}.{column.name} = {alias}.{target.name}"
        yield kind, target.table.fullname, alias, condition
        at, column = alias, _way_on(target.table)


def _way_on(table: Table) -> Column[Any]:
    """Return the column of a table that leads to a clock: of several the shortest way."""
    return next(
        table.columns[key] for key in ("clock_id", "host_id", "process_id") if key in table.columns
    )


def _clock_alias(way: str) -> str:
    return f"{way.removesuffix('_id')}_clock"
