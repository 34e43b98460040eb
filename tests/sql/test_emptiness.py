"""What has no row for certain, told from the text, against what DuckDB answers."""

from __future__ import annotations

from collections.abc import Iterator

import duckdb
import pytest

from msgflow.sql.emptiness import Condition, condition, condition_of_macro, holds, macro

TABLES = ("a", "b", "c")
MACROS = (
    "CREATE OR REPLACE MACRO pairs_of(name) AS TABLE SELECT x.i FROM query_table(name) AS x "
    "JOIN query_table('a' || '') AS y USING (i)",
    "CREATE OR REPLACE MACRO of_two(name, other := 'c') AS TABLE SELECT x.i FROM query_table(name) "
    "AS x JOIN query_table(other) AS y USING (i)",
    "CREATE OR REPLACE MACRO of_other(other) AS TABLE FROM of_two('a') "
    "UNION ALL FROM of_two(other)",
    "CREATE OR REPLACE MACRO one() AS 1",
    "CREATE OR REPLACE MACRO total(x) AS sum(x)",
)
# Statement -> the tables of which each alone, if it is empty, leaves it without a row; then the
# sets of more that it takes all of.
QUERIES: dict[str, tuple[str, ...]] = {
    "SELECT i FROM a": ("a",),
    "SELECT 1": (),
    "SELECT a.i FROM a, b": ("a", "b"),
    "SELECT i FROM a JOIN b USING (i)": ("a", "b"),
    "SELECT a.i FROM a SEMI JOIN b USING (i)": ("a", "b"),
    "SELECT a.i FROM a ANTI JOIN b USING (i)": ("a",),
    "SELECT a.i FROM a LEFT JOIN b USING (i)": ("a",),
    "SELECT a.i FROM a ASOF LEFT JOIN b ON a.i >= b.i": ("a",),
    "SELECT b.i FROM a RIGHT JOIN b USING (i)": ("b",),
    "SELECT i FROM a FULL JOIN b USING (i)": ("a+b",),
    "SELECT a.i FROM a POSITIONAL JOIN b": ("a+b",),
    "SELECT i FROM a UNION ALL SELECT i FROM b": ("a+b",),
    "SELECT i FROM a UNION ALL BY NAME SELECT i FROM b UNION SELECT i FROM c": ("a+b+c",),
    "SELECT i FROM a EXCEPT SELECT i FROM b": ("a",),
    "SELECT i FROM a INTERSECT SELECT i FROM b": ("a", "b"),
    "SELECT i FROM a WHERE i IN (SELECT i FROM b) AND i > 0": ("a", "b"),
    "SELECT i FROM a WHERE EXISTS (FROM b WHERE b.i = a.i) OR i > 0": ("a",),
    "SELECT i FROM a WHERE i IN (FROM b) OR i IN (FROM c)": ("a", "b+c"),
    "SELECT i FROM a WHERE i NOT IN (SELECT i FROM b)": ("a",),
    "SELECT i FROM a WHERE NOT EXISTS (FROM b)": ("a",),
    "SELECT i FROM a WHERE i = (SELECT max(i) FROM b)": ("a",),
    "SELECT count(*) FROM a": (),
    "SELECT 1 FROM a ORDER BY count(*)": (),
    "SELECT 1 FROM a HAVING count(*) = 0": (),
    "SELECT count(*) FROM a HAVING count(*) > 0": ("a",),
    "SELECT count(*) FROM a HAVING count(i) > 0 AND sum(i) > 0": ("a",),
    "SELECT count(*) FROM a HAVING count(*) > -1": (),
    "SELECT count(*) FROM a HAVING count(*) > 0 OR true": (),
    "SELECT i, count(*) FROM a GROUP BY i": ("a",),
    "SELECT count(*) FROM a GROUP BY ()": (),
    "SELECT 1 FROM a GROUP BY ()": (),
    "SELECT i, count(*) FROM a GROUP BY GROUPING SETS ((i), ())": (),
    "SELECT count(*) FROM a GROUP BY ALL": (),
    "SELECT sum(i) OVER () FROM a": ("a",),
    "SELECT i + one() FROM a": ("a",),
    "SELECT total(i) FROM a": (),
    "SELECT (SELECT max(i) FROM b) FROM a": ("a",),
    "SELECT unnest([i, i]) FROM a": ("a",),
    "SELECT i FROM a, unnest([1, 2])": ("a",),
    "SELECT nullif(i, 0), list_sum([i]), list_min([i]), list_max([i]), list_avg([i]) FROM a": (
        "a",
    ),
    "SELECT array_to_string(list_append(list_prepend(i, range(i)), i), '') FROM a": ("a",),
    "SELECT r.i FROM range(3) AS r (i)": (),
    "FROM (VALUES (1)) AS v (i)": (),
    "FROM pairs_of('b')": ("a", "b"),
    "FROM of_two('a', other := 'b')": ("a", "b"),
    # A parameter that is left out is not the one of that name outside.
    "FROM of_other('b')": ("a+b",),
    "WITH w AS (SELECT i FROM a) SELECT i FROM w JOIN b USING (i)": ("a", "b"),
    "WITH w AS MATERIALIZED (FROM a), v AS (FROM w UNION ALL FROM b) FROM pairs_of('v')": ("a",),
    # In a WITH RECURSIVE every UNION looks like a recursion.
    "WITH RECURSIVE w AS (FROM a UNION ALL FROM b) FROM w": ("a+b",),
    "WITH RECURSIVE w AS (FROM a UNION SELECT b.i FROM w JOIN b ON b.i = w.i + 1) FROM w": ("a",),
    "WITH RECURSIVE w AS (FROM a UNION SELECT i + 1 FROM w WHERE i < 3) FROM w": ("a",),
    "SELECT i FROM a QUALIFY row_number() OVER (ORDER BY i) = 1": ("a",),
    "SELECT DISTINCT i FROM a LIMIT 1": ("a",),
}


