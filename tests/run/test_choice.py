from __future__ import annotations

import pytest

from msgflow.errors import UsageError
from msgflow.run.choice import Run, choose_one, choose_runs, is_run_name

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


def test_something_of_one_run_refuses_none_and_several() -> None:
    assert choose_one(RUNS, "noon", "a graph") == SECOND
    with pytest.raises(UsageError, match="a graph is of one run — all"):
        choose_one(RUNS, "all", "a graph")
    with pytest.raises(UsageError, match="holds no run yet"):
        choose_one((), None, "a graph")


@pytest.mark.parametrize(
    ("name", "is_possible"),
    [("robot", True), ("2026-03-14", True), ("all", False), ("12", False), ("-1", False)],
)
def test_names_that_a_run_can_be_chosen_by(name: str, is_possible: bool) -> None:
    assert is_run_name(name) == is_possible
    assert not is_run_name("")
