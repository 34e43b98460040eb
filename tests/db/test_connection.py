"""How msgflow sets DuckDB up."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import duckdb
import pytest

from msgflow.db.connection import attach
from msgflow.db.empty_database import write_empty
from msgflow.db.sandbox import open_file, open_memory


def test_asof_joins_compare_in_order_however_few_rows_are_expected(tmp_path: Path) -> None:
    con = open_file(tmp_path / "some.duckdb", read_only=False)
    con.execute("CREATE TABLE few AS SELECT n AS at, 1 AS side FROM range(3) AS r(n)")
    con.execute("CREATE TABLE many AS SELECT n AS at, 1 AS side FROM range(5000) AS r(n)")
    join = "FROM few AS f ASOF JOIN many AS m ON f.side = m.side AND f.at >= m.at"
    plan = con.execute(f"EXPLAIN SELECT m.at {join}").fetchall()[0][1].upper().replace("_", " ")
    assert "NESTED LOOP" not in plan
    assert "ASOF JOIN" in plan
    assert con.execute(f"SELECT m.at {join} ORDER BY ALL").fetchall() == [(0,), (1,), (2,)]
    con.close()


def test_a_file_may_be_open_twice_in_a_process(tmp_path: Path) -> None:
    """The second connection is to the same database, and as closed in as the first."""
    path = tmp_path / "some.duckdb"
    elsewhere = tmp_path / "other.csv"
    elsewhere.write_text("a\n1\n")
    first = open_file(path, read_only=False)
    second = open_file(path, read_only=False)
    settings = (
        "autoinstall_known_extensions",
        "autoload_known_extensions",
        "python_enable_replacements",
        "asof_loop_join_threshold",
        "enable_external_access",
        "lock_configuration",
    )
    shown = "SELECT " + ", ".join(f"current_setting('{name}')" for name in settings)
    for con in (first, second, first.cursor()):
        assert con.execute(shown).fetchone() == (False, False, False, 0, False, True)
        with pytest.raises(duckdb.PermissionException):
            con.execute(f"FROM '{elsewhere}'")
    first.close()
    second.close()


def test_a_new_database_has_no_log_and_is_whole_after_a_checkpoint(tmp_path: Path) -> None:
    path = tmp_path / "new.duckdb"
    write_empty(path)
    with open_memory() as con:
        attach(con, path, is_new=True)
        con.execute("UPDATE store.alembic_version SET version_num = 'x'")
        assert [each.name for each in tmp_path.iterdir()] == [path.name]
        con.execute("CHECKPOINT")
        copy = path.with_name("copy.duckdb")
        copy.write_bytes(path.read_bytes())
    with duckdb.connect(str(copy), read_only=True) as con:
        assert con.execute("SELECT version_num FROM store.alembic_version").fetchall() == [("x",)]


def test_no_more_threads_than_the_memory_is_enough_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    connect = duckdb.connect

    def connect_on_many_cores(*args: Any, **options: Any) -> duckdb.DuckDBPyConnection:
        con = connect(*args, **options)
        con.execute("SET threads = 16")
        return con

    monkeypatch.setattr(duckdb, "connect", connect_on_many_cores)
    for limit, most in (("500MB", 4), ("none", 16)):
        with open_file(tmp_path / f"{limit}.duckdb", read_only=False, memory_limit=limit) as con:
            assert con.execute("SELECT current_setting('threads')").fetchone() == (most,)
