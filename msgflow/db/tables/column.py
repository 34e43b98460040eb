"""Kinds of columns that the tables of `store` have, and what the `info` of a column may hold.

| key of `Column.info` | value |
| --- | --- |
| `unit` | of the values: `ns`, `epoch ns` (a moment), `event order`, ...; it ends the comment |
| `clock` | column of the table that leads to the clock that showed this moment |
| `is_hidden` | True: the public view does not show the column |
| `sql` | of a column that only the view has: its expression; `self` is the table |

| key of `Table.info`, as `table` sets it | value |
| --- | --- |
| `view` | description of the public view, if that shows the table as it is |
| `computed` | columns that only this view has, after the others |
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from duckdb_engine.datatypes import UBigInteger
from sqlalchemy import ARRAY, BIGINT, BOOLEAN, INTEGER, VARCHAR, Column, ForeignKey, MetaData, Table
from sqlalchemy import text as expression

if TYPE_CHECKING:
    from sqlalchemy.types import TypeEngine

STORE = MetaData(schema="store")


def table(
    name: str,
    *columns: Column[Any],
    comment: str,
    view: str | None = None,
    computed: tuple[Column[Any], ...] = (),
    of_run: bool = True,
) -> None:
    """Define a table of `store`; its rows belong to runs, which stand behind their identities."""
    if of_run:
        run = reference("run_id", "Run that the row belongs to", required=True)
        first, *others = columns
        has_identity = first.name == f"{name}_id"
        columns = (first, run, *others) if has_identity else (run, *columns)
    info: dict[str, Any] = {}
    if view is not None:
        info["view"] = view
        if computed:
            info["computed"] = computed
    Table(name, STORE, *columns, comment=comment, info=info)


def column(
    name: str,
    comment: str,
    type_: type[TypeEngine[Any]] | TypeEngine[Any],
    *,
    required: bool = False,
    default: str | None = None,
    to: str | None = None,
    **info: str | bool | None,
) -> Column[Any]:
    """Return a column, whose default is an expression of SQL; `info` as above, None for nothing."""
    keys = []
    if to is not None:
        keys.append(ForeignKey(f"{STORE.schema}.{to}"))
    if info.get("unit") is not None:
        comment = f"{comment} [{info['unit']}]"
    return Column(
        name,
        type_,
        *keys,
        nullable=not required,
        server_default=None if default is None else expression(default),
        comment=comment,
        info={key: value for key, value in info.items() if value is not None},
    )


text = partial(column, type_=VARCHAR)
number = partial(column, type_=BIGINT)
integer = partial(column, type_=INTEGER)  # of 32 bits
flag = partial(column, type_=BOOLEAN, required=True, default="false")
# A moment, as it was recorded. The public view shows it on the common time axis if it has a clock.
moment = partial(number, unit="epoch ns")
# A place in the total order of events.
event_order = partial(number, unit="event order", is_hidden=True)
# The key of a table of instances: unique, but not worth an index.
identity = partial(number, required=True)


def key(name: str, comment: str) -> Column[Any]:
    """Return the primary key of a table of entities."""
    return Column(name, BIGINT, primary_key=True, autoincrement=False, comment=comment)


def reference(
    name: str, comment: str, *, to: str | None = None, required: bool = False
) -> Column[Any]:
    """Return a column with identities of another table: `to`, or the one that its name says."""
    key = name if to is None else f"{to}_id"
    return number(name, comment, to=f"{key.removesuffix('_id')}.{key}", required=required)


def trace_id(comment: str = "Trace it was recorded in", required: bool = True) -> Column[Any]:
    """Return the trace of a row."""
    return reference("trace_id", comment, required=required)


def thread_id(
    comment: str = "Thread it happened on", name: str = "thread_id", required: bool = True
) -> Column[Any]:
    """Return a thread of a row."""
    return reference(name, comment, to="thread", required=required)


def handle(name: str, comment: str) -> Column[Any]:
    """Return an address in a process."""
    meaning = f"{comment}; an address, valid in its process until reused"
    return column(name, meaning, UBigInteger)


process_id = partial(reference, "process_id", "Process it lives in", required=True)
node_id = partial(reference, "node_id", "Node it belongs to")
# The services that a flow took on its way.
route = partial(
    column,
    "route",
    "Node (or, negative, process) that called, then services; empty: by no service",
    ARRAY(BIGINT),
    required=True,
)
