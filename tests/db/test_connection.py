"""How msgflow sets DuckDB up."""

from __future__ import annotations

from pathlib import Path

from msgflow.db.connection import open_file


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
