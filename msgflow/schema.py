"""Public views and stored tables as SQLAlchemy `MetaData`, for programs that query with it.

    from sqlalchemy import create_engine, func, select
    from msgflow.schema import public

    engine = create_engine("duckdb:///msgflow.duckdb", connect_args={"read_only": True})
    take, subscription = public.tables["take"], public.tables["subscription"]
    counted = select(subscription.c.topic_name, func.count()).join_from(take, subscription)
    with engine.connect() as connection:
        rows = connection.execute(counted.group_by(subscription.c.topic_name)).all()

`public` has the public views, which docs/data-model.md lists and which stay as they are. Their
times are on the common time axis. `store` has the tables behind them, with times as recorded; any
version of msgflow may change these. Table macros are no tables: call them through `sqlalchemy.func`
(`func.flow_forward(…).table_valued(…)`).

Each table and column has its meaning as `comment`. A column has its unit as `info["unit"]`, and a
moment the column that leads to its clock as `info["clock"]`. A `ForeignKey` is a relation, by which
`join` finds its condition. The database does not have these constraints, nor the primary keys of
views. Create databases with `msgflow ingest`, not with `create_all`.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Any

import sqlalchemy
from duckdb_engine.datatypes import UBigInteger
from sqlalchemy import ARRAY, Column, ForeignKey, MetaData, Table

from msgflow.db import objects
from msgflow.db.store_table import StoreColumn, store_tables

if TYPE_CHECKING:
    from sqlalchemy.types import TypeEngine

    from msgflow.sql.header import Column as HeaderColumn

__all__ = ["public", "store"]


def _store() -> MetaData:
    metadata = MetaData(schema="store")
    for table in store_tables().values():
        columns = (
            _column(each, each, [f"store.{each.to}.{each.to}_id"] if each.to else [], each.is_key)
            for each in table.columns.values()
        )
        Table(table.name, metadata, *columns, comment=table.grain)
    return metadata


def _public() -> MetaData:
    metadata = MetaData()
    views = {
        header.name.removeprefix("main."): header
        for header in objects.load(objects.PUBLIC)
        if header.kind == "view"
    }
    keys = {
        each.name
        for view, header in views.items()
        for each in header.columns
        if each.name == f"{view}_id"
    }
    for view, header in views.items():
        stored = store_tables().get(view)
        origins = {} if stored is None else stored.columns
        columns = (
            _column(
                each,
                origins.get(each.name),
                _relation(view, each.name, origins.get(each.name), keys),
                each.name == f"{view}_id",
            )
            for each in header.columns
        )
        Table(view, metadata, *columns, comment=f"{header.description} {header.grain}")
    return metadata


def _column(
    described: HeaderColumn, origin: StoreColumn | None, to: Collection[str], is_key: bool
) -> Column[Any]:
    unit, clock = described.unit, origin and origin.clock
    return Column(
        described.name,
        _type(described.type),
        *map(ForeignKey, to),
        primary_key=is_key,
        comment=described.description + (f" [{unit}]" if unit else ""),
        info={key: value for key, value in (("unit", unit), ("clock", clock)) if value},
    )


def _relation(view: str, name: str, origin: StoreColumn | None, keys: Collection[str]) -> list[str]:
    """Return the relation that the table of the view declares, else the one that the name says."""
    if origin is not None and origin.to:
        return [f"{origin.to}.{origin.to}_id"]
    if name in keys and name != f"{view}_id":
        return [f"{name.removesuffix('_id')}.{name}"]
    return []


def _type(name: str) -> TypeEngine[Any]:
    base, dimensions = name.rstrip("[]"), name.count("[]")
    declared = UBigInteger() if base == "UBIGINT" else getattr(sqlalchemy, base)()
    return ARRAY(declared, dimensions=dimensions) if dimensions else declared


store = _store()
public = _public()
