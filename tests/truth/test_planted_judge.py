"""What counts as an answer to a planted problem."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from itertools import product
from pathlib import Path

import duckdb
import pytest
from planted import Answer, Case, headlines
from recording.quota import cgroup_with_quota, why_no_quota
from robot.cpu_time import Call, in_words, measured_calls, wrong_times
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
    assert list(faults(CULPRIT, ROW, knows_cpu=True)) == []


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
    assert list(faults(CULPRIT, replace(ROW, **change), knows_cpu=True)) == [fault]


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
    found = list(faults(CULPRIT, replace(ROW, headline=headline), knows_cpu=True))
    assert (found == []) is is_true


def test_who_sleeps_takes_long_where_nothing_tells() -> None:
    row = replace(ROW, kind="callback")
    assert list(faults(CULPRIT, row, knows_cpu=False)) == []
    assert list(faults(CULPRIT, row, knows_cpu=True)) == ["the kind is callback, not sleeps"]


def test_the_sufferer_is_enough_where_nothing_tells() -> None:
    hog = replace(CULPRIT, kinds=(Kind.NO_CPU,), who="gzip", names=("gzip",), sufferer="/arm")
    row = replace(ROW, function=None)
    assert list(faults(hog, row, knows_cpu=False)) == []
    assert "/arm is blamed, not gzip" in faults(hog, row, knows_cpu=True)
    no_number = replace(row, headline="/arm is late")
    assert len(list(faults(hog, no_number, knows_cpu=False))) == 1


def test_problems_have_headlines_in_their_order() -> None:
    other = replace(CULPRIT, who="/leg")
    rows = [NOTE, ROW, replace(ROW, who="/leg")]
    assert list(missed([CULPRIT, other], rows, knows_cpu=True)) == []
    assert len(list(missed([other, CULPRIT], rows, knows_cpu=True))) == 2
    assert list(missed([CULPRIT, other], rows[:2], knows_cpu=True)) == ["no headline 2 of /leg"]


def test_nothing_stands_out_of_a_healthy_robot() -> None:
    assert list(missed([], [NOTE], knows_cpu=True)) == []
    assert list(missed([], [NOTE, ROW], knows_cpu=True)) == ["/arm is accused of sleeps"]
    assert len(list(missed([], [], knows_cpu=True))) == 1


def test_a_row_without_harm_is_a_note() -> None:
    row = {
        "rank": 1,
        "kind": "waits",
        "node": "/arm",
        "callback": None,
        "function": None,
        "harm_ns": 250,
        "headline": "it sleeps",
        "evidence": ["so it is"],
    }
    nothing = row | {"rank": None, "kind": None, "harm_ns": None, "evidence": []}
    assert [(each.kind, each.has_harm, each.evidence) for each in told([row, nothing])] == [
        ("queue", True, ("so it is",)),
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
    answer = Answer(case, "with kernel", verdict, ["what"], 0.5, "all right")
    assert headlines([answer]).splitlines()[2] == (
        "| drone_rclcpp | burst | with kernel | /a/b | what | /leg (sleeps) | all right |"
    )


def test_a_cgroup_is_removed_also_if_a_process_is_left_in_it() -> None:
    if (reason := why_no_quota()) is not None:
        pytest.skip(reason)
    with subprocess.Popen(["sleep", "60"]) as process:
        with cgroup_with_quota() as group:
            (group / "cgroup.procs").write_text(str(process.pid))
        assert not group.exists()
        assert process.poll() is None
        process.kill()


def test_only_the_smallest_robots_are_recorded_without_the_kernel() -> None:
    assert [name for name in ROBOTS if not Case(name, ()).has_kernel] == ["worker", "c_worker"]


@pytest.mark.parametrize(
    ("true_ns", "told_ns", "is_right"),
    [
        (0, 50_000, True),
        (0, 50_001, False),
        (20_000_000, 20_250_000, True),
        (20_000_000, 19_750_000, True),
        (20_000_000, 20_250_001, False),
        (20_000_000, None, False),
    ],
)
def test_a_cpu_time_may_differ_by_50_us_and_a_hundredth(
    true_ns: int, told_ns: int | None, is_right: bool
) -> None:
    assert Call("on_scan", true_ns, told_ns).is_right is is_right


def test_each_wait_may_cost_10_us_more() -> None:
    assert Call("on_scan", 0, 80_000, waits=3).is_right
    assert not Call("on_scan", 0, 80_001, waits=3).is_right


def test_99_of_100_cpu_times_of_each_function_are_right() -> None:
    right, wrong = Call("on_scan", 1_000, 3_000), Call("on_scan", 1_000, None)
    assert list(wrong_times([right] * 99 + [wrong])) == []
    assert in_words([right] * 99 + [wrong]) == (
        "CPU time right in 99 of 100 calls, 99 % off by at most 2 µs"
    )
    others = [replace(right, function="tick")] * 900
    assert list(wrong_times([right] * 98 + [wrong, wrong, *others])) == [
        "CPU time of on_scan: 98 of 100 right, 98 known"
    ]
    assert list(wrong_times([])) == ["no callback measured its CPU time"]
    assert in_words([wrong]) == "CPU time right in 0 of 1 calls"


def test_a_call_is_known_by_its_function_and_its_begin(tmp_path: Path) -> None:
    database, truth = tmp_path / "run.duckdb", tmp_path / "truth.tsv"
    with duckdb.connect(database) as connection:
        connection.execute(
            """
            CREATE TABLE callback AS
            FROM (VALUES (1, 'worker:Worker.on_scan'), (2, 'Worker::on_image(Image const&)'))
                AS c (callback_id, symbol);
            CREATE TABLE callback_instance AS
            FROM (VALUES
                (1, 100, 120, 5), (2, 101, 130, 6), (1, 200, 220, NULL), (1, 400, 420, 8),
                (1, 500, NULL, NULL)
            ) AS i (callback_id, start_ns, end_ns, cpu_ns)
            """
        )
    # The third was not recorded, and the recording ended during the last. C++ tells the waits, too.
    begins = [3, 102, 202, 302, 402, 502]
    lines = ["on_image\t100\t9\t7", *(f"on_scan\t{ns - 2}\t9" for ns in begins)]
    truth.write_text("".join(f"{line}\n" for line in lines))
    measured = measured_calls(database, truth, 2)
    assert [call.waits for call in measured] == [7, 0, 0, 0, 0, 0]
    assert [(call.function, call.told_ns) for call in measured] == [
        ("on_image", 6),
        ("on_scan", None),
        ("on_scan", 5),
        ("on_scan", None),
        ("on_scan", None),
        ("on_scan", 8),
    ]
