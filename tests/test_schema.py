"""`msgflow.schema`: the views and tables of a database, as SQLAlchemy sees them."""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import duckdb
import pytest
from duckdb_engine import Dialect
from sqlalchemy import Column, MetaData, create_engine, func, select
from sqlalchemy.engine import Connection
from sqlalchemy.exc import ProgrammingError
from support.thorough import thorough

from msgflow.schema import public, store

COOKBOOK = Path(__file__).resolve().parents[1] / "docs" / "cookbook.md"
DEMO = ("demo", 0.05)


@pytest.fixture
def connection(simulated: Callable[..., Path]) -> Iterator[Connection]:
    url = f"duckdb:///{simulated(*DEMO)}"
    engine = create_engine(url, connect_args={"read_only": True})
    with engine.connect() as connected:
        yield connected
    engine.dispose()


def type_name(column: Column[Any]) -> str:
    name = str(column.type.compile(dialect=Dialect())).upper()
    return name.removesuffix(" WITHOUT TIME ZONE")


@pytest.mark.parametrize(("metadata", "schema"), [(public, "main"), (store, "store")])
def test_it_is_what_a_database_has(empty_database: Path, metadata: MetaData, schema: str) -> None:
    with duckdb.connect(str(empty_database), read_only=True) as con:
        comments = con.execute(
            "SELECT view_name, comment FROM duckdb_views() WHERE schema_name = $1 AND NOT internal "
            "UNION ALL SELECT table_name, comment FROM duckdb_tables() "
            "WHERE schema_name = $1 AND table_name <> 'alembic_version'",
            [schema],
        ).fetchall()
        columns = con.execute(
            "SELECT table_name, column_name, data_type, comment FROM duckdb_columns() "
            "WHERE schema_name = $1 AND NOT internal AND table_name <> 'alembic_version'",
            [schema],
        ).fetchall()
    tables = metadata.tables.values()
    assert {(table.name, table.comment) for table in tables} == set(comments)
    described = {
        (table.name, column.name, type_name(column), column.comment)
        for table in tables
        for column in table.columns
    }
    assert described == set(columns)


@pytest.mark.parametrize(
    "metadata", [thorough(public, id="public"), pytest.param(store, id="store")]
)
def test_relations_hold(connection: Connection, metadata: MetaData) -> None:
    relations = [
        relation
        for table in metadata.tables.values()
        for column in table.columns
        for relation in column.foreign_keys
    ]
    assert len(relations) > 100
    for relation in relations:
        child, parent = relation.parent, relation.column
        orphans = select(func.count()).where(child.is_not(None), child.not_in(select(parent)))
        assert connection.scalar(orphans) == 0, f"{child} of {parent}"


def test_keys_tell_rows_apart(connection: Connection) -> None:
    keys = [key for table in public.tables.values() for key in table.primary_key]
    assert len(keys) > 15
    for key in keys:
        assert connection.scalar(select(func.count() - func.count(key.distinct()))) == 0, key


def test_info_has_units_and_clocks() -> None:
    start = public.tables["publication"].c.start_ns
    assert start.info == {"unit": "epoch ns", "clock": "process_id"}
    assert store.tables["store.publication"].c.start_ns.info == start.info
    assert public.tables["link_transport"].c.latency_ns.info == {"unit": "ns"}
    assert public.tables["take"].c.source_timestamp_ns.info == {"unit": "epoch ns"}
    assert public.tables["node"].c.name.info == {}
    for table in (*public.tables.values(), *store.tables.values()):
        for column in table.columns:
            assert column.info.get("clock", column.name) in table.columns
            assert (column.comment or "").endswith(f"[{column.info.get('unit')}]") == (
                "unit" in column.info
            )


def test_rows_come_as_python_has_them(connection: Connection) -> None:
    publisher = public.tables["publisher"]
    row = connection.execute(select(publisher).where(publisher.c.gid.is_not(None))).first()
    assert row is not None
    assert isinstance(row.gid, bytes)
    assert len(row.gid) == 16
    assert isinstance(row.publisher_handle, int)
    assert row.is_inferred is False
    route = store.tables["store.flow_root"].c.route
    assert connection.scalar(select(route)) == []
    for table in public.tables.values():
        connection.execute(select(table).limit(1)).all()


def test_macros_are_functions_with_columns(connection: Connection) -> None:
    caused = func.flow_forward("publication", 10).table_valued("kind", "id")
    rows = connection.execute(select(caused)).all()
    assert ("publication", 10) in [tuple(row) for row in rows]


def test_it_cannot_write(connection: Connection) -> None:
    with pytest.raises(ProgrammingError, match="read-only"):
        connection.execute(store.tables["store.take"].delete())


def test_the_example_of_the_cookbook_runs(
    simulated: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", COOKBOOK.read_text("utf-8"), re.DOTALL)
    (tmp_path / "msgflow.duckdb").symlink_to(simulated(*DEMO))
    monkeypatch.chdir(tmp_path)
    shown = io.StringIO()
    with contextlib.redirect_stdout(shown):
        exec(compile(example, COOKBOOK.name, "exec"), {})
    assert re.search(r"^/imu/data /localization/state_estimator \d+ \d+$", shown.getvalue(), re.M)
