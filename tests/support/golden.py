"""Golden cases: a folder with sparse input rows and the output that they have to give.

    cases/<query or view>/<case>/
        input/<table>.csv    rows of store.<table>; columns left out are NULL, or where the table
                             forbids that 1 for a key, else 0, false or an empty text
        system               name of a file in tests/support/systems that fills the store by SQL,
                             beside the rows of BASE: what several cases have in common
        derive               if this file is there, links are derived before
        params.json          parameters of the query, and run, start, end, skip_first, internal;
                             or arguments of the macro
        scratch/<table>.csv  of page queries over what pages compute once per run: its rows
        expected.csv         the output in order; create it empty for a new case, then let
                             `pytest --update-golden` write it, and read what it wrote

A query is run as `Database.query` runs it; what the program asks for itself (program.<name>) of
run 1, likewise over tables of scratch/; a page query (view.<name>) of run 1, with times from 0
and a window of 4000 ns where the parameters say nothing else; a view (its full name, such as
`main.node`) is read whole, a table macro called with its arguments, both sorted by all columns. An
empty field is NULL, "" is an empty text. Lines of input that begin with # are comments. Tables of
BASE for which there is no file have one row, of key 1.
"""

from __future__ import annotations

import io
import json
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa
import pytest

from msgflow.db.derive import derive
from msgflow.db.migrate import create
from msgflow.export.formats import Format, write_result
from msgflow.query.catalogue import load_query
from msgflow.query.result import QueryResult
from msgflow.query.run import run_query
from msgflow.sql.statement import program
from msgflow.view.page_query import run_page_query
from msgflow.view.pages import Scratch

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
_NEUTRAL = {"VARCHAR": "", "BOOLEAN": "false", "TIMESTAMP": "1970-01-01"}
_SELECTION = ("run", "start", "end", "skip_first", "internal")
_PAGE_QUERY = "view."
_PROGRAM = "program."
_FRAME = {"run": 1, "run_id": 1, "runs": [1], "origin_ns": 0, "start_ns": 0, "end_ns": 4_000}
_TEMPLATE = pytest.StashKey[Path]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden", action="store_true", help="write expected.csv of golden cases"
    )


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    if file_path.name != "expected.csv":
        return None
    return GoldenFile.from_parent(parent, path=file_path)


class GoldenFile(pytest.File):
    def collect(self) -> Iterator[pytest.Item]:
        folder = self.path.parent
        yield GoldenCase.from_parent(self, name=f"{folder.parent.name}/{folder.name}")


class GoldenCase(pytest.Item):
    def runtest(self) -> None:
        folder = self.path.parent
        actual = evaluate(folder, template(self.config))
        expected = folder / "expected.csv"
        if self.config.getoption("--update-golden"):
            expected.write_text(actual)
        difference = compare(parse_csv(expected.read_text()), parse_csv(actual))
        if difference:
            pytest.fail(f"{difference}\n\nactual output:\n{actual}", pytrace=False)

    def reportinfo(self) -> tuple[Path, None, str]:
        return self.path, None, self.name


def template(config: pytest.Config) -> Path:
    """Return an empty database, made once per session."""
    if _TEMPLATE not in config.stash:
        directory = Path(tempfile.mkdtemp(prefix="msgflow-golden-"))
        config.add_cleanup(lambda: shutil.rmtree(directory))
        path = directory / "empty.duckdb"
        create(path)
        config.stash[_TEMPLATE] = path
    return config.stash[_TEMPLATE]


def evaluate(folder: Path, empty: Path) -> str:
    """Return the output of a case as CSV."""
    with tempfile.TemporaryDirectory(prefix="msgflow-case-") as directory:
        path = Path(directory) / "case.duckdb"
        shutil.copyfile(empty, path)
        with duckdb.connect(str(path)) as connection:
            fill(connection, folder / "input")
            if (folder / "system").exists():
                name = (folder / "system").read_text().strip()
                connection.execute((SYSTEMS / f"{name}.sql").read_text())
            if (folder / "derive").exists():
                for (run_id,) in connection.execute("SELECT run_id FROM store.run").fetchall():
                    derive(connection, run_id)
            result = _result(connection, folder)
    stream = io.BytesIO()
    write_result(result, Format.CSV, stream)
    return stream.getvalue().decode()


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