@pytest.fixture(scope="module")
def con() -> Iterator[duckdb.DuckDBPyConnection]:
    with duckdb.connect() as connection:
        for table in TABLES:
            connection.execute(f"CREATE TABLE {table} AS SELECT 1 AS i")
        for each in MACROS:
            connection.execute(each)
        yield connection


def told(con: duckdb.DuckDBPyConnection, query: str) -> Condition:
    return condition(con, query, dict(macro(con, each) for each in MACROS))


def subsets() -> list[frozenset[str]]:
    return [
        frozenset(name for place, name in enumerate(TABLES) if number >> place & 1)
        for number in range(1 << len(TABLES))
    ]


@pytest.mark.parametrize("query", QUERIES)
def test_what_is_told_is_so(con: duckdb.DuckDBPyConnection, query: str) -> None:
    """A condition holds where it should, and where it holds there is no row."""
    expected = [frozenset(names.split("+")) for names in QUERIES[query]]
    found = told(con, query)
    for empty in subsets():
        is_empty = holds(found, empty.__contains__)
        assert is_empty == any(names <= empty for names in expected)
        for table in TABLES:
            rows = "false" if table in empty else "true"
            con.execute(f"CREATE OR REPLACE TABLE {table} AS SELECT 1 AS i WHERE {rows}")
        if is_empty:
            assert con.execute(query).fetchall() == []


def test_a_macro_is_told_apart_by_what_it_is_given(con: duckdb.DuckDBPyConnection) -> None:
    """Without a text it is a name like another, and has a condition of its own."""
    own = "CREATE OR REPLACE MACRO of_run(only_run) AS TABLE SELECT i FROM a WHERE i = only_run"
    macros = dict([macro(con, own)])
    assert condition(con, "FROM of_run(1)", macros) == "of_run"
    assert condition_of_macro(con, "of_run", macros) == "a"


def test_nothing_is_known_of_other_macros(con: duckdb.DuckDBPyConnection) -> None:
    assert not holds(condition(con, "FROM unknown('a')", {}), lambda name: True)


def test_what_is_no_statement(con: duckdb.DuckDBPyConnection) -> None:
    with pytest.raises(ValueError, match="SELEC"):
        condition(con, "SELEC 1", {})
    with pytest.raises(ValueError, match="no macro"):
        macro(con, "SELECT 1")
