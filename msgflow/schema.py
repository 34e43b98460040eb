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
moment the column that leads to its clock as `info["clock"]`; `msgflow.db.tables.column` lists all
keys. A `ForeignKey` is a relation, by which `join` finds its condition. The database does not have
these constraints, nor the primary keys of views. Create databases with `msgflow ingest`, not with
`create_all`.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Any

import sqlalchemy
from duckdb_engine.datatypes import UBigInteger
from sqlalchemy import ARRAY, Column, ForeignKey, MetaData, Table

from msgflow.db import objects
from msgflow.db.tables import STORE

if TYPE_CHECKING:
    from sqlalchemy.types import TypeEngine

    from msgflow.sql.header import Column as HeaderColumn

__all__ = ["public", "store"]


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
        columns = [_column(view, described, keys) for described in header.columns]
        Table(view, metadata, *columns, comment=f"{header.description} {header.grain}")
    return metadata


def _column(view: str, described: HeaderColumn, keys: Collection[str]) -> Column[Any]:
    stored = STORE.tables.get(f"store.{view}")
    origin = None if stored is None else stored.columns.get(described.name)
    unit = described.unit
    return Column(
        described.name,
        _type(described.type),
        *_relation(view, described.name, origin, keys),
        primary_key=described.name == f"{view}_id",
        comment=described.description + (f" [{unit}]" if unit else ""),
        info=dict(origin.info) if origin is not None else {"unit": unit} if unit else {},
    )


def _relation(
    view: str, name: str, origin: Column[Any] | None, keys: Collection[str]
) -> list[ForeignKey]:
    """Return the relation that the table of the view declares, else the one that the name says."""
    declared = [] if origin is None else [key.column for key in origin.foreign_keys]
    if declared:
        return [ForeignKey(f"{declared[0].table.name}.{declared[0].name}")]
    if name in keys and name != f"{view}_id":
        return [ForeignKey(f"{name.removesuffix('_id')}.{name}")]
    return []


def _type(name: str) -> TypeEngine[Any]:
    base, dimensions = name.rstrip("[]"), name.count("[]")
    declared = UBigInteger() if base == "UBIGINT" else getattr(sqlalchemy, base)()
    return ARRAY(declared, dimensions=dimensions) if dimensions else declared


store = STORE
public = _public()
