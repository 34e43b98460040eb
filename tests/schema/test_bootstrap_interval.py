"""The bootstrap by itself: what it draws, and by how much it widens what it draws."""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt

import duckdb
import pytest
from support.rules import derived
from support.thorough import few, thorough

# A hundred values of side a, of side b all the same.
STAGE = """
CREATE TABLE measure AS
SELECT
    'a' AS side, 'x' AS subject, 100 AS number, [50, 95, 99] AS quantiles, 50.5 AS mean_ns,
    list_transform(range(100), lambda i: i * 37 % 100 + 1) AS series
UNION ALL
SELECT 'b', 'x', 100, [7, 7, 7], 7, list_transform(range(100), lambda i: 7);
"""


@pytest.fixture
def con() -> Iterator[duckdb.DuckDBPyConnection]:
    with derived(STAGE, ("bootstrap_interval",)) as con:
        yield con


def ends(
    con: duckdb.DuckDBPyConnection,
    block_length: int,
    widenings: list[float],
    resamples: int = 400,
) -> dict[str, list[float]]:
    con.execute(
        "CREATE OR REPLACE TEMP TABLE block AS "
        "SELECT side, subject, $length::BIGINT AS block_length, $widenings::DOUBLE[] AS widenings "
        "FROM measure",
        {"length": block_length, "widenings": widenings},
    )
    found = con.execute(
        "SELECT statistic, ends "
        f"FROM derive.bootstrap_interval('measure', 'block', {resamples}, 0.95, 0)"
    )
    return dict(found.fetchall())


def test_blocks_of_all_values_hold_every_value_equally_often(
    con: duckdb.DuckDBPyConnection,
) -> None:
    assert ends(con, 100, [1, 1, 1, 1]) == {
        statistic: [0, 0] for statistic in ("median", "mean", "p95", "p99")
    }


def test_intervals_are_as_much_wider_as_blocks_are_few(con: duckdb.DuckDBPyConnection) -> None:
    drawn = ends(con, 5, [1, 1, 1, 1])
    wider = ends(con, 5, [2, 3, 1.5, 4])
    for statistic, widening in zip(("median", "mean", "p95", "p99"), (2, 3, 1.5, 4), strict=True):
        low, high = drawn[statistic]
        assert low < high
        assert wider[statistic] == pytest.approx([widening * low, widening * high])


def test_twenty_resamples_have_to_lie_beyond_the_ends(con: duckdb.DuckDBPyConnection) -> None:
    assert ends(con, 5, [1, 1, 1, 1], 400)
    assert not ends(con, 5, [1, 1, 1, 1], 399)


@pytest.mark.parametrize(
    ("number", "block_length", "narrowing", "drawn"),
    [
        thorough(1_000, 1, 1, 1_000, id="all"),
        pytest.param(1_250, 10, sqrt(0.8), 1_000, id="no more than a thousand"),
        thorough(2_600, 260, 1, 870, id="ten blocks, of each every third"),
    ],
)
def test_so_many_values_are_drawn(
    con: duckdb.DuckDBPyConnection, number: int, block_length: int, narrowing: float, drawn: int
) -> None:
    """Of values that are 0 or 1, the sum of those drawn is a whole number."""
    con.execute(
        "UPDATE measure SET number = $number, mean_ns = list_avg(drawn), series = drawn "
        "FROM (SELECT list_transform(range($number), lambda i: hash(i) % 2) AS drawn) "
        "WHERE side = 'a'",
        {"number": number},
    )
    ((mean,),) = con.execute("SELECT mean_ns::DOUBLE FROM measure WHERE side = 'a'").fetchall()
    # Its ends are those of single resamples.
    for end in ends(con, block_length, [1, 1, 1, 1], 401)["mean"]:
        total = drawn * (mean - end / narrowing)
        assert total == pytest.approx(round(total), abs=1e-6)


@pytest.mark.parametrize("number", few([500, 2_000], 500))
def test_means_of_four_times_as_many_values_vary_half_as_much(
    con: duckdb.DuckDBPyConnection, number: int
) -> None:
    """Though of more than a thousand values only a thousand are drawn at once."""
    con.execute(
        "UPDATE measure SET number = $number, "
        "series = list_transform(range($number), lambda i: i * 37 % 100 + 1) WHERE side = 'a'",
        {"number": number},
    )
    low, high = ends(con, 1, [1, 1, 1, 1])["mean"]
    of_one = sqrt((100**2 - 1) / 12)
    assert high - low == pytest.approx(2 * 1.96 * of_one / sqrt(number), rel=0.15)
