"""Golden cases: a file with sparse input rows and the output that they have to give.

    cases/<query or view>/<case>.case has sections, each below a line that names it:

        == system NAME       what several cases have in common, in tests/support/systems: the tables
                             of NAME.case, each unless the case has it too; or SQL, NAME.sql, that
                             fills the store beside the rows of BASE
        == thorough          only `make test-all` runs it: another case shows the same on other rows
        == derive            if this section is there, links are derived before; without it only
                             what the graph of flows makes of the links given
        == params            parameters of the query, and run, start, end, internal; or
                             arguments of the macro, as JSON
        == TABLE             rows of store.TABLE as CSV; columns left out are NULL, or where it
                             forbids NULL 1 for a key, else 0, false or an empty text
        == scratch TABLE     of page queries over what pages compute once per run, and of macros
                             over a table that they are given: its rows; `name::TYPE` where
                             the text of a column does not show its type
        == staging TABLE     of what was read: the columns of staging.TABLE that are needed
        == expected          the output in order; leave it empty for a new case, then let
                             `pytest --update-golden` write it, and read what it wrote

A query is run as `Database.query` runs it; what the program asks for itself (internal.<name>, or
culprit.<kind>) of run 1, likewise over tables of scratch and the limits of `noticed`, sorted where
it has no order; a page query (view.<name>) of run 1, with times from 0 and a window of 4000 ns
where the parameters say nothing else; a view (its full name, such as `main.node`) or a finding
(`finding.NAME`) is read whole, a table macro called with its arguments, all sorted by all columns.
An empty field is NULL, "" is an empty text. Lines that begin with # are comments. Tables of BASE
that a case leaves out have one row, of key 1.
"""

from __future__ import annotations

import io
import json
import re
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from functools import cache
from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa
import pytest

from msgflow.db import objects
from msgflow.db.derivation import (
    derive_findings,
    derive_table,
    derived_tables,
    learn_topics,
)
from msgflow.db.finding import kinds, statement
from msgflow.db.migration import create
from msgflow.export.formats import Format, write_result
from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow.result.query_result import QueryResult
from msgflow.run.slice import Slice
from msgflow.sql.quoting import literal
from msgflow.sql.statement import RECORDED, Statements, culprit_sql, internal_sql
from msgflow.view.page_query import DIRECTORY, Scratch, run_page_query

Rows = list[list[str | None]]

BASE: dict[str, dict[str, str]] = {
    "run": {"run_id": "1", "name": "case", "start_ns": "0"},
    "clock": {"clock_id": "1", "method": "none"},
    "host": {"host_id": "1", "hostname": "host"},
    "trace": {"trace_id": "1", "path": "trace"},
    "process": {"process_id": "1", "pid": "1", "name": "process"},
    "thread": {"thread_id": "1", "tid": "1", "name": "thread"},
}
SYSTEMS = Path(__file__).parent / "systems"
# Of the tables that flows are made of, in the order in which they are derived.
FLOW = tuple(
    name
    for name in derived_tables()
    if f"derive.{name}" in {header.name for header in objects.load("flow")}
)
_NEUTRAL = {"VARCHAR": "", "BOOLEAN": "false", "TIMESTAMP": "1970-01-01"}
_SLICE = tuple(field.name for field in fields(Slice))
_PAGE_QUERY = "view."
# What the program asks for itself, by the schema of its names.
_OF_PROGRAM = {"internal": internal_sql, "culprit": culprit_sql}
_FINDING = "finding."
# What the cases of all findings show; a column of the place only where a row has it.
_OF_FINDINGS = ("run_id", "trace_id", "name", "subject", "count", "detail")
_FRAME = {"run": 1, "run_id": 1, "runs": [1], "origin_ns": 0, "start_ns": 0, "end_ns": 4_000}
_FRAME |= dict.fromkeys(RECORDED, True)
_BENCH = pytest.StashKey["Bench"]()
# (name, type, whether it may be NULL) of the columns of each table of the store.
_COLUMNS: dict[str, list[tuple[str, str, bool]]] = {}
_SECTION = "== "
# A name without a schema is that of a public view.
_NAME = re.compile(r"(?:\b(store|derive|main)\.)?\b([a-z_0-9]+)\b")
_EXPECTED = "expected"
# Of few rows any plan is as good as the best, and to look for that takes longer than to run it.
# Without these optimizers some statements cannot be planned, or take far longer; what the others
# do to results is nothing, and every test of a whole recording has them.
_OPTIMIZERS = (
    "expression_rewriter",
    "filter_pushdown",
    "cte_filter_pusher",
    "in_clause",
    "deliminator",
    "unnest_rewriter",
    "unused_columns",
    "column_lifetime",
    "materialized_cte",
    "cte_inlining",
)


