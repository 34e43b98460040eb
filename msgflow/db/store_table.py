"""Tables of the schema `store`, as `schema/store.sql` describes them.

The file is rendered from `tables`, whose definitions need SQLAlchemy: that takes longer to import
than a small ingest takes to run. The top of the file says how it is written.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from msgflow.files.resources import resource_directory
from msgflow.sql.header import Column

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

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


@dataclass(frozen=True)
class StoreColumn(Column):
    """A column of a table."""

    is_required: bool = False  # it is never NULL
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
        to=marks.get("to"),
        clock=marks.get("clock"),
        is_hidden="hidden" in marks,
        sql=marks.get("sql"),
    )
