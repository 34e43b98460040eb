"""Public views made of the declaration of their table."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import duckdb
import pytest

from msgflow.db import objects
from msgflow.db.store_table import store_tables, table_views
from msgflow.files.resources import resource_directory
from msgflow.sql.header import completed, parse

VIEWS = table_views()
AHEAD_NS = 1_000
# Tables that users see only through the rules that read them.
INNER = {
    "definition",
    "flow_call",
    "flow_hop",
    "flow_root",
    "nearest_message",
    "orphan_take",
    "packet",
    "ring_buffer_event",
    "stamp_clock",
    "undelivered",
}


@pytest.fixture(scope="module")
def filled(
    empty_database: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[duckdb.DuckDBPyConnection]:
    """One row in each table, all of its numbers 1, and the only clock AHEAD_NS behind."""
    path = tmp_path_factory.mktemp("filled") / "filled.duckdb"
    path.write_bytes(empty_database.read_bytes())
    with duckdb.connect(str(path)) as con:
        for table in store_tables().values():
            values = [
                {
                    "BOOLEAN": "true",
                    "TIMESTAMP": "now()",
                    "VARCHAR[]": "['a=b']",
                    "BIGINT[]": "[1]",
                    "BLOB": "'a'::BLOB",
                }.get(kind, "'1'" if kind == "VARCHAR" else "1")
                for kind in (column.type for column in table.columns.values())
            ]
            if table.name != "definition":
                con.execute(f"INSERT INTO store.{table.name} VALUES ({', '.join(values)})")
        con.execute(f"UPDATE store.clock SET offset_ns = {AHEAD_NS}, drift_ppb = 0")
        yield con


def test_every_table_is_seen_or_inner() -> None:
    public = set(objects.public_names())
    assert store_tables().keys() - public == INNER


@pytest.mark.parametrize("view", VIEWS, ids=lambda view: view.name)
def test_columns_are_those_of_the_output(
    filled: duckdb.DuckDBPyConnection, view: objects.Header
) -> None:
    relation = filled.sql(f"FROM {view.name}")
    described = list(zip(relation.columns, map(str, relation.types), strict=True))
    assert described == [(column.name, column.type) for column in view.columns]
    comments = filled.execute(
        "SELECT column_name, comment FROM duckdb_columns() "
        "WHERE schema_name || '.' || table_name = ?",
        [view.name],
    ).fetchall()
    table = store_tables()[view.name.removeprefix("main.")]
    said = {
        column.name: column.description + (f" [{column.unit}]" if column.unit else "")
        for column in (*table.columns.values(), *table.computed)
    }
    assert dict(comments).items() <= said.items()


@pytest.mark.parametrize("view", VIEWS, ids=lambda view: view.name)
def test_times_of_a_clock_are_corrected_and_nothing_else(
    filled: duckdb.DuckDBPyConnection, view: objects.Header
) -> None:
    (row,) = filled.sql(f"FROM {view.name}").fetchall()
    shown = dict(zip((column.name for column in view.columns), row, strict=True))
    table = store_tables()[view.name.removeprefix("main.")]
    (row,) = filled.sql(f"FROM store.{table.name}").fetchall()
    stored = dict(zip(table.columns, row, strict=True))
    is_corrected = {name for name, column in table.columns.items() if column.clock}
    for name, value in shown.items():
        if name in is_corrected:
            assert value == stored[name] + AHEAD_NS, name
        elif name in stored:
            assert value == stored[name], name


def test_what_is_corrected() -> None:
    """All moments but stamps of the clock of ROS, and those of clocks themselves."""
    as_recorded = {
        (table.name, column.name)
        for table in store_tables().values()
        if table.view
        for column in table.columns.values()
        if column.unit == "epoch ns" and not (column.is_hidden or column.clock)
    }
    assert as_recorded == {
        ("publication", "source_timestamp_ns"),
        ("take", "source_timestamp_ns"),
        ("clock", "reference_ns"),
        ("clock_uncertainty", "at_ns"),
        ("bag_message", "received_ns"),
        ("bag_message", "stamp_ns"),
    }


@pytest.mark.parametrize("table", ["lifecycle_transition", "request", "response"])
def test_who_has_no_thread_or_node_is_shown_all_the_same(
    filled: duckdb.DuckDBPyConnection, table: str
) -> None:
    ways = "node_id" if table == "lifecycle_transition" else "sender_thread_id"
    filled.begin()
    filled.execute(f"UPDATE store.{table} SET {ways} = NULL")
    time = "at_ns" if ways == "node_id" else "sent_ns"
    assert filled.execute(f"SELECT {time} FROM main.{table}").fetchall() == [(None,)]
    filled.rollback()


def test_hidden_columns_are_not_shown(filled: duckdb.DuckDBPyConnection) -> None:
    shown = filled.sql("FROM main.publication").columns
    assert "callback_event_id" not in shown
    assert "next_event_ns" not in shown
    assert "is_topic_learned" not in filled.sql("FROM main.publisher").columns


def test_a_header_may_name_columns_of_its_table() -> None:
    (header,) = (one for one in objects.load("public") if one.name == "main.link_transport")
    by_name = {column.name: column for column in header.columns}
    assert by_name["candidate_count"].type == "BIGINT"
    assert by_name["candidate_count"].description == "Number of publications that are possible"
    assert by_name["latency_ns"].unit == "ns"


def test_a_header_names_no_column_that_the_table_lacks() -> None:
    text = "-- description: Takes.\n-- column: taken_us\nSELECT 1\n"
    header = parse(text, resource_directory("schema") / "public" / "take.sql")
    with pytest.raises(KeyError, match="taken_us"):
        completed(header, store_tables()["take"].columns)
