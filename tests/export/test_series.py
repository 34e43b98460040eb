"""Values side by side, against the rows of the queries that they are from."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import duckdb
import pytest

from msgflow import Database, UsageError
from msgflow.database import open_db


@pytest.fixture
def fan_out(simulated: Callable[..., Path]) -> Path:
    return simulated("fan_out", 0.1)


EXPECTED = {
    "paths": "SELECT path, count(*), sum(latency_ns) FROM end_to_end([1], NULL, NULL,"
    " 'callback_start', 'callback_end', -9223372036854775807, 9223372036854775807)"
    " JOIN flow_path([1], NULL, NULL) USING (path_id)"
    " WHERE status = 'reached' AND is_first GROUP BY path",
    "callbacks": "SELECT node || ' ' || label, count(*), sum(end_ns - start_ns)"
    " FROM callback_instance JOIN callback_label USING (callback_id)"
    " WHERE end_ns IS NOT NULL AND NOT is_internal GROUP BY ALL",
    "topics": "SELECT topic_name || ' → ' || full_name, count(*), sum(latency_ns)"
    " FROM link_transport JOIN take USING (take_id)"
    " JOIN subscription AS s USING (subscription_id) JOIN node USING (node_id)"
    " WHERE NOT s.is_internal GROUP BY ALL",
}


@pytest.mark.parametrize("what", EXPECTED)
def test_every_value_stands_once_in_its_column(what: str, fan_out: Path) -> None:
    with open_db(fan_out) as database:
        result = database.series(what)
        expected = database.connection.execute(EXPECTED[what]).fetchall()
    table = result.to_arrow()
    assert table["at_ns"].to_pylist() == sorted(table["at_ns"].to_pylist())
    found = []
    for name in table.column_names[1:]:
        values = [value for value in table[name].to_pylist() if value is not None]
        found.append((name, len(values), sum(values)))
    assert len(found) > 2
    assert sorted(found) == sorted(expected)
    assert len(table) == sum(count for _, count, _ in found)


def test_things_of_one_name_are_told_apart(fan_out: Path, tmp_path: Path) -> None:
    path = tmp_path / "alike.duckdb"
    shutil.copyfile(fan_out, path)
    with duckdb.connect(str(path)) as connection:
        connection.execute("UPDATE store.node SET full_name = '/alike'")
        connection.execute("UPDATE store.publisher SET topic_name = '/t'")
        connection.execute("UPDATE store.subscription SET topic_name = '/t'")
    with open_db(path) as database, open_db(fan_out) as other:
        for what in EXPECTED:
            names = database.series(what).columns[1:]
            assert len(names) == len(other.series(what).columns[1:])
            assert any("#" in name for name in names)


def test_only_known_things_are_measured(fan_out: Path) -> None:
    with Database(fan_out) as database, pytest.raises(UsageError, match="no series"):
        database.series("nodes")