def fill(connection: duckdb.DuckDBPyConnection, directory: Path) -> None:
    """Insert the rows of the CSV files in `directory`, and the rows of BASE."""
    files = {path.stem: parse_csv(path.read_text()) for path in sorted(directory.glob("*.csv"))}
    base: dict[str, Rows] = {
        table: [list(row), list(row.values())] for table, row in BASE.items() if table not in files
    }
    for table, (names, *rows) in (base | files).items():
        insert(connection, table, names, rows)


def insert(
    connection: duckdb.DuckDBPyConnection, table: str, names: list[str | None], rows: Rows
) -> None:
    """Insert rows of text into store.<table>; see the head of this file for what is left out."""
    columns = connection.execute(
        "SELECT column_name, data_type, is_nullable FROM duckdb_columns() "
        "WHERE schema_name = 'store' AND table_name = ?",
        [table],
    ).fetchall()
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
    values = [
        f'unhex("{name}")' if types[name] == "BLOB" else f'CAST("{name}" AS {types[name]})'
        for name in given
    ] + [f"CAST('{text}' AS {types[name]})" for name, text in defaults.items()]
    columns_of_text = [[row[place] for row in rows] for place in range(len(given))]
    table_of_text = pa.table(
        [pa.array(column, pa.string()) for column in columns_of_text], names=given
    )
    connection.register("given", table_of_text)
    connection.execute(
        f"INSERT INTO store.{table} ({', '.join(given + list(defaults))}) "
        f"SELECT {', '.join(values)} FROM given"
    )
    connection.unregister("given")


def _result(connection: duckdb.DuckDBPyConnection, folder: Path) -> QueryResult:
    parameters = folder / "params.json"
    given = json.loads(parameters.read_text()) if parameters.exists() else {}
    name = folder.parent.name
    if name.startswith(_PAGE_QUERY):
        return QueryResult(_page_rows(connection, folder, name.removeprefix(_PAGE_QUERY), given))
    if name.startswith(_PROGRAM):
        return QueryResult(_program_rows(connection, folder, name.removeprefix(_PROGRAM), given))
    if "." in name:
        arguments = ", ".join(f"{parameter} := ${parameter}" for parameter in given)
        source = f"{name}({arguments})" if parameters.exists() else name
        relation = connection.sql(f"SELECT * FROM {source} ORDER BY ALL", params=given)
        return QueryResult(relation.to_arrow_table())
    selection = {key: given.pop(key) for key in _SELECTION if key in given}
    return run_query(connection, load_query(name), given, **selection)


def _program_rows(
    connection: duckdb.DuckDBPyConnection, folder: Path, name: str, given: dict[str, Any]
) -> pa.Table:
    for path in (folder / "scratch").glob("*.csv"):
        connection.execute(f"CREATE TEMP TABLE {path.stem} AS FROM read_csv(?)", [str(path)])
    return program().run(connection, name, _FRAME | given).to_arrow_table()


def _page_rows(
    connection: duckdb.DuckDBPyConnection, folder: Path, name: str, given: dict[str, Any]
) -> pa.Table:
    values = _FRAME | given
    (recorded,) = run_page_query(connection, "recorded_window", values).to_pylist()
    values = recorded | values
    files = sorted((folder / "scratch").glob("*.csv"))
    if not files:
        return run_page_query(connection, name, values)
    scratch = Scratch()
    for path in files:
        names, *rows = parse_csv(path.read_text())
        columns = [list(column) for column in zip(*rows, strict=True)]
        table = pa.table(columns, names=[str(name) for name in names])
        scratch.fill(path.stem, _FRAME["run"], lambda table=table: table)
    try:
        return scratch.ask(name, values)
    finally:
        scratch.close()
