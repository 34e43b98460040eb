"""SQL statements in files: what one needs of others is put in front, parameters go by name."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

from msgflow.files.resources import resource_directory
from msgflow.sql.header import Header, read

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    import duckdb
    import pyarrow as pa


@dataclass(frozen=True)
class Statements:
    """The statements of a folder and those below it.

    Attributes:
        directory: the folder. A statement that reads from another of kind 'inline', by its file
            name, has that one in front.
    """

    directory: Path

    def names(self) -> tuple[str, ...]:
        """Return the names of all statements, sorted; reads no file."""
        return tuple(sorted(_paths(self)))

    def header(self, name: str) -> Header:
        """Return the header of a statement."""
        return _header(self, name)

    def text(self, name: str) -> str:
        """Return the SQL of a statement, with what it needs of the others in front."""
        return _text(self, name)

    def parts(self, names: Iterable[str]) -> tuple[str, ...]:
        """Return what these statements need of the others, as a WITH clause lists it, in order."""
        needed = (part for name in names for part in _parts(self, self.header(name)))
        return tuple(f"{part} AS (\n{self.header(part).body}\n)" for part in dict.fromkeys(needed))

    def run(
        self, connection: duckdb.DuckDBPyConnection, name: str, values: Mapping[str, Any]
    ) -> duckdb.DuckDBPyRelation:
        """Return the rows of a statement."""
        (statement,) = connection.extract_statements(self.text(name))
        bound = self._bound(name, statement, values)
        return connection.sql(statement, params=bound)

    def keep(
        self, connection: duckdb.DuckDBPyConnection, name: str, values: Mapping[str, Any]
    ) -> None:
        """Make a temporary table of the rows of a statement, which has its name."""
        text = f"CREATE OR REPLACE TEMP TABLE {name} AS\n{self.text(name)}"
        (statement,) = connection.extract_statements(text)
        connection.execute(statement, self._bound(name, statement, values))

    def _bound(
        self, name: str, statement: duckdb.Statement, values: Mapping[str, Any]
    ) -> dict[str, Any]:
        inherited = {p.name: p.default for p in self.header(name).params if p.has_default}
        return {key: values.get(key, inherited.get(key)) for key in statement.named_parameters}


@contextmanager
def registered(connection: duckdb.DuckDBPyConnection, **tables: pa.Table) -> Iterator[None]:
    """Let statements read tables of this program, by their names, until the block ends."""
    for name, table in tables.items():
        connection.register(name, table)
    try:
        yield
    finally:
        for name in tables:
            connection.unregister(name)


@cache
def internal_sql() -> Statements:
    """Return what the program asks for itself: rows that become files, pictures or sentences."""
    return Statements(resource_directory("schema") / "internal")


@cache
def _paths(statements: Statements) -> Mapping[str, Path]:
    return {path.stem: path for path in statements.directory.rglob("*.sql")}


@cache
def _header(statements: Statements, name: str) -> Header:
    return read(_paths(statements)[name])


@cache
def _text(statements: Statements, name: str) -> str:
    body = statements.header(name).body
    parts = statements.parts([name])
    if not parts:
        return body
    if body.startswith("WITH "):
        return "WITH " + ",\n".join(parts) + ",\n" + body.removeprefix("WITH ")
    return "WITH " + ",\n".join(parts) + "\n" + body


def _parts(statements: Statements, header: Header) -> list[str]:
    # Each after those that it needs.
    names: list[str] = []
    for name in sorted(header.relations & _paths(statements).keys()):
        part = statements.header(name)
        if part.kind == "inline" and part is not header:
            names += [*_parts(statements, part), name]
    return list(dict.fromkeys(names))
