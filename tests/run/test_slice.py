from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from msgflow.errors import UsageError
from msgflow.run.choice import Run
from msgflow.run.slice import LATEST, Slice
from msgflow.run.window import WHOLE, Window, format_epoch

START = 1_700_000_000_000_000_000
FIRST = Run(1, "morning", START)
RUNS = (FIRST, Run(2, "noon", START), Run(3, "evening", START))


@pytest.mark.parametrize(
    ("text", "time_ns"),
    [
        ("2.5s", START + 2_500_000_000),
        ("+2.5", START + 2_500_000_000),
        ("2.5", START + 2_500_000_000),
        ("2", START + 2_000_000_000),
        (2, 2),
        (str(10**15), 10**15),
        ("+3", START + 3_000_000_000),
        ("100ms", START + 100_000_000),
        ("250us", START + 250_000),
        ("7ns", START + 7),
        ("2min", START + 120_000_000_000),
        ("1d", START + 86_400_000_000_000),
        ("0.000000001s", START + 1),
        (str(START + 5), START + 5),
        (START + 5, START + 5),
        ("0", START),
        ("2023-11-14T22:13:20Z", START),
        ("2023-11-14 22:13:20", START),
        ("2023-11-14T23:13:20.123456789+01:00", START + 123_456_789),
    ],
)
def test_points_in_time(text: str | int, time_ns: int) -> None:
    assert Slice(start=text).window([FIRST]) == Window(start_ns=time_ns)
    assert Slice(end=text).window([FIRST]) == Window(end_ns=time_ns)


def test_numbers_too_small_to_be_times_are_seconds() -> None:
    with pytest.raises(UsageError, match="out of range"):
        Slice(start=str(10**15 - 1)).window([FIRST])
    with pytest.raises(UsageError, match="but 3 are chosen"):
        Slice(start="2").window(RUNS)


def test_the_window_is_open_when_nothing_is_said() -> None:
    assert LATEST.window(RUNS) == WHOLE == Window(-(2**63), 2**63 - 1)


def test_skipping_the_warm_up() -> None:
    assert Slice(start="1.5").window([FIRST]) == Window(START + 1_500_000_000)


@pytest.mark.parametrize(
    ("text", "after_ms"),
    [("sim:1.5", 1000), ("sim:3500ms", 3500), ("sim:2", 2000), ("sim:0s", -2000), ("sim:5", 4000)],
)
def test_times_of_a_simulation(text: str, after_ms: int) -> None:
    """It stood still for a second, and then ran six times as fast as before."""
    begin = 1_000_000_000_000_000_000
    moments = ((0, 1000), (2000, 2000), (3000, 2000), (4000, 5000), (5000, 5000))
    simulated = tuple((begin + at * 10**6, then * 10**6) for at, then in moments)
    run = Run(1, "simulated", begin, simulated=simulated)
    assert Slice(start=text).window([run]).start_ns == begin + after_ms * 10**6


def test_a_simulation_that_stands_still_has_no_windows() -> None:
    run = Run(1, "paused", 0, simulated=((0, 5), (10, 5)))
    with pytest.raises(UsageError, match="nothing tells"):
        Slice(start="sim:1").window([run])


@pytest.mark.parametrize(
    "known",
    [
        # It stands still at the end; and it begins anew.
        ((0, 0), (1, 10), (2, 10)),
        ((0, 20), (1, 21), (2, 0), (3, 1)),
    ],
)
def test_a_time_that_a_simulation_never_had(known: tuple[tuple[int, int], ...]) -> None:
    moments = tuple((at * 10**9, then * 10**9) for at, then in known)
    run = Run(1, "simulated", 0, simulated=moments)
    with pytest.raises(UsageError, match="never had this time — 12 s"):
        Slice(start="sim:12").window([run])


@pytest.mark.parametrize("text", ["soon", "2,5", "3 s", "-1s", "2023-13-01", "sim:soon"])
def test_what_is_no_time_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="cannot read the time of --start"):
        Slice(start=text).window([FIRST])


def test_relative_times_need_one_run_with_a_start() -> None:
    with pytest.raises(UsageError, match="but 3 are chosen"):
        Slice(start="1s").window(RUNS)
    with pytest.raises(UsageError, match="no events"):
        Slice(start="1").window([Run(1, "empty", None)])


@pytest.mark.parametrize("seconds", ["1e300", "inf", "nan", "-1.0"])
def test_seconds_that_no_run_has_are_refused(seconds: str) -> None:
    with pytest.raises(UsageError, match="cannot read the time of --start"):
        Slice(start=seconds).window([FIRST])


@pytest.mark.parametrize("text", [str(2**63), str(-(2**63) - 1), 2**63, "300000000000s"])
def test_times_out_of_range_are_refused(text: str | int) -> None:
    with pytest.raises(UsageError, match="the time of --start is out of range"):
        Slice(start=text).window([FIRST])
    with pytest.raises(UsageError, match="the time of --end is out of range"):
        Slice(end=text).window([FIRST])


def test_the_start_of_a_run_and_what_is_skipped_may_be_too_much_together() -> None:
    for seconds in ("9000000000", "10000000000"):
        with pytest.raises(UsageError, match="the time of --start is out of range"):
            Slice(start=seconds).window([FIRST])


def test_contradictions_are_refused() -> None:
    with pytest.raises(UsageError, match="ends before it starts"):
        Slice(start="2s", end="1s").window([FIRST])


@given(st.integers(0, 2**62))
def test_printed_times_are_read_back(time_ns: int) -> None:
    assert Slice(start=format_epoch(time_ns)).window([]) == Window(start_ns=time_ns)
