"""Clocks that are joined through others, and the bounds of such chains, calculated by hand."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import duckdb
import pytest
from support.rules import derived

RULES = ("clock_drift_limit", "corrected_ns", "recorded_ns", "clock_sync")
SECOND = 10**9
STAGE = """
CREATE TABLE store.clock AS SELECT
    1 AS run_id, unnest([1, 2, 3]) AS clock_id, 0::BIGINT AS reference_ns;
CREATE TABLE pair (clock_id BIGINT, other_clock_id BIGINT, reference_ns BIGINT,
    uncertainty_ns BIGINT, drift_uncertainty_ppb BIGINT, sent_packet_count BIGINT,
    greatest_uncertainty_ns BIGINT, bounds STRUCT(at_ns BIGINT, uncertainty_ns BIGINT)[],
    offset_ns BIGINT DEFAULT 0, drift_ppb BIGINT DEFAULT 0, is_even BOOLEAN DEFAULT true,
    received_packet_count BIGINT DEFAULT 0);
CREATE MACRO derive.clock_pair(only_run) AS TABLE FROM pair;
"""
Bounds = Sequence[tuple[int, int]]


@pytest.fixture
def chain() -> Iterator[duckdb.DuckDBPyConnection]:
    """Three clocks about which nothing is known."""
    with derived(STAGE, RULES) as con:
        yield con


def join(
    con: duckdb.DuckDBPyConnection, clocks: tuple[int, int], at: int, bounds: Bounds,
    drift_ppb: int = 0, packets: int = 0,
) -> None:  # fmt: skip
    """Let two clocks be compared: the first bound is that of the offset; moments in seconds."""
    con.execute(
        "INSERT INTO pair (clock_id, other_clock_id, reference_ns, uncertainty_ns, "
        "drift_uncertainty_ppb, sent_packet_count, greatest_uncertainty_ns, bounds) "
        "VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
        [
            *clocks, at * SECOND, bounds[0][1], drift_ppb, packets, max(b for _, b in bounds),
            [{"at_ns": moment * SECOND, "uncertainty_ns": bound} for moment, bound in bounds],
        ],
    )  # fmt: skip


def bounds_of(con: duckdb.DuckDBPyConnection, clock: int) -> list[tuple[int, int]]:
    rows = con.execute(
        "SELECT b.at_ns // 1000000000, b.uncertainty_ns FROM derive.clock_sync(1) AS c, "
        "unnest(c.bounds) AS u (b) WHERE c.clock_id = ? ORDER BY 1",
        [clock],
    )
    return rows.fetchall()


def test_the_errors_of_the_steps_add_up(chain: duckdb.DuckDBPyConnection) -> None:
    """Clock 3 shows up to 400e-6 more or less than the reference in between; so does its error.

    Outside of what is known of the second step its bound grows by as much.
    """
    join(chain, (2, 1), 0, [(0, 100_000), (10, 300_000)], drift_ppb=1_000)
    join(chain, (3, 2), 10, [(-5, 1_000_000), (20, 1_000_000)], drift_ppb=2_000, packets=1)
    assert bounds_of(chain, 1) == []
    assert bounds_of(chain, 2) == [(0, 100_000), (10, 300_000)]
    assert bounds_of(chain, 3) == [
        (-5, 1_000_400 + 100_000 + 2_000_000),
        (0, 1_000_400 + 100_000),
        (10, 1_000_400 + 300_000),
        (20, 1_000_400 + 300_000 + 4_000_000),
    ]
    rows = chain.execute(
        "SELECT clock_id, reference_clock_id, uncertainty_ns, drift_uncertainty_ppb, has_packets "
        "FROM derive.clock_sync(1) ORDER BY 1"
    ).fetchall()
    # Ten seconds lie between both moments of reference; drifts multiply.
    assert rows == [
        (1, 1, 0, 0, False),
        (2, 1, 100_000, 1_000, False),
        (3, 1, 1_000_001 + 100_000 + 10_000, 3_001, True),
    ]


def test_a_step_back(chain: duckdb.DuckDBPyConnection) -> None:
    """What was found for clock 3 holds for clock 2, whose seconds may be 400e-6 longer."""
    join(chain, (3, 1), 0, [(0, 100), (10, 100)])
    join(chain, (3, 2), 0, [(0, 1_000_000), (10, 1_000_000)])
    assert bounds_of(chain, 2) == [(0, 1_000_901), (10, 1_000_901)]
    chain.execute("UPDATE pair SET drift_ppb = 100_000 WHERE other_clock_id = 2")
    # 1 / 1.0001 - 1 is -99,990.001e-9; what rounding takes away is an error as well.
    assert chain.execute(
        "SELECT drift_ppb, drift_uncertainty_ppb FROM derive.clock_sync(1) WHERE clock_id = 2"
    ).fetchall() == [(-99_990, 1)]