@dataclass
class Case:
    """What the file of a case, or of a system, says.

    Attributes:
        system: name of the system it is about, if any.
        is_thorough: whether only `make test-all` runs it.
        derives: whether links are derived.
        parameters: None where it gives none.
        tables: CSV of the rows of each table.
        scratch: CSV of the rows of each table that pages compute.
        staging: CSV of the rows of each table of what was read.
        expected: CSV of the output.
    """

    system: str | None = None
    is_thorough: bool = False
    derives: bool = False
    parameters: dict[str, Any] | None = None
    tables: dict[str, str] = field(default_factory=dict)
    scratch: dict[str, str] = field(default_factory=dict)
    staging: dict[str, str] = field(default_factory=dict)
    expected: str = ""


def read_case(path: Path) -> Case:
    """Return what a file says; its tables include those of its system that it has not itself."""
    case = Case()
    for title, text in _sections(path.read_text()):
        kind, _, name = title.partition(" ")
        match kind:
            case "system":
                case.system = name
            case "thorough":
                case.is_thorough = True
            case "derive":
                case.derives = True
            case "params":
                case.parameters = json.loads(text)
            case "scratch":
                case.scratch[name] = text
            case "staging":
                case.staging[name] = text
            case "expected":
                case.expected = text
            case table:
                case.tables[table] = text
    if case.system and (shared := SYSTEMS / f"{case.system}.case").exists():
        given = read_case(shared)
        case.tables = given.tables | case.tables
        case.staging = given.staging | case.staging
    return case


