"""Every header tells the truth: checked against its place, its SQL, and the database."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import duckdb
import pytest
from support.each import each
from support.header_rules import faults
from support.sql_files import LAYERS, SqlFile, sql_files, sql_paths

import msgflow
from msgflow.cli.operation import OWN
from msgflow.cli.query_command import build_command
from msgflow.database import Database
from msgflow.db import objects
from msgflow.query.catalogue import load_query, query_names
from msgflow.query.selection import INTERNAL_COLUMN, KINDS, PATH
from msgflow.sql.header import SCHEMAS, Column, Header, Param, read, vocabulary
from msgflow.sql.statement import RECORDED, Statements, culprit_sql, internal_sql
from msgflow.view.page_query import DIRECTORY, page_query

FILES = sql_files()
QUERIES = [file for file in FILES if file.layer == "queries"]
VIEWS = [file for file in FILES if file.layer in objects.VIEW_LAYERS and file.header.kind == "view"]
MACROS = [file for file in FILES if file.layer == "public" and file.header.kind == "macro"]
# What pages and a lake ask.
OF_PACKAGE = [read(path) for path in sorted(Path(msgflow.__file__).parent.rglob("*.sql"))]
# Parameters that name a table, and what the rows of it are.
TABLES = {
    "outcomes": "main.end_to_end([1])",
    "arrivals": "(SELECT *, '' AS path, '' AS first_topic, '' AS last_topic FROM"
    " main.end_to_end([1]))",
    "flows": "main.end_to_end_flow([1])",
    "trail": "main.end_to_end_trail('flows', [1])",
    "callbacks": "(SELECT *, 1::BIGINT AS busy_min_ns, 1::BIGINT AS busy_max_ns"
    " FROM main.callback_instance)",
    "intervals": "(SELECT callback_instance_id AS interval_id, thread_id, start_ns AS from_ns,"
    " end_ns AS to_ns FROM main.callback_instance)",
    "spans": "(SELECT callback_instance_id AS id, process_id, start_ns, end_ns"
    " FROM main.callback_instance)",
    "parts": "main.end_to_end_part([1])",
    "series": "main.series([1])",
    "settled": "main.settled([1], NULL, NULL)",
    "series_values": "main.series_value([1], 'series', 'outcomes')",
    "windows": "main.series_window('series_values', 'settled')",
    "steps": "main.value_step('windows')",
    "of_samples": "(SELECT 1::BIGINT AS group_id, stack_id, cpu_ns FROM main.stack_sample)",
    "waited": "main.executor_wait_explained([1])",
    "vertices": "(SELECT 8::BIGINT AS key, 'take' AS kind, 1::BIGINT AS id, 0 AS depth)",
}
# What a user chooses for any query, and what recordings have: no query declares these parameters.
RESERVED = {"runs", "start_ns", "end_ns", *RECORDED}
# Values of parameters that are lists, by their type.
LISTS = {"BIGINT[]": [1, 1], "VARCHAR[]": ["1", "1"], "VARCHAR[][]": [["1", "1"]]}
# What many statements take; see `msgflow.sql.header`.
UNDECLARED = {"run", "run_id", "runs", "start_ns", "end_ns", "origin_ns", *RECORDED}
INTERNAL = [file for file in FILES if file.layer == "internal"]
PAGE_QUERIES = [page_query(path.stem) for path in sorted(DIRECTORY.glob("*.sql"))]
LAYER_OF = {file.header.name: file.layer for file in FILES}
LAYER_OF |= {
    header.name: layer for layer in ("arrival", "stat", "public") for header in objects.load(layer)
}


@pytest.fixture(scope="module")
def connection(empty_database: Path) -> Iterator[duckdb.DuckDBPyConnection]:
    with duckdb.connect(str(empty_database), read_only=True) as con:
        yield con


@pytest.fixture(scope="module")
def stored(connection: duckdb.DuckDBPyConnection) -> set[str]:
    """The tables of the store."""
    return {
        name
        for (name,) in connection.execute(
            "SELECT 'store.' || table_name FROM duckdb_tables() WHERE schema_name = 'store'"
        ).fetchall()
    }


@pytest.fixture(scope="module")
def defined(connection: duckdb.DuckDBPyConnection) -> set[str]:
    """The views and macros of the database."""
    return {
        name
        for (name,) in connection.execute(
            "SELECT schema_name || '.' || view_name FROM duckdb_views() "
            "UNION SELECT schema_name || '.' || function_name FROM duckdb_functions()"
        ).fetchall()
    }


def described(relation: duckdb.DuckDBPyRelation) -> list[tuple[str, str]]:
    return [(name, str(kind)) for name, kind in zip(relation.columns, relation.types, strict=True)]


def declared(file: SqlFile) -> list[tuple[str, str]]:
    return [(column.name, column.type) for column in file.header.columns]


def test_every_sql_file_lies_in_a_known_folder() -> None:
    assert {layer for layer, _ in sql_paths()} <= set(LAYERS)
    assert FILES


@each(FILES)
def test_each_layer_reads_only_to_its_left(file: SqlFile) -> None:
    position = LAYERS.index(file.layer)
    for name in file.references:
        # What is stored of an object of `derive` is as far to the right as that.
        stored_of = LAYER_OF.get(name.replace("store.", "derive.", 1), "store")
        layer = stored_of if name.startswith("store.") else LAYER_OF.get(name, LAYERS[0])
        assert LAYERS.index(layer) <= position, f"{file} reads {name}"


@each([*(file.header for file in QUERIES), *PAGE_QUERIES], name=lambda header: header.name)
def test_queries_of_users_and_pages_read_public_views_alone(header: Header) -> None:
    assert {name.partition(".")[0] for name in header.needs} <= {"main"}


@each(FILES)
def test_tables_of_the_store_exist(file: SqlFile, stored: set[str]) -> None:
    used = {name for name in file.references if name.startswith("store.")}
    assert used <= stored


@each(FILES)
def test_units_agree_with_names(file: SqlFile) -> None:
    for column in file.header.columns:
        is_time = column.unit in {"ns", "epoch ns"}
        assert is_time == column.name.endswith("_ns"), f"{column.name} [{column.unit}]"
        if is_time:
            assert column.type in {"BIGINT", "BIGINT[]"}, f"{column.name} {column.type}"


def common_options() -> set[str]:
    """Return the options of every query, whose names no parameter of a query may have."""
    options = {param.name for param in build_command(load_query("topics")).params}
    own = {name for name in options if name.startswith(OWN)}
    # A query may choose its rows by these itself, before it adds them up.
    choosing = {"via", "without", "slowest"}
    return options - own - choosing - {"form", "database"} | {"db", "format", "help"}


@each(QUERIES)
def test_parameters_of_a_query_are_those_of_its_sql(
    file: SqlFile, connection: duckdb.DuckDBPyConnection
) -> None:
    used: set[str] = set()
    for text in file.header.statements:
        (statement,) = connection.extract_statements(text)
        used |= statement.named_parameters
    names = {param.name for param in file.header.params}
    assert names == used - RESERVED
    assert "runs" in used
    assert not names & (common_options() | RESERVED)
    assert ("start_ns" in used) == ("end_ns" in used) == file.header.has_window


@each(QUERIES)
def test_columns_of_a_query_are_those_of_its_output(
    file: SqlFile, connection: duckdb.DuckDBPyConnection
) -> None:
    # The values do not matter, but for choices, which a query may refuse.
    values = {
        param.name: param.default if param.has_default else None for param in file.header.params
    }
    values |= {"runs": [1], "start_ns": 0, "end_ns": 1} | dict.fromkeys(RECORDED, True)
    *steps, last = (connection.extract_statements(text)[0] for text in file.header.statements)
    with connection.cursor() as cursor:
        for step, made in zip(steps, file.header.steps, strict=True):
            cursor.execute(step, {name: values[name] for name in step.named_parameters})
            if made.sources:
                cursor.execute(f"CREATE TEMP TABLE empty_step ({made.columns})")
                assert described(cursor.table("empty_step")) == described(cursor.table(made.table))
        bound = {name: values[name] for name in last.named_parameters}
        assert described(cursor.sql(file.header.body, params=bound)) == declared(file)


@each(QUERIES)
def test_a_query_is_ordered_and_hides_only_truth_values(
    file: SqlFile, connection: duckdb.DuckDBPyConnection
) -> None:
    row = connection.execute("SELECT json_serialize_sql(?)", [file.header.body]).fetchone()
    assert row is not None
    (statement,) = json.loads(row[0])["statements"]
    modifiers = [modifier["type"] for modifier in statement["node"]["modifiers"]]
    assert "ORDER_MODIFIER" in modifiers
    types = dict(declared(file))
    assert types.get(INTERNAL_COLUMN, "BOOLEAN") == "BOOLEAN"


@each(QUERIES)
def test_columns_say_what_they_name(file: SqlFile) -> None:
    """So that the query has the options that choose rows by it."""
    kinds = {"topic_name": "topic", "hostname": "host"} | {kind: kind for kind in (*KINDS, PATH)}
    for column in file.header.columns:
        if column.name in kinds:
            assert column.unit == kinds[column.name], column.name


@each(QUERIES)
def test_a_query_has_a_title_and_a_grain(file: SqlFile) -> None:
    assert file.header.title != file.header.name
    assert file.header.grain.startswith("one row per ")


@each(INTERNAL)
def test_headers_of_what_the_program_asks_are_those_of_its_sql(
    file: SqlFile, connection: duckdb.DuckDBPyConnection
) -> None:
    name = file.path.stem
    (statement,) = connection.extract_statements(internal_sql().text(name))
    named = {param.name for param in file.header.params}
    assert named | UNDECLARED == statement.named_parameters | UNDECLARED
    values = {"run_id": 1, "runs": [1], "start_ns": 0, "end_ns": 1, "kind": "take", "id": 1}
    values |= dict.fromkeys(RECORDED, True)
    values |= {p.name: LISTS.get(p.type, 1) for p in file.header.params} | values
    # What is made for a statement is not there; `why` compares its tables with their headers.
    if file.header.columns and not file.header.reads:
        assert described(internal_sql().run(connection, name, values)) == declared(file)


@pytest.mark.parametrize(
    ("name", "method"), [("compare", Database.compare), ("flow_steps", Database.flow)]
)
def test_methods_have_the_defaults_that_are_declared(
    name: str, method: Callable[..., object]
) -> None:
    declared = {
        param.name: param.default
        for param in internal_sql().header(name).params
        if param.has_default
    }
    parameters = {
        key.removesuffix("_"): parameter.default
        for key, parameter in inspect.signature(method).parameters.items()
    }
    assert declared
    assert declared == {name: parameters[name] for name in declared}


@each(VIEWS)
def test_columns_of_a_view_are_those_of_its_output(
    file: SqlFile, connection: duckdb.DuckDBPyConnection
) -> None:
    output = described(connection.sql(f"FROM {file.header.name}"))
    if file.layer == "public" or file.header.columns:
        assert output == declared(file)


@each(
    [
        (statements, name)
        for statements in (internal_sql(), culprit_sql(), Statements(DIRECTORY))
        for name in statements.names()
    ],
    name=lambda pair: pair[1],
)
def test_a_statement_says_which_tables_are_made_for_it(pair: tuple[Statements, str]) -> None:
    statements, name = pair
    header = statements.header(name)
    own = re.findall(
        r"(\w+)(?: ?\([^()]*\))?(?: USING KEY \(\w+\))? AS (?:NOT )?(?:MATERIALIZED )?\(",
        header.body,
    )
    inline = {each for each in statements.names() if statements.header(each).kind == "inline"}
    # A macro is given tables by name.
    given = {name for name in header.reads if f"'{name}'" in header.body}
    assert set(header.reads) - given == header.relations - inline - set(own)


def test_a_query_says_which_steps_of_others_it_reads() -> None:
    made = {
        table: file.path
        for file in QUERIES
        for table in re.findall(r"TEMP TABLE (\w+) AS\n", file.path.read_text(encoding="utf-8"))
    }
    for file in QUERIES:
        own = [step.sql for step in file.header.steps if made[step.table] == file.path]
        words = set(re.findall(r"[a-z_]+", "".join([*own, file.header.body])))
        others = {table for table, path in made.items() if path != file.path}
        assert set(file.header.reads) == words & others, file
    tables = [step.table for file in QUERIES for step in file.header.steps]
    assert made.keys() == set(tables)


def terms(header: Header) -> Iterator[tuple[str, str]]:
    """Yield kind and name of what a header takes from the vocabulary."""
    for kind, ours, theirs in (
        ("param", header.params, vocabulary().params),
        ("column", header.columns, vocabulary().columns),
    ):
        # One of the same words that stands in the file itself is another object.
        yield from ((kind, each.name) for each in theirs if any(each is own for own in ours))


def family(header: Header) -> str:
    """Return the query that a file is a variant of, or that it asks of a lake; else its path."""
    name = header.path.stem.replace("_", "-")
    queries = (query for query in query_names() if f"{name}-".startswith(f"{query}-"))
    return next(queries, str(header.path))


def test_a_term_of_the_vocabulary_returns() -> None:
    """What one statement alone means, with its variants, stands in its header."""
    users: dict[tuple[str, str], set[str]] = {}
    for header in (*(file.header for file in FILES), *OF_PACKAGE):
        for term in terms(header):
            users.setdefault(term, set()).add(family(header))
    declared = {("param", each.name) for each in vocabulary().params}
    declared |= {("column", each.name) for each in vocabulary().columns}
    assert {term for term in declared if len(users.get(term, ())) < 2} == set()


@each(
    [
        header
        for header in (*(file.header for file in FILES), *OF_PACKAGE)
        if family(header) in (header.name, str(header.path))
    ],
    name=lambda header: str(header.path),
)
def test_what_the_vocabulary_means_does_not_stand_in_a_file_again(header: Header) -> None:
    taken = {name for _, name in terms(header)}
    known = {each.name: each for each in (*vocabulary().params, *vocabulary().columns)}
    for declared in (*header.params, *header.columns):
        if declared.name not in taken and type(declared) in (Param, Column):
            assert declared != known.get(declared.name), declared.name


def test_the_vocabulary_is_in_order() -> None:
    for items in (vocabulary().params, vocabulary().columns):
        names = [each.name for each in items]
        assert names == sorted(set(names))
    assert {each.type for each in vocabulary().columns if each.name.endswith("_ns")} == {"BIGINT"}


@each([*(file.header for file in FILES), *OF_PACKAGE], name=lambda header: str(header.path))
def test_a_header_keeps_to_the_rules(header: Header) -> None:
    assert list(faults(header.path.read_text(encoding="utf-8"), header)) == []


@pytest.mark.thorough
@each(MACROS)
def test_parameters_and_columns_of_a_public_macro_are_declared(
    file: SqlFile, connection: duckdb.DuckDBPyConnection
) -> None:
    rows = connection.execute(
        "SELECT parameters, function_type FROM duckdb_functions() "
        "WHERE schema_name || '.' || function_name = ?",
        [file.header.name],
    ).fetchall()
    assert rows
    for parameters, _ in rows:
        assert [param.name for param in file.header.params] == parameters
    if rows[0][1] == "table_macro":
        arguments = ", ".join(
            f"{param.name} := "
            + (f"'{param.name}'" if param.name in TABLES else f"CAST(NULL AS {param.type})")
            for param in file.header.params
            if not param.has_default
        )
        with connection.cursor() as cursor:
            # Of the macros, few take a table; some of the tables are made of others.
            for name, rows_of in TABLES.items() if TABLES.keys() & set(rows[0][0]) else ():
                cursor.execute(f"CREATE TEMP TABLE {name} AS FROM {rows_of}")
            output = described(cursor.sql(f"FROM {file.header.name}({arguments})"))
        assert output == declared(file)


@each(MACROS)
def test_defaults_of_a_public_macro_are_those_that_it_declares(
    file: SqlFile, connection: duckdb.DuckDBPyConnection
) -> None:
    signature, _, _ = file.header.body.partition(") AS")
    given = dict(re.findall(r"(\w+) := ([^,\s]+)", signature))
    declared = {param.name: param for param in file.header.params if param.has_default}
    assert given.keys() == declared.keys()
    for name, default in given.items():
        typed = f"SELECT CAST({default} AS {declared[name].type})"
        assert connection.execute(typed).fetchone() == (declared[name].default,)


@each([*VIEWS, *MACROS])
def test_the_database_has_the_object_in_its_schema(file: SqlFile, defined: set[str]) -> None:
    assert file.header.name == f"{SCHEMAS[file.layer]}.{file.path.stem}"
    assert file.header.name in defined
