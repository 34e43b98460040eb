"""Offsets and drifts of clocks from the messages and packets between them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from random import Random

import duckdb
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.drifting_clocks import Clock, Delay, Way, fill_clocks
from support.possible_lines import Bound, PossibleLines
from support.thorough import examples, thorough

from msgflow.clocks.clocks_file import read_clock_sync
from msgflow.clocks.correction import set_clocks
from msgflow.db.derivation import derive_findings

SECOND = 1_000_000_000
MICROSECOND = 1_000


def delay(base_ns: float, jitter_ns: float) -> Delay:
    return lambda random: base_ns + random.expovariate(1) * jitter_ns


def times(seed: int, count: int, begin: int = 0, end: int = 20 * SECOND) -> list[int]:
    random = Random(seed)
    return sorted(random.randrange(begin, end) for _ in range(count))


@contextmanager
def synchronised(
    connection: duckdb.DuckDBPyConnection, clocks: list[Clock], ways: list[Way], seed: int = 0
) -> Iterator[dict[int, tuple[object, ...]]]:
    """Yield clock number -> reference, reference time, offset, drift, and both uncertainties."""
    connection.begin()
    try:
        fill_clocks(connection, clocks, ways, seed)
        set_clocks(connection, 1, read_clock_sync("messages"))
        rows = connection.execute(
            "SELECT clock_id - 1, reference_clock_id - 1, reference_ns, offset_ns, drift_ppb, "
            "uncertainty_ns, drift_uncertainty_ppb FROM main.clock"
        ).fetchall()
        yield {row[0]: row[1:] for row in rows}
    finally:
        connection.rollback()


def require_truth(clocks: list[Clock], corrections: dict[int, tuple[object, ...]]) -> None:
    """Every corrected clock is right, to within what is stated."""
    for number, row in corrections.items():
        reference, at_ns, offset_ns, drift_ppb, uncertainty_ns, drift_uncertainty_ppb = row
        offset, drift = clocks[number].correction(at_ns, clocks[reference])  # type: ignore[arg-type,index]
        # Times in the traces are rounded to a nanosecond at both ends.
        assert abs(offset_ns - offset) <= uncertainty_ns + 2  # type: ignore[operator]
        assert abs(drift_ppb - drift) <= drift_uncertainty_ppb + 1  # type: ignore[operator]


@settings(
    max_examples=examples(4, 25),
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    offset_ns=st.integers(-(10**17), 10**17),
    drift_ppb=st.integers(-199_900, 199_900),
    bases=st.tuples(st.integers(10, 5_000), st.integers(10, 5_000)),
    jitter=st.integers(0, 3_000),
    counts=st.tuples(st.integers(3, 400), st.integers(3, 400)),
    packets=st.tuples(st.integers(0, 200), st.integers(0, 200)),
    seed=st.integers(0, 2**31),
)
def test_truth_lies_inside_what_is_stated(
    connection: duckdb.DuckDBPyConnection,
    offset_ns: int,
    drift_ppb: int,
    bases: tuple[int, int],
    jitter: int,
    counts: tuple[int, int],
    packets: tuple[int, int],
    seed: int,
) -> None:
    clocks = [Clock(), Clock(offset_ns, drift_ppb)]
    there, back = (delay(base * MICROSECOND, jitter * MICROSECOND) for base in bases)
    ways = [
        Way(0, 1, [0, *times(seed, counts[0]), 20 * SECOND], there),
        Way(1, 0, [0, *times(seed + 1, counts[1]), 20 * SECOND], back),
        # Slower, so that the shortest ways are those of messages.
        Way(0, 1, times(seed + 2, packets[0]), lambda random: 6e6 + there(random), is_packet=True),
        Way(1, 0, times(seed + 3, packets[1]), lambda random: 6e6 + back(random), is_packet=True),
    ]
    with synchronised(connection, clocks, ways, seed) as corrections:
        assert corrections[1][0] == 0
        require_truth(clocks, corrections)
        forth, back_ns = connection.execute(
            "SELECT min(CASE WHEN t.process_id = 2 THEN l.latency_ns END), "
            "min(CASE WHEN t.process_id = 1 THEN l.latency_ns END) "
            "FROM main.link_transport AS l JOIN main.take AS t ON l.take_id = t.take_id"
        ).fetchall()[0]
        # The line is a possible one. The drift is rounded to 1e-9, which is 10 ns in half of 20 s.
        assert forth >= -12
        assert back_ns >= -12
        require_tight(connection, clocks, corrections[1])


def require_tight(
    connection: duckdb.DuckDBPyConnection, clocks: list[Clock], row: tuple[object, ...]
) -> None:
    """Host 2 is right at any time to within the bound, which is no wider than it has to be."""
    _, at_ns, offset_ns, drift_ppb, *_ = row
    bound = Bound(
        connection.execute(
            "SELECT at_ns, uncertainty_ns FROM main.clock_uncertainty WHERE clock_id = 2"
        ).fetchall()
    )
    lines = PossibleLines(
        *(
            connection.execute(
                f"SELECT {at}, {difference} FROM derive.clock_way "
                f"WHERE from_clock_id = {sender} AND to_clock_id = {3 - sender}"
            ).fetchall()
            for at, difference, sender in (
                ("received_ns", "sent_ns - received_ns", 1),
                ("sent_ns", "received_ns - sent_ns", 2),
            )
        )
    )
    for share in range(11):
        time = bound.begin_ns + (bound.end_ns - bound.begin_ns) * share // 10
        drifted = drift_ppb * (time - at_ns) / 1e9  # type: ignore[operator]
        chosen = offset_ns - lines.offset_ns + drifted  # type: ignore[operator]
        lowest, highest = lines.range_at(time)
        least = max(highest - chosen, chosen - lowest)
        assert least - 3 <= bound.at(time) <= least + 4
        offset, _ = clocks[1].correction(time, clocks[0])
        assert abs(chosen - float(offset - lines.offset_ns)) <= bound.at(time) + 2


def test_seven_milliseconds_and_twenty_ppm(connection: duckdb.DuckDBPyConnection) -> None:
    clocks = [Clock(), Clock(7_000_000, 20_000)]
    ways = [
        Way(0, 1, times(1, 2000), delay(150_000, 40_000)),
        Way(1, 0, times(2, 2000), delay(250_000, 40_000)),
    ]
    with synchronised(connection, clocks, ways) as corrections:
        require_truth(clocks, corrections)
        _, at_ns, offset_ns, drift_ppb, uncertainty_ns, drift_uncertainty_ppb = corrections[1]
        shortest_round_trip = 400_000
        assert uncertainty_ns <= 1.01 * shortest_round_trip / 2
        assert drift_uncertainty_ppb <= 1.1 * shortest_round_trip / 20
        # The ways differ by 100 us, of which half cannot be told from an offset.
        offset, drift = clocks[1].correction(at_ns, clocks[0])
        assert abs(offset_ns - offset) == pytest.approx(50_000, abs=1_000)
        assert abs(drift_ppb - drift) < 500


def test_clocks_are_joined_through_others_by_the_surest_way(
    connection: duckdb.DuckDBPyConnection,
) -> None:
    clocks = [Clock(), Clock(10**12, 30_000), Clock(-(10**15), -80_000), Clock(5, 100_000)]
    sure, unsure = delay(100_000, 5_000), delay(20_000_000, 5_000)
    ways = [
        way
        for seed, (a, b, kind) in enumerate(
            [(0, 1, sure), (1, 2, sure), (0, 2, unsure), (2, 3, sure)]
        )
        for way in (
            Way(a, b, times(2 * seed, 300), kind),
            Way(b, a, times(2 * seed + 1, 300), kind),
        )
    ]
    with synchronised(connection, clocks, ways) as corrections:
        assert {row[0] for row in corrections.values()} == {0}
        require_truth(clocks, corrections)
        uncertainties = [corrections[number][4] for number in range(4)]
        assert uncertainties[0] == 0
        # Two steps of 100 us rather than one of 20 ms; and what the drift adds in between.
        assert 180_000 < uncertainties[2] < 400_000
        assert 280_000 < uncertainties[3] < 700_000


def finding(connection: duckdb.DuckDBPyConnection) -> list[tuple[str, str]]:
    derive_findings(connection, 1)
    return connection.execute(
        "SELECT name, detail FROM main.finding WHERE starts_with(name, 'clock_') ORDER BY ALL"
    ).fetchall()


def test_one_way_is_said_and_nothing_invented(connection: duckdb.DuckDBPyConnection) -> None:
    ways = [Way(0, 1, times(1, 50), delay(1e5, 1e4))]
    with synchronised(connection, [Clock(), Clock(7), Clock(9)], ways) as corrections:
        assert [row[0] for row in corrections.values()] == [None, None, None]
        assert [row[2:4] for row in corrections.values()] == [(0, 0)] * 3
        assert finding(connection) == [
            (
                "clock_not_synchronised",
                "the clock of host-3 stays apart: no message between it and the others is known",
            ),
            (
                "clock_not_synchronised",
                "the clocks of host-1 and host-2 stay apart: 50 messages one way, 0 the other, and"
                " an offset needs both",
            ),
        ]


def test_packets_narrow_the_bounds_of_messages(connection: duckdb.DuckDBPyConnection) -> None:
    clocks = [Clock(), Clock(7_000_000, 20_000)]
    messages = [
        Way(0, 1, times(1, 500), delay(300_000, 90_000)),
        Way(1, 0, times(2, 500), delay(500_000, 90_000)),
    ]
    packets = [
        Way(0, 1, times(3, 500), delay(50_000, 9_000), is_packet=True),
        Way(1, 0, times(4, 500), delay(70_000, 9_000), is_packet=True),
    ]
    with synchronised(connection, clocks, messages) as corrections:
        require_truth(clocks, corrections)
        assert connection.execute("SELECT method FROM main.clock").fetchall()[1] == ("messages",)
        without = corrections[1]
    with synchronised(connection, clocks, messages + packets) as corrections:
        require_truth(clocks, corrections)
        assert connection.execute("SELECT method FROM main.clock").fetchall()[1] == ("packets",)
        assert corrections[1][4] < without[4] / 5  # type: ignore[operator]
        assert corrections[1][5] < without[5] / 5  # type: ignore[operator]
    # Either way may be of another kind.
    with synchronised(connection, clocks, [messages[0], packets[1]]) as corrections:
        require_truth(clocks, corrections)
        assert without[4] > corrections[1][4] > 150_000  # type: ignore[operator]


def test_packets_one_way_are_said(connection: duckdb.DuckDBPyConnection) -> None:
    ways = [Way(0, 1, times(1, 20), delay(1e5, 1e4), is_packet=True)]
    with synchronised(connection, [Clock(), Clock(7)], ways) as corrections:
        assert corrections[1][0] is None
        assert [detail for _, detail in finding(connection)] == [
            "the clocks of host-1 and host-2 stay apart: 0 messages and 20 network packets one way,"
            " 0 and 0 the other, and an offset needs both"
        ]


def worst(connection: duckdb.DuckDBPyConnection, clock_id: int = 2) -> int:
    """The greatest bound of a clock [ns]."""
    (row,) = connection.execute(
        "SELECT max(uncertainty_ns) FROM main.clock_uncertainty WHERE clock_id = ?", [clock_id]
    ).fetchall()
    return int(row[0])


def test_messages_at_different_times_tell_what_is_possible(
    connection: duckdb.DuckDBPyConnection,
) -> None:
    """The first and the last lie a second and two apart, in which clocks drift by 200 ppm."""
    clocks = [Clock(), Clock(7, 100_000)]
    ways = [
        Way(0, 1, [0, SECOND], delay(1e5, 0)),
        Way(1, 0, [2 * SECOND, 3 * SECOND], delay(1e5, 0)),
    ]
    with synchronised(connection, clocks, ways) as corrections:
        require_truth(clocks, corrections)
        require_tight(connection, clocks, corrections[1])
        assert 150_000 < corrections[1][4] < 350_000  # type: ignore[operator]


def test_one_message_each_way_tells_an_offset(connection: duckdb.DuckDBPyConnection) -> None:
    clocks = [Clock(), Clock(7, 50_000)]
    ways = [Way(0, 1, [0], delay(1e5, 0)), Way(1, 0, [10], delay(1e5, 0))]
    with synchronised(connection, clocks, ways) as corrections:
        require_truth(clocks, corrections)
        assert corrections[1][3] == 0
        assert corrections[1][5] == 200_000
        assert 100_000 <= corrections[1][4] <= 100_050  # type: ignore[operator]


def test_one_way_at_the_begin_leaves_no_impossible_drift(
    connection: duckdb.DuckDBPyConnection,
) -> None:
    """Messages back in the first 79 ms of 30 s: what they say of the drift is noise."""
    clocks = [Clock(), Clock(10**8, 40_000)]
    ways = [
        Way(0, 1, times(1, 3000, 0, 30 * SECOND), delay(2e5, 9e4)),
        Way(1, 0, times(2, 16, 0, 79_000_000), delay(2e5, 9e4)),
    ]
    with synchronised(connection, clocks, ways) as corrections:
        require_truth(clocks, corrections)
        require_tight(connection, clocks, corrections[1])
        # One way alone tells how the clocks drift apart if its shortest ways are equally long.
        assert abs(corrections[1][3] + 40_000) < 5_000  # type: ignore[operator]
        assert worst(connection) > 5 * corrections[1][4]  # type: ignore[operator]


@pytest.mark.parametrize(
    ("drift_ppb", "is_possible"), [(199_900, True), thorough(-199_900, True), (201_000, False)]
)
def test_clocks_drift_apart_by_200_ppm_at_most(
    connection: duckdb.DuckDBPyConnection, drift_ppb: int, is_possible: bool
) -> None:
    clocks = [Clock(), Clock(0, drift_ppb)]
    ways = [
        Way(0, 1, times(1, 400, 0, 60 * SECOND), delay(1_000, 10)),
        Way(1, 0, times(2, 400, 0, 60 * SECOND), delay(1_000, 10)),
    ]
    with synchronised(connection, clocks, ways) as corrections:
        assert abs(corrections[1][3]) <= 200_000  # type: ignore[operator]
        assert [name for name, _ in finding(connection)] == (
            [] if is_possible else ["clock_uneven"]
        )
        if is_possible:
            require_truth(clocks, corrections)
            require_tight(connection, clocks, corrections[1])


def test_a_clock_that_was_set_is_said(connection: duckdb.DuckDBPyConnection) -> None:
    """It jumps by 50 ms half way: no line fits, and the uncertainty covers it."""
    jump, way = 50_000_000, delay(1e5, 1e4)
    ways = [
        Way(0, 1, times(1, 300, 0, 10 * SECOND), way),
        Way(1, 0, times(2, 300, 0, 10 * SECOND), way),
        Way(0, 1, times(3, 300, 10 * SECOND), lambda random: way(random) + jump),
        Way(1, 0, times(4, 300, 10 * SECOND), lambda random: way(random) - jump),
    ]
    with synchronised(connection, [Clock(), Clock(10**9)], ways) as corrections:
        _, at_ns, offset_ns, drift_ppb, uncertainty_ns, drift_uncertainty_ppb = corrections[1]
        assert drift_uncertainty_ppb is None
        assert jump / 4 < uncertainty_ns < jump
        assert [name for name, _ in finding(connection)] == ["clock_uneven"]
        for true, jumped in (
            (SECOND, 0),
            (9 * SECOND, 0),
            (11 * SECOND, jump),
            (19 * SECOND, jump),
        ):
            shown = Clock(10**9).shows(true) + jumped
            corrected = shown + offset_ns + (shown - at_ns) * drift_ppb / 1e9
            assert abs(corrected - Clock().shows(true)) <= uncertainty_ns + 1_000
