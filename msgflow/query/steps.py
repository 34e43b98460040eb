"""Temporary tables that queries make on the way to their results."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any, Self

import duckdb

if TYPE_CHECKING:
    from collections.abc import Mapping

    from msgflow.sql.header import Header


class Steps:
    """The tables of the steps of queries: those that several queries share are made once.

    Two queries share a table if the same statement makes it, with the same values. The tables are
    dropped at the end of the `with` block. `known` names for a table the query that has its rows at
    less cost, from tables that are there by then.
    """

    def __init__(
        self,
        connection: duckdb.DuckDBPyConnection,
        known: Mapping[str, str] | None = None,
    ) -> None:
        self._connection = connection
        self._known = known or {}
        self._made: dict[str, tuple[str, dict[str, Any]]] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        for table in self._made:
            # An interrupt of the query may interrupt this, too; the next query replaces the table.
            with contextlib.suppress(duckdb.Error):
                self._connection.execute(f"DROP TABLE IF EXISTS temp.{table}")

    def make(self, header: Header, values: Mapping[str, Any]) -> None:
        """Make the tables of a query that are not there yet, for these values of its parameters."""
        for step in header.steps:
            names = self._connection.extract_statements(step.sql)[0].named_parameters
            wanted = step.sql, {name: values[name] for name in names}
            if self._made.get(step.table) == wanted:
                continue
            if step.table in self._made:
                # What was made of the old rows has to be made again: that stands behind it.
                made = list(self._made)
                self._made |= dict.fromkeys(made[made.index(step.table) :], ("", {}))
            self._made[step.table] = "", {}
            if known := self._known.get(step.table):
                self._connection.execute(f"CREATE OR REPLACE TEMP TABLE {step.table} AS {known}")
            else:
                self._connection.execute(*wanted)
            self._made[step.table] = wanted