def _sections(text: str) -> Iterator[tuple[str, str]]:
    title, lines = "", []
    for line in text.splitlines(keepends=True):
        if line.startswith(_SECTION):
            if title:
                yield title, "".join(lines)
            title, lines = line.removeprefix(_SECTION).strip(), []
        else:
            lines.append(line)
    if title:
        yield title, "".join(lines)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-golden", action="store_true", help="write what golden cases expect")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    if file_path.suffix != ".case" or "cases" not in file_path.parts:
        return None
    return GoldenFile.from_parent(parent, path=file_path)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let cases of the same rows follow each other, which then are inserted once."""
    places = [place for place, item in enumerate(items) if isinstance(item, GoldenCase)]
    cases = sorted((items[place] for place in places), key=lambda item: rows_of(item.path))
    for place, item in zip(places, cases, strict=True):
        items[place] = item


class GoldenFile(pytest.File):
    def collect(self) -> Iterator[pytest.Item]:
        item = GoldenCase.from_parent(self, name=f"{self.path.parent.name}/{self.path.stem}")
        if read_case(self.path).is_thorough:
            item.add_marker("thorough")
        yield item


class GoldenCase(pytest.Item):
    def runtest(self) -> None:
        actual = bench(self.config).evaluate(self.path)
        expected = read_case(self.path).expected
        if self.config.getoption("--update-golden"):
            self.path.write_text(updated(self.path.read_text(), actual))
            expected = actual
        difference = compare(parse_csv(expected), parse_csv(actual))
        if difference:
            pytest.fail(f"{difference}\n\nactual output:\n{actual}", pytrace=False)

    def reportinfo(self) -> tuple[Path, None, str]:
        return self.path, None, self.name


def updated(text: str, expected: str) -> str:
    """Return the text of a case with another output, which is its last section."""
    title = f"{_SECTION}{_EXPECTED}\n"
    head, _, _ = text.partition(title)
    return f"{head}{title}{expected}"


def bench(config: pytest.Config) -> Bench:
    """Return the database of golden cases, made once per session."""
    if _BENCH not in config.stash:
        config.stash[_BENCH] = Bench()
        config.add_cleanup(config.stash[_BENCH].close)
    return config.stash[_BENCH]


class Bench:
    """A database for one case after the other: to make one takes longer than most cases.

    The rows of a case are never committed, so that they are gone for the next; but one that has the
    same rows finds them.
    """

    def __init__(self) -> None:
        self._directory = tempfile.TemporaryDirectory(prefix="msgflow-golden-")
        path = Path(self._directory.name) / "cases.duckdb"
        create(path)
        self._connection = duckdb.connect(str(path))
        # A few rows take longer to share out than to look at.
        self._connection.execute("SET threads = 1")
        names = self._connection.execute("SELECT name FROM duckdb_optimizers()").fetchall()
        left_out = ",".join(name for (name,) in names if name not in _OPTIMIZERS)
        self._connection.execute("SET disabled_optimizers = ?", [left_out])
        self._rows: str | None = None
        self._derived: set[str] = set()

    def evaluate(self, path: Path) -> str:
        """Return the output of a case as CSV."""
        case = read_case(path)
        try:
            if self._rows is None or rows_of(path) != self._rows:
                self._fill(path, case)
            self._derive(path.parent.name, case)
            result = _result(self._connection, path.parent.name, case)
        except BaseException:
            self._empty()
            raise
        if case.scratch or case.staging:
            self._empty()
        stream = io.BytesIO()
        write_result(result, Format.CSV, stream)
        return stream.getvalue().decode()

    def close(self) -> None:
        self._empty()
        self._connection.close()
        self._directory.cleanup()

    def _fill(self, path: Path, case: Case) -> None:
        self._empty()
        stage(self._connection, case)
        self._connection.begin()
        self._rows = rows_of(path)
        insert_case(self._connection, path)
        self._derived.clear()
        if case.derives:
            for run_id in runs_of(self._connection):
                learn_topics(self._connection, run_id)

    def _derive(self, name: str, case: Case) -> None:
        """Derive those tables that what is asked for reads, and that are not there yet."""
        missing = [table for table in derived_for(name, case) if table not in self._derived]
        for run_id in runs_of(self._connection):
            for table in missing:
                derive_table(self._connection, table, run_id)
            if finds(name, case):
                derive_findings(self._connection, run_id)
        self._derived.update(missing)

    def _empty(self) -> None:
        if self._rows is not None:
            self._connection.rollback()
        self._connection.execute("DETACH DATABASE IF EXISTS staging")
        self._rows = None


@cache
def rows_of(path: Path) -> str:
    """Return what tells the rows that a case is filled with from those of other cases."""
    case = read_case(path)
    script = case.system if case.system and (SYSTEMS / f"{case.system}.sql").exists() else None
    return repr((script, case.derives, sorted(case.tables.items()), sorted(case.staging.items())))


def fill_case(connection: duckdb.DuckDBPyConnection, path: Path) -> Case:
    """Insert the rows of a case and of its system, of BASE, and of flows; return the case."""
    case = insert_case(connection, path)
    if not case.derives:
        for run_id in runs_of(connection):
            for table in FLOW:
                derive_table(connection, table, run_id)
    return case


def insert_case(connection: duckdb.DuckDBPyConnection, path: Path) -> Case:
    """Insert the rows of a case and of its system, and of BASE; return the case."""
    case = read_case(path)
    fill(connection, case.tables)
    if case.system and (script := SYSTEMS / f"{case.system}.sql").exists():
        connection.execute(script.read_text())
    return case


@cache
def needed_by(name: str) -> frozenset[str]:
    """Return all objects and tables that cases of a folder may read, directly or not."""
    words = (match.groups() for match in _NAME.finditer(_text_of(name)))
    return objects.sources_of(f"{schema or 'main'}.{word}" for schema, word in words)


def derived_for(name: str, case: Case) -> list[str]:
    """Return the tables that are derived for what a folder asks of a case, in their order."""
    needed = needed_by(name)
    tables = derived_tables() if case.derives else FLOW
    return [table for table in tables if finds(name, case) or f"store.{table}" in needed]


def finds(name: str, case: Case) -> bool:
    """Tell whether what a folder asks of a case reads the findings of the recording."""
    return case.derives and "store.finding" in needed_by(name)


def _text_of(name: str) -> str:
    """Return the SQL that answers the cases of a folder."""
    if name.startswith(_PAGE_QUERY):
        pages = Statements(DIRECTORY)
        page = name.removeprefix(_PAGE_QUERY)
        return "\n".join(map(pages.text, ("window_ids", page) if page == "links" else (page,)))
    schema, _, own_name = name.partition(".")
    if schema in _OF_PROGRAM:
        return _OF_PROGRAM[schema]().text(own_name)
    if name.startswith(_FINDING):
        return "\n".join(header.body for header in kinds() if header.name == name)
    return name if "." in name else "\n".join(load_query(name).statements)


def runs_of(connection: duckdb.DuckDBPyConnection) -> list[int]:
    return [run_id for (run_id,) in connection.execute("SELECT run_id FROM store.run").fetchall()]


def compare(expected: Rows, actual: Rows) -> str | None:
    """Return how two outputs differ, the first line in which they do, or None."""
    for number, (wanted, got) in enumerate(zip(expected, actual, strict=False), start=1):
        if wanted != got:
            return f"line {number}: expected {wanted}, got {got}"
    if len(expected) != len(actual):
        return f"expected {len(expected) - 1} rows, got {len(actual) - 1}"
    return None


def parse_csv(text: str) -> Rows:
    """Split CSV into rows; None for an empty field without quotes, comment lines left out."""
    rows: Rows = []
    row: list[str | None] = []
    position = 0
    while position < len(text):
        if not row and text[position] == "#":
            position = _after(text, "\n", position)
            continue
        if text[position] == '"':
            closing = position + 1
            while text[closing : closing + 1] != '"' or text[closing : closing + 2] == '""':
                closing += 2 if text[closing : closing + 2] == '""' else 1
                if closing >= len(text):
                    raise ValueError("a quoted field does not end")
            row.append(text[position + 1 : closing].replace('""', '"'))
            position = closing + 1
        else:
            end = position
            while end < len(text) and text[end] not in ",\n":
                end += 1
            row.append(text[position:end].strip() or None)
            position = end
        if position < len(text) and text[position] == ",":
            position += 1
            if position == len(text) or text[position] == "\n":
                row.append(None)
        if position >= len(text) or text[position] == "\n":
            rows.append(row)
            row = []
            position += 1
    return rows


def _after(text: str, wanted: str, position: int) -> int:
    found = text.find(wanted, position)
    return len(text) if found < 0 else found + 1


def fill(connection: duckdb.DuckDBPyConnection, tables: Mapping[str, str] | None = None) -> None:
    """Insert rows, CSV by the name of their table, and the rows of BASE."""
    given = {table: parse_csv(text) for table, text in sorted((tables or {}).items())}
    base: dict[str, Rows] = {
        table: [list(row), list(row.values())] for table, row in BASE.items() if table not in given
    }
    for table, (names, *rows) in (base | given).items():
        insert(connection, table, names, rows)


def empty(connection: duckdb.DuckDBPyConnection, name: str, condition: str = "") -> None:
    """Delete rows of a table, those of a condition if given; or let a view or macro return none."""
    headers = [header for header in objects.views() if header.name == name]
    if not headers:
        connection.execute(f"DELETE FROM {name} WHERE {condition or 'true'}")
    for header in headers:
        head, body = "", header.body
        if header.kind == "macro":
            head, body = body.split(" AS TABLE\n", 1)
        head = f"{head} AS TABLE" if head else f"CREATE OR REPLACE VIEW {name} AS"
        connection.execute(f"{head}\nSELECT * FROM ({body}) WHERE false")


def insert(
    connection: duckdb.DuckDBPyConnection, table: str, names: list[str | None], rows: Rows
) -> None:
    """Insert rows of text into store.<table>; see the head of this file for what is left out."""
    if not _COLUMNS:
        # Asked once: to list columns takes longer than to insert a few rows.
        for owner, *column in connection.execute(
            "SELECT table_name, column_name, data_type, is_nullable FROM duckdb_columns() "
            "WHERE schema_name = 'store' ORDER BY table_name, column_index"
        ).fetchall():
            _COLUMNS.setdefault(owner, []).append(tuple(column))
    columns = _COLUMNS.get(table, [])
    unknown = set(names) - {name for name, _, _ in columns}
    if unknown:
        raise ValueError(f"store.{table} has no column {', '.join(map(str, unknown))}")
    defaults = {
        name: "1" if name.endswith("_id") else _NEUTRAL.get(data_type, "0")
        for name, data_type, is_nullable in columns
        if not is_nullable and name not in names
    }
    types = {name: data_type for name, data_type, _ in columns}
    given = [str(name) for name in names]
    same = list(map(literal, defaults.values()))
    values = [
        ", ".join([*(_value(types[n], text) for n, text in zip(given, row, strict=True)), *same])
        for row in rows
    ]
    if values:
        connection.execute(
            f"INSERT INTO store.{table} ({', '.join([*given, *defaults])}) "
            f"VALUES ({'), ('.join(values)})"
        )


def _value(data_type: str, text: str | None) -> str:
    if text is None:
        return "NULL"
    return f"unhex({literal(text)})" if data_type == "BLOB" else literal(text)


def _result(connection: duckdb.DuckDBPyConnection, name: str, case: Case) -> QueryResult:
    given = dict(case.parameters or {})
    if name.startswith(_PAGE_QUERY):
        return QueryResult(_page_rows(connection, case, name.removeprefix(_PAGE_QUERY), given))
    schema, _, own_name = name.partition(".")
    if schema in _OF_PROGRAM:
        statements = _OF_PROGRAM[schema]()
        return QueryResult(_program_rows(connection, case, statements, own_name, given))
    if name.startswith(_FINDING):
        return QueryResult(_finding_rows(connection, name, given))
    if "." in name:
        _make_scratch(connection, case)
        arguments = ", ".join(f"{parameter} := ${parameter}" for parameter in given)
        source = name if case.parameters is None else f"{name}({arguments})"
        relation = connection.sql(f"SELECT * FROM {source} ORDER BY ALL", params=given)
        return QueryResult(relation.to_arrow_table())
    part = Slice(**{key: given.pop(key) for key in _SLICE if key in given})
    internal = given.pop("internal", False)
    return run_query(connection, load_query(name), given, part, internal=internal)


def _make_scratch(connection: duckdb.DuckDBPyConnection, case: Case) -> None:
    for table, text in case.scratch.items():
        _create(connection, f"TEMP TABLE {table}", text)


def _program_rows(
    connection: duckdb.DuckDBPyConnection,
    case: Case,
    statements: Statements,
    name: str,
    given: dict[str, Any],
) -> pa.Table:
    _make_scratch(connection, case)
    text = statements.text(name)
    if re.search(r"\bnoticed\b", text):
        internal_sql().keep(connection, "noticed", {})
    rows = statements.run(connection, name, _FRAME | given)
    is_ordered = re.search("^ORDER BY", text, re.MULTILINE)
    return (rows if is_ordered else rows.order("ALL")).to_arrow_table()


def _create(connection: duckdb.DuckDBPyConnection, what: str, text: str) -> None:
    """Make what stands behind CREATE, with the columns that the rows of text are of."""
    head, *rows = [line for line in text.splitlines(keepends=True) if not line.startswith("#")]
    # No type that its text does not show is found: `ids::BIGINT[]`.
    typed = dict(re.findall(r"(\w+)::(MAP\([^)]*\)|[^,\n]+)", head))
    with tempfile.NamedTemporaryFile("w", suffix=".csv") as file:
        file.writelines([re.sub(r"::(MAP\([^)]*\)|[^,\n]+)", "", head), *rows])
        file.flush()
        types = f", types = {typed}" if typed else ""
        connection.execute(f"CREATE {what} AS FROM read_csv(?, header = true{types})", [file.name])


def stage(connection: duckdb.DuckDBPyConnection, case: Case) -> None:
    """Attach `staging` with the tables of a case, if it has some."""
    if case.staging:
        connection.execute("ATTACH ':memory:' AS staging")
    for table, text in case.staging.items():
        _create(connection, f"TABLE staging.{table}", text)


def _finding_rows(
    connection: duckdb.DuckDBPyConnection, name: str, given: dict[str, Any]
) -> pa.Table:
    (header,) = (header for header in kinds() if header.name == name)
    text = f"FROM ({statement([header])}) ORDER BY ALL"
    (parsed,) = connection.extract_statements(text)
    values = {key: (_FRAME | given)[key] for key in parsed.named_parameters}
    rows = connection.sql(parsed, params=values).to_arrow_table()
    unused = [
        column
        for column in rows.column_names
        if column not in _OF_FINDINGS and rows[column].null_count == len(rows)
    ]
    return rows.drop_columns(unused)


def _page_rows(
    connection: duckdb.DuckDBPyConnection, case: Case, name: str, given: dict[str, Any]
) -> pa.Table:
    values = _FRAME | given
    if name == "links":
        (ids,) = run_page_query(connection, "window_ids", values).to_pylist()
        values |= ids
    if not case.scratch:
        return run_page_query(connection, name, values)
    scratch = Scratch()
    for table_name, text in sorted(case.scratch.items()):
        names, *rows = parse_csv(text)
        columns = [list(column) for column in zip(*rows, strict=True)]
        table = pa.table(columns, names=[str(name) for name in names])
        scratch.fill(table_name, _FRAME["run"], lambda table=table: table)
    try:
        return scratch.ask(name, values)
    finally:
        scratch.close()
