"""SQL statements in files: what one needs of others is put in front, parameters go by name."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgflow.files.resources import resource_directory
from msgflow.sql.header import Header, read

if TYPE_CHECKING:
    import duckdb
    import pyarrow as pa

_AT_ONCE = 20_000
# Parameters of statements that are false where no recording of the database has any of it: what
# stands behind `WHERE $has_kernel` is not planned there.
RECORDED = {
    "has_kernel": "EXISTS (FROM store.thread_state)",
    "has_usage": "EXISTS (FROM store.thread_usage)",
    "has_calls": "EXISTS (FROM store.request)",
    "has_turns": "EXISTS (FROM store.flow_call)"
    " OR EXISTS (FROM store.link_causal WHERE kind <> 'direct')"
    " OR EXISTS (FROM store.callback_instance WHERE continues_id IS NOT NULL)",
    "has_teams": "EXISTS (FROM derive.executor_size WHERE thread_count > 1)",
    "has_gaps": "EXISTS (FROM store.gap)",
    "has_pauses": "EXISTS (FROM store.gap WHERE kind = 'pause')",
    "has_steps": "EXISTS (FROM store.stamp_clock)",
    "has_unnamed": "EXISTS (FROM store.publisher WHERE topic_name IS NULL OR is_topic_learned)"
    " OR EXISTS (FROM store.subscription WHERE topic_name IS NULL OR is_topic_learned)",
    "has_clocks": "(SELECT count(*) > 1 FROM store.clock)",
    "has_open_callbacks": "EXISTS (FROM store.callback_instance WHERE end_ns IS NULL)",
    "has_orphans": "EXISTS (FROM store.orphan_take)",
    "has_failed_takes": "EXISTS (FROM store.failed_take)",
    "has_states": "EXISTS (FROM store.lifecycle_transition)",
}


class Statements:
    """The statements of a folder and those below it.

    One that reads from another of kind 'inline', by its file name, has that one in front.
    """

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self._paths = {path.stem: path for path in directory.rglob("*.sql")}
        self._headers: dict[str, Header] = {}
        self._texts: dict[str, str] = {}

    def names(self) -> tuple[str, ...]:
        """Return the names of all statements, sorted; reads no file."""
        return tuple(sorted(self._paths))

    def header(self, name: str) -> Header:
        """Return the header of a statement."""
        if name not in self._headers:
            self._headers[name] = read(self._paths[name])
        return self._headers[name]

    def text(self, name: str) -> str:
        """Return the SQL of a statement, with what it needs of the others in front."""
        if name not in self._texts:
            body = self.header(name).body
            needed = self._needed(self.header(name))
            parts = [f"{part} AS (\n{self.header(part).body}\n)" for part in needed]
            if parts:
                gap = ",\n" if body.startswith("WITH ") else "\n"
                body = "WITH " + ",\n".join(parts) + gap + body.removeprefix("WITH ")
            self._texts[name] = body
        return self._texts[name]

    def _needed(self, header: Header) -> list[str]:
        # Each after those that it needs.
        names: list[str] = []
        for name in sorted(header.relations & self._paths.keys()):
            part = self.header(name)
            if part.kind == "inline" and part is not header:
                names += [*self._needed(part), name]
        return list(dict.fromkeys(names))

    def run(
        self, connection: duckdb.DuckDBPyConnection, name: str, values: Mapping[str, Any]
    ) -> duckdb.DuckDBPyRelation:
        """Return the rows of a statement."""
        (statement,) = connection.extract_statements(self.text(name))
        bound = self._bound(name, statement, values)
        return connection.sql(statement, params=bound)

    def rows(
        self, connection: duckdb.DuckDBPyConnection, name: str, values: Mapping[str, Any]
    ) -> Iterator[dict[str, Any]]:
        """Yield the rows of a statement; memory never holds all of them."""
        with self.run(connection, name, values).to_arrow_reader(_AT_ONCE) as reader:
            for batch in reader:
                yield from batch.to_pylist()

    def keep(
        self, connection: duckdb.DuckDBPyConnection, name: str, values: Mapping[str, Any]
    ) -> None:
        """Make a temporary table of the rows of a statement, which has its name."""
        header = self.header(name)
        text = f"CREATE OR REPLACE TEMP TABLE {name} AS\n{self.text(name)}"
        if not may_have_rows(connection, header.sources, values):
            columns = ", ".join(f"{column.name} {column.type}" for column in header.columns)
            text = f"CREATE OR REPLACE TEMP TABLE {name} ({columns})"
        (statement,) = connection.extract_statements(text)
        connection.execute(statement, self._bound(name, statement, values))

    def unite(
        self, connection: duckdb.DuckDBPyConnection, table: str, values: Mapping[str, Any]
    ) -> None:
        """Make a temporary table of the rows of all statements: `kind` is the name of each."""
        kinds = [name for name in self.names() if self.header(name).kind != "inline"]
        rows = (f"SELECT '{name}' AS kind, *\nFROM (\n{self.text(name)}\n)" for name in kinds)
        text = f"CREATE OR REPLACE TEMP TABLE {table} AS\n" + "\nUNION ALL BY NAME\n".join(rows)
        (statement,) = connection.extract_statements(text)
        connection.execute(statement, {key: values[key] for key in statement.named_parameters})

    def _bound(
        self, name: str, statement: duckdb.Statement, values: Mapping[str, Any]
    ) -> dict[str, Any]:
        inherited = {p.name: p.default for p in self.header(name).params if p.has_default}
        return {key: values.get(key, inherited.get(key)) for key in statement.named_parameters}


def recorded(
    connection: duckdb.DuckDBPyConnection, names: Collection[str] = tuple(RECORDED)
) -> dict[str, bool]:
    """Return what the recordings of a database have, by these names of RECORDED."""
    if not names:
        return {}
    sql = f"SELECT {', '.join(RECORDED[name] for name in names)}"
    (row,) = connection.execute(sql).fetchall()
    return dict(zip(names, row, strict=True))


def may_have_rows(
    connection: duckdb.DuckDBPyConnection,
    sources: Collection[tuple[str, str]],
    values: Mapping[str, Any],
    rows_of: Callable[[str], str] = str,
) -> bool:
    """Tell whether a source of a header or step has a row. Without sources the answer is yes."""
    return not sources or bool(with_rows(connection, sources, values, rows_of))


def with_rows(
    connection: duckdb.DuckDBPyConnection,
    sources: Collection[tuple[str, str]],
    values: Mapping[str, Any],
    rows_of: Callable[[str], str] = str,
) -> set[tuple[str, str]]:
    """Return the sources that have a row; `rows_of` says what follows FROM for a name."""
    text = " UNION ALL ".join(
        f"(SELECT {place} FROM {rows_of(name)} WHERE {condition or 'true'} LIMIT 1)"
        for place, (name, condition) in enumerate(sources)
    )
    if not text:
        return set()
    bound = {key: values[key] for key in connection.extract_statements(text)[0].named_parameters}
    found = {place for (place,) in connection.execute(text, bound).fetchall()}
    return {source for place, source in enumerate(sources) if place in found}


@contextmanager
def registered(
    connection: duckdb.DuckDBPyConnection, **tables: pa.Table | pa.RecordBatch
) -> Iterator[None]:
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
def culprit_sql() -> Statements:
    """Return the kinds of culprits: what makes data late, or lets them get lost."""
    return Statements(resource_directory("schema") / "culprit")


@cache
def health_sql() -> Statements:
    """Return the kinds of findings: what is worth knowing about input, recording and database."""
    return Statements(resource_directory("schema") / "health")
