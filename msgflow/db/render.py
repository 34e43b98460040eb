"""Renders `schema/tables.sql`, the tables as new databases have them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.db.tables import metadata

if TYPE_CHECKING:
    from sqlalchemy import Table

HEADING = """\
-- Generated from msgflow/db/tables.py by `python -m msgflow.db.render`; do not edit.
-- The tables behind the public views. Users read the views of schema main, not these.
"""


def render() -> str:
    """Return the text of `schema/tables.sql`."""
    return HEADING + "".join(_render_table(table) for table in metadata.tables.values())


def _render_table(table: Table) -> str:
    columns = list(table.columns)
    names = max(len(column.name) for column in columns)
    lines = []
    for position, column in enumerate(columns):
        kind = column.type.compile()
        constraint = (
            " PRIMARY KEY" if column.primary_key else "" if column.nullable else " NOT NULL"
        )
        comma = "," if position + 1 < len(columns) else ""
        reference = column.info.get("references")
        arrow = f" -> {reference}" if reference else ""
        definition = f"    {column.name:<{names}} {kind}{constraint}{comma}"
        lines.append(f"{definition:<48} -- {column.comment}{arrow}")
    body = "\n".join(lines)
    return f"\n-- {table.comment}.\nCREATE TABLE {table.fullname} (\n{body}\n);\n"


if __name__ == "__main__":
    print(render(), end="")
