"""A connection for the same statements over and over."""

from __future__ import annotations

from typing import Any, cast

import duckdb


def parsing_once(connection: duckdb.DuckDBPyConnection) -> duckdb.DuckDBPyConnection:
    """Return the connection, which from now on parses each text that it executes once.

    On a few rows, a statement of the model takes longer to parse than to run.
    """
    return cast("duckdb.DuckDBPyConnection", _ParsingOnce(connection))


class _ParsingOnce:
    def __init__(self, connection: duckdb.DuckDBPyConnection) -> None:
        self._connection = connection
        self._known: dict[str, duckdb.Statement] = {}

    def __getattr__(self, name: str) -> Any:
        return getattr(self._connection, name)

    def execute(
        self, query: str | duckdb.Statement, parameters: object = None
    ) -> duckdb.DuckDBPyConnection:
        if not isinstance(query, str):
            return self._connection.execute(query, parameters)
        if query not in self._known:
            statements = self._connection.extract_statements(query)
            if len(statements) != 1:
                return self._connection.execute(query, parameters)
            (self._known[query],) = statements
        return self._connection.execute(self._known[query], parameters)
