from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from msgflow.errors import UsageError
from msgflow.run.choice import Run, choose_runs, is_run_name
from msgflow.run.window import MAXIMUM_NS, MINIMUM_NS, format_epoch, time_window

START = 1_700_000_000_000_000_000
FIRST = Run(1, "morning", START)
SECOND = Run(2, "noon", START + 1)
NUMBERED = Run(3, "1", START + 2)
RUNS = (FIRST, SECOND, NUMBERED)


@pytest.mark.parametrize(
    ("wanted", "chosen"),
    [
        (None, (NUMBERED,)),
        ("all", RUNS),
        ("noon", (SECOND,)),
        ("2", (SECOND,)),
        (2, (SECOND,)),
        ("1", (NUMBERED,)),
    ],
)
def test_choosing_runs(wanted: str | int | None, chosen: tuple[Run, ...]) -> None:
    assert choose_runs(RUNS, wanted) == chosen


def test_a_database_without_runs_has_none_to_choose() -> None:
    assert choose_runs((), None) == ()


def test_an_unknown_run_is_refused_with_those_that_exist() -> None:
    with pytest.raises(UsageError) as raised:
        choose_runs(RUNS, "evening")
    assert "evening" in raised.value.message
    assert "morning (1), noon (2)" in str(raised.value.hint)


def test_a_name_of_several_runs_is_refused_with_their_ids() -> None:
    with pytest.raises(UsageError) as raised:
        choose_runs((FIRST, Run(9, "morning", 0)), "morning")
    assert raised.value.hint == "choose by id: --run 1 or --run 9"


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
    assert time_window((FIRST,), start=text) == (time_ns, MAXIMUM_NS)
    assert time_window((FIRST,), end=text) == (MINIMUM_NS, time_ns)


def test_numbers_too_small_to_be_times_are_seconds() -> None:
    with pytest.raises(UsageError, match="out of range"):
        time_window((FIRST,), start=str(10**15 - 1))
    with pytest.raises(UsageError, match="but 3 are chosen"):
        time_window(RUNS, start="2")


def test_the_window_is_open_when_nothing_is_said() -> None:
    assert time_window(RUNS) == (MINIMUM_NS, MAXIMUM_NS)


def test_skipping_the_warm_up() -> None:
    assert time_window((FIRST,), skip_first=1.5) == (START + 1_500_000_000, MAXIMUM_NS)


@pytest.mark.parametrize("text", ["soon", "2,5", "3 s", "-1s", "2023-13-01"])
def test_what_is_no_time_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="cannot read the time of --start"):
        time_window((FIRST,), start=text)


def test_relative_times_need_one_run_with_a_start() -> None:
    with pytest.raises(UsageError, match="but 3 are chosen"):
        time_window(RUNS, start="1s")
    with pytest.raises(UsageError, match="no events"):
        time_window((Run(1, "empty", None),), skip_first=1)


@pytest.mark.parametrize("seconds", [1e300, 1e200, 1e10, float("inf"), float("nan"), -1.0])
def test_seconds_that_no_run_has_are_refused(seconds: float) -> None:
    with pytest.raises(UsageError, match="--skip-first takes the seconds to leave out"):
        time_window((FIRST,), skip_first=seconds)


@pytest.mark.parametrize("text", [str(2**63), str(-(2**63) - 1), 2**63, "300000000000s"])
def test_times_out_of_range_are_refused(text: str | int) -> None:
    with pytest.raises(UsageError, match="the time of --start is out of range"):
        time_window((FIRST,), start=text)
    with pytest.raises(UsageError, match="the time of --end is out of range"):
        time_window((FIRST,), end=text)


def test_the_start_of_a_run_and_what_is_skipped_may_be_too_much_together() -> None:
    with pytest.raises(UsageError, match="the time of --skip-first is out of range"):
        time_window((FIRST,), skip_first=9e9)


@pytest.mark.parametrize(
    ("name", "is_possible"),
    [("robot", True), ("2026-03-14", True), ("all", False), ("12", False), ("-1", False)],
)
def test_names_that_a_run_can_be_chosen_by(name: str, is_possible: bool) -> None:
    assert is_run_name(name) == is_possible
    assert not is_run_name("")


def test_contradictions_are_refused() -> None:
    with pytest.raises(UsageError, match="exclude each other"):
        time_window((FIRST,), start="1s", skip_first=1)
    with pytest.raises(UsageError, match="ends before it starts"):
        time_window((FIRST,), start="2s", end="1s")


@given(st.integers(0, 2**62))
def test_printed_times_are_read_back(time_ns: int) -> None:
    assert time_window((), start=format_epoch(time_ns)) == (time_ns, MAXIMUM_NS)
