"""What counts as an answer to a planted problem."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import pytest
from planted import Answer, Case, headlines
from robot.judge import Culprit, Kind, Limits, Told, faults, missed, told
from robot.launch import ROBOTS as LAUNCHED
from robot.problems import PAIRS, ROBOTS
from robot.twins import PROBLEMS, twin

CULPRIT = Culprit(
    (Kind.SLEEPS,),
    "/arm",
    (Limits("ms", 60, 90), Limits("count", 20, 30)),
    r"Subscription\(/pose\)",
    "on_pose",
    names=("/lidar",),
)
ROW = Told(
    who="/arm",
    callback="Subscription(/pose)",
    function="Arm.on_pose",
    kind="sleeps",
    has_harm=True,
    headline="/arm sleeps 71.5 ms in on_pose of 50 Hz",
    evidence=("woken by /lidar",),
)
NOTE = replace(ROW, has_harm=False, headline="nothing stands out", evidence=())


def test_a_row_that_says_all_has_no_fault() -> None:
    assert list(faults(CULPRIT, ROW, has_kernel=True)) == []


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"who": "/arm_2"}, "/arm_2 is blamed, not /arm"),
        ({"who": None}, "None is blamed, not /arm"),
        ({"callback": "Timer(20 ms)"}, r"the callback is Timer(20 ms), not Subscription\(/pose\)"),
        ({"kind": "queue"}, "the kind is queue, not sleeps"),
        ({"function": None}, "the function is None, not on_pose"),
        ({"function": "Arm.on_pose_late"}, "the function is Arm.on_pose_late, not on_pose"),
        ({"evidence": ()}, "/lidar is not named"),
        ({"headline": "/arm sleeps 115 ms"}, "no true number of 60 to 90 ms or 20 to 30 count"),
    ],
)
def test_each_field_can_be_wrong(change: dict[str, str | None], fault: str) -> None:
    assert list(faults(CULPRIT, replace(ROW, **change), has_kernel=True)) == [fault]


@pytest.mark.parametrize(
    ("headline", "is_true"),
    [
        ("0.0715 s", True),
        ("71,500 µs", True),
        ("25 of 60", True),
        # Neither a rate, a share, another unit, nor a part of a name is a count.
        ("25 Hz, 25 %, 25 ms, lidar_25, /cam/25, 1.25 x", False),
        ("91 ms", False),
        ("", False),
    ],
)
def test_a_number_counts_in_its_unit_only(headline: str, is_true: bool) -> None:
    found = list(faults(CULPRIT, replace(ROW, headline=headline), has_kernel=True))
    assert (found == []) is is_true


def test_without_the_kernel_who_sleeps_may_compute() -> None:
    row = replace(ROW, kind="computes")
    assert list(faults(CULPRIT, row, has_kernel=False)) == []
    assert list(faults(CULPRIT, row, has_kernel=True)) == ["the kind is computes, not sleeps"]


def test_without_the_kernel_the_sufferer_is_enough() -> None:
    hog = replace(CULPRIT, kinds=(Kind.NO_CPU,), who="gzip", names=("gzip",), sufferer="/arm")
    row = replace(ROW, function=None)
    assert list(faults(hog, row, has_kernel=False)) == []
    assert "/arm is blamed, not gzip" in faults(hog, row, has_kernel=True)
    no_number = replace(row, headline="/arm is late")
    assert len(list(faults(hog, no_number, has_kernel=False))) == 1


def test_problems_have_headlines_in_their_order() -> None:
    other = replace(CULPRIT, who="/leg")
    rows = [NOTE, ROW, replace(ROW, who="/leg")]
    assert list(missed([CULPRIT, other], rows, has_kernel=True)) == []
    assert len(list(missed([other, CULPRIT], rows, has_kernel=True))) == 2
    assert list(missed([CULPRIT, other], rows[:2], has_kernel=True)) == ["no headline 2 of /leg"]


def test_nothing_stands_out_of_a_healthy_robot() -> None:
    assert list(missed([], [NOTE], has_kernel=True)) == []
    assert list(missed([], [NOTE, ROW], has_kernel=True)) == ["/arm is accused of sleeps"]
    assert len(list(missed([], [], has_kernel=True))) == 1


def test_a_row_without_harm_is_a_note() -> None:
    row = {
        "rank": 1,
        "kind": "lock",
        "node": "/arm",
        "callback": None,
        "function": None,
        "harm_ns": 250,
        "headline": "it sleeps",
        "evidence": ["so it is"],
    }
    nothing = row | {"rank": None, "kind": None, "harm_ns": None, "evidence": []}
    assert [(each.kind, each.has_harm, each.evidence) for each in told([row, nothing])] == [
        ("sleeps", True, ("so it is",)),
        (None, False, ()),
    ]


def test_every_planted_problem_has_a_culprit() -> None:
    assert {*ROBOTS} == {*LAUNCHED} == {*PAIRS}
    fifteen = {*ROBOTS["drone"], *ROBOTS["picker"]}
    assert len(fifteen) == len(ROBOTS["drone"]) + len(ROBOTS["picker"]) == 15
    assert {*ROBOTS["vehicle"]} == fifteen
    for name, pairs in PAIRS.items():
        assert {problem for pair in pairs for problem in pair} <= {*ROBOTS[name]}


def test_a_seed_changes_names_and_durations_of_a_twin() -> None:
    for robot, seed in product(PROBLEMS, range(1, 11)):
        healthy, culprits = twin(robot, None, seed)
        assert culprits == []
        for problem in PROBLEMS[robot]:
            planted, culprits = twin(robot, problem, seed)
            assert len(culprits) == 1
            # It differs in what is planted only.
            names = [process.nodes[0].name for process in healthy.processes]
            assert names == list(dict.fromkeys(each.nodes[0].name for each in planted.processes))
        assert healthy.processes != twin(robot, None, seed + 1)[0].processes


def test_first_headlines_are_a_table() -> None:
    case = Case("drone_rclcpp", ("burst",), 3)
    assert (case.name, case.robot) == ("drone_rclcpp-burst-3", "drone")
    verdict = [NOTE, replace(ROW, headline="/a|b"), replace(ROW, who="/leg")]
    answer = Answer(case, True, verdict, ["what"], 0.5)
    assert headlines([answer]).splitlines()[2] == (
        "| drone_rclcpp | burst | with kernel | /a/b | what | /leg (sleeps) |"
    )
