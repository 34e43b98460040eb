"""Public views that show a table as it is, with its times corrected: made of its description."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.db.store_table import store_file, store_tables
from msgflow.sql.header import Header

if TYPE_CHECKING:
    from collections.abc import Iterator

    from msgflow.db.store_table import StoreColumn, StoreTable

# Tables at which the way from a row to its clock ends, each with the relation that has the clock.
_CLOCKS = {"process": "derive.process_clock", "clock": "store.clock"}


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
        params=(),
        columns=tuple(columns),
        severity=None,
        cause=None,
        cure=None,
        note=None,
        body=f"SELECT\n{selected}\nFROM store.{table.name} AS self{joined}\n",
        path=store_file(),
    )


def _expression(column: StoreColumn) -> str:
    if column.sql:
        return f"{column.sql} AS {column.name}"
    if not column.clock:
        return f"self.{column.name}"
    clock = _clock_alias(column.clock)
    return (
        f"derive.corrected_ns(self.{column.name}, {clock}.offset_ns, {clock}.drift_ppb, "
        f"{clock}.reference_ns) AS {column.name}"
    )


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
        at, column = alias, _way_on(target)


def _way_on(table: StoreTable) -> StoreColumn:
    """Return the column of a table that leads to a clock: of several the shortest way."""
    return next(
        table.columns[key] for key in ("clock_id", "host_id", "process_id") if key in table.columns
    )


def _clock_alias(way: str) -> str:
    return f"{way.removesuffix('_id')}_clock"
