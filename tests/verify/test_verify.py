from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import duckdb
import pytest
from support.hostile import HOSTILE, renamed
from support.thorough import few

from msgflow.database import Database
from msgflow.errors import UsageError
from msgflow.query.catalogue import load_query
from msgflow.verify.metrics import KEYS, SUBJECTS
from msgflow.verify.verify import Verification

Check = Callable[..., Verification]
# What the golden cases of the queries say of the same system.
VALUES = """
targets:
  - path: [/a, /b]
    latency: [median < 609741 ns, p99 < 928.11 us]
    completeness: ">= 100 %"
    loss: "<= 0 %"
  - from: /a
    to: /b
    latency: median < 609741 ns
    last: p99 < 928.11 us
    age: median < 609741 ns
    completeness: ">= 100 %"
    loss: "<= 0 %"
  - timer: /source
    callback: Timer(10 ms)
    rate: 100 Hz ± 5 %
    lateness: max < 305160 ns
    jitter: p95 < 250.002 us
    missed: < 1
  - callback: Subscription(/a)
    node: /slow
    duration: p95 < 117301 ns
  - topic: /b
    latency: [p99 < 287.7 us, max < 290401 ns]
    rate: < 50 Hz
  - service: /add
    round_trip: p99 < 448301 ns
    completeness: ">= 100 %"
"""
# A thread that publishes outside of callbacks.
LOOP = """
INSERT INTO store.thread BY NAME
SELECT 1 AS run_id, 1 AS process_id, 9 AS thread_id, 9 AS tid;
INSERT INTO store.publisher BY NAME
SELECT 1 AS run_id, 1 AS process_id, 1 AS node_id, 9 AS publisher_id, '/command' AS topic_name;
INSERT INTO store.publication BY NAME
SELECT
    1 AS run_id,
    1 AS trace_id,
    1 AS process_id,
    9 AS thread_id,
    9 AS publisher_id,
    9000 + n AS publication_id,
    20000000 * n AS start_ns,
    20000000 * n AS end_ns
FROM range(11) AS r (n);
"""
EXPECTED = {
    ("/a → /b", "latency", "median < 609741 ns"): ("passed", 609_740),
    ("/a → /b", "latency", "p99 < 928.11 us"): ("failed", 928_110),
    ("/a → /b", "completeness", ">= 100 %"): ("passed", 1),
    ("/a → /b", "loss", "<= 0 %"): ("passed", 0),
    ("/a → /b → /sink", "latency", "median < 609741 ns"): ("passed", 609_740),
    ("/a → /b → /sink", "last", "p99 < 928.11 us"): ("failed", 928_110),
    ("/a → /b → /sink", "age", "median < 609741 ns"): ("passed", 609_740),
    ("/a → /b → /sink", "completeness", ">= 100 %"): ("passed", 1),
    ("/a → /b → /sink", "loss", "<= 0 %"): ("passed", 0),
    ("/source Timer(10 ms)", "lateness", "max < 305160 ns"): ("failed", 305_160),
    ("/source Timer(10 ms)", "jitter", "p95 < 250.002 us"): ("passed", 250_001),
    ("/source Timer(10 ms)", "missed", "< 1"): ("passed", 0),
    ("/slow Subscription(/a)", "duration", "p95 < 117301 ns"): ("passed", 117_300),
    ("/b → /sink", "latency", "p99 < 287.7 us"): ("failed", 287_700),
    ("/b → /sink", "latency", "max < 290401 ns"): ("passed", 290_400),
    ("/caller → /add", "round_trip", "p99 < 448301 ns"): ("passed", 448_300),
    ("/caller → /add", "completeness", ">= 100 %"): ("passed", 1),
}


def rows(verification: Verification) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = verification.result.to_arrow().to_pylist()
    return found


def test_verdicts_are_on_the_values_of_the_queries(check: Check) -> None:
    verification = check(VALUES)
    found = {
        (row["subject"], row["metric"], row["condition"]): (row["verdict"], row["value"])
        for row in rows(verification)
    }
    assert {key: found[key] for key in EXPECTED} == EXPECTED
    assert found["/relay → /b", "rate", "< 50 Hz"][0] == "failed"
    assert found["/source Timer(10 ms)", "rate", "100 Hz ± 5 %"][0] == "passed"
    assert len(found) == len(EXPECTED) + 2
    assert (verification.count("passed"), verification.count("failed")) == (14, 5)
    assert [row["verdict"] for row in rows(verification)][:5] == ["failed"] * 5


def test_what_failed_names_its_worst_case(check: Check, system: Path) -> None:
    text = """
targets:
  - path: [/a, /b]
    latency: max < 1 us
  - from: /a
    to: /b
    latency: max < 1 us
    last: max < 2 us
  - timer: /source
    lateness: max < 1 us
  - callback: Timer(10 ms)
    node: /slow
    duration: max < 1 us
  - topic: /b
    latency: [max < 1 us, min > 1 s]
  - service: /add
    round_trip: max < 1 us
"""
    found = {(row["subject"], row["condition"]): row for row in rows(check(text))}
    assert found.pop(("/b → /sink", "min > 1 s"))["see"] is None
    assert len(found) == 7
    kinds = set()
    with Database(system) as database:
        for row in found.values():
            assert row["worst_ns"] == row["value"]
            *words, option, identity = row["see"].split()
            assert words == ["msgflow", "flow"]
            kind = f"{option[2:].replace('-', '_')}_id"
            if kind not in kinds:
                assert str(database.flow(**{kind: int(identity)}))
            kinds.add(kind)
    assert kinds == {"take_id", "callback_instance_id", "request_id"}


def test_goals_of_actions(check: Check, goals: Path) -> None:
    """What the golden case of action-latency says of the same system."""
    text = """
targets:
  - action: /dock
    node: /asking
    goal: [p99 < 1921101 ns, max < 1927850 ns]
  - action: "/d*"
    node: /acting
    goal: min > 0 s
"""
    failed, missing, passed = rows(check(text, goals))
    assert (failed["verdict"], failed["subject"], failed["value"], failed["samples"]) == (
        "failed",
        "/asking → /dock",
        1_927_850,
        157,
    )
    assert (failed["worst_ns"], passed["verdict"], passed["value"]) == (
        1_927_850,
        "passed",
        1_921_100,
    )
    assert failed["see"].startswith("msgflow flow --request 1")
    assert missing["reason"] == "nothing of this action was measured in the time window"
    with Database(goals) as database:
        assert str(database.flow(request_id=int(failed["see"].split()[-1])))


def test_what_has_no_data_says_why(check: Check) -> None:
    verification = check(
        "targets:\n  - path: [/b, /c]\n    latency: p99 < 1 s\n"
        "  - topic: /c\n    node: /source\n    rate: < 1 Hz\n"
    )
    first, second = rows(verification)
    assert (first["verdict"], second["verdict"]) == ("no data", "no data")
    assert "along this path" in first["reason"]
    assert "in the time window" in second["reason"]


def test_patterns_mean_what_they_match(check: Check) -> None:
    text = 'targets:\n  - topic: "/[ab]"\n    latency: max < 1 s\n'
    assert [row["subject"] for row in rows(check(text))] == [
        "/a → /relay",
        "/a → /slow",
        "/b → /sink",
    ]


def test_a_path_passes_every_topic_that_is_named(check: Check) -> None:
    text = "targets:\n  - path: [/a, /c, /b]\n    latency: max < 1 s\n"
    assert [row["verdict"] for row in rows(check(text))] == ["no data"]


@pytest.mark.thorough
def test_every_metric_reads_columns_that_its_query_has(
    check: Check, system: Path, goals: Path
) -> None:
    """With a condition that nothing meets, so that worst cases are looked for, too."""
    with duckdb.connect(str(system)) as connection:
        connection.execute(
            "INSERT INTO store.callback_schedule BY NAME SELECT run_id, callback_instance_id, "
            "90 AS running_ns, 10 AS preempted_ns, 0 AS runnable_ns, 0 AS sleeping_ns, "
            "0 AS uninterruptible_ns, 0 AS unknown_ns, 1 AS preemption_count, "
            "0 AS migration_count, false AS is_loss_affected FROM store.callback_instance"
        )
        connection.execute(
            "INSERT INTO store.thread_state BY NAME SELECT run_id, thread_id, 100 AS start_ns, "
            "130 AS end_ns, 'runnable' AS state, false AS is_loss_affected FROM store.thread"
        )
        connection.execute(LOOP)
    units = {"ns": "1 ns", "Hz": "1 Hz", "share": "1 %", "count": "1"}
    names = {"path": "[/a, /b]", "timer": "/source", "callback": "Sub*", "topic": "/a"}
    names |= {"service": "/add", "action": "/dock", "process": "process"}
    names |= {"from": "/a\n    to: /b", "loop": "/source"}
    for kind, subject in SUBJECTS.items():
        text, required = f"targets:\n  - {kind}: {names[kind]}\n", set()
        for name, metric in subject.metrics.items():
            assert metric.worst is None or metric.worst in KEYS
            assert load_query(metric.query)
            conditions = [
                f"{statistic} < {units[metric.dimension]}".strip()
                for statistic in metric.statistics or ("",)
            ]
            text += f"    {name}: {json.dumps(conditions)}\n"
            required |= {(name, condition) for condition in conditions}
        found = rows(check(text, goals) if kind == "action" else check(text))
        assert {(row["metric"], row["condition"]) for row in found} == required
        assert all(row["verdict"] in ("passed", "failed") for row in found), found


def test_lost_messages_are_a_share_of_those_connected(
    simulated: Callable[..., Path], tmp_path: Path
) -> None:
    targets = tmp_path / "targets.yaml"
    targets.write_text('targets:\n  - topic: "*"\n    loss: < 0 %\n    completeness: "> 100 %"\n')
    with Database(simulated("overload", 0.2)) as database:
        found = rows(database.verify(targets))
        delivery = database.query("topics-delivery").to_arrow().to_pylist()
    for row in delivery:
        connected = row["published"] - row["not_connected"] - row["cut_by_recording"]
        values = {
            one["metric"]: one["value"]
            for one in found
            if one["subject"] == f"{row['topic_name']} → {row['subscriber']}"
        }
        assert values["loss"] == pytest.approx((row["dropped"] + row["lost"]) / connected)
        assert values["completeness"] == pytest.approx(row["delivered"] / connected, abs=1e-4)
    assert any(row["value"] < 1 for row in found if row["metric"] == "completeness")


@pytest.mark.thorough
def test_roots_that_a_queue_dropped_are_losses(overwritten: Path, check: Check) -> None:
    """Of ten roots, two were not connected and two cut; two of the others were dropped."""
    text = """
targets:
  - path: [/a, /b]
    loss: < 30 %
    completeness: "> 60 %"
"""
    loss, completeness = sorted(rows(check(text, overwritten)), key=lambda row: row["line"])
    assert (loss["value"], loss["samples"]) == (pytest.approx(2 / 6), 6)
    assert (completeness["value"], completeness["samples"]) == (pytest.approx(3 / 6), 6)
    assert (loss["verdict"], loss["see"]) == ("failed", "msgflow flow --callback-instance 3")


def test_a_suggestion_says_what_was_not_delivered(overwritten: Path) -> None:
    with Database(overwritten) as database:
        first, *lines = database.suggest_targets().splitlines()
    assert first.startswith("# What run ")
    said = [line for line in lines if line.startswith("#")]
    assert said == [
        f"# {way}: only {share} % of the messages were delivered (1 dropped, 0 lost)."
        " Is this a good run?"
        for way, share in (('"/a → /filter"', "87.5"), ('"/b → /sink"', "80"))
    ]


def test_a_suggestion_leaves_out_the_warm_up(
    overwritten: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("msgflow.verify.suggested_targets.LEAST_VALUES", 1)
    with Database(overwritten) as database:
        whole = database.suggest_targets()
        monkeypatch.setattr("msgflow.query.compare.warm_up", lambda *_: 1000.0)
        nothing = database.suggest_targets()
        asked = database.suggest_targets(start="0s")
    assert asked == whole != nothing
    assert nothing.splitlines()[1:] == [
        "# Without its first 1000 s, a warm-up: verify with --start, too.",
        "targets: []",
    ]


@pytest.mark.parametrize("margin", few([0, 0.2], 0))
@pytest.mark.parametrize("name", few(["demo", "services", "actions"], "services"))
def test_a_run_meets_what_is_suggested_from_it(
    name: str, margin: float, simulated: Callable[..., Path], tmp_path: Path
) -> None:
    targets = tmp_path / "targets.yaml"
    with Database(simulated(name, 0.5)) as database:
        targets.write_text(database.suggest_targets(margin=margin), encoding="utf-8")
        verification = database.verify(targets)
    assert len(verification.result) > 4
    assert verification.count("passed") == len(verification.result)
    kinds = {row["metric"] for row in rows(verification)}
    assert "rate" in kinds
    assert not any("/_action/" in row["target"] for row in rows(verification))
    assert {
        "demo": {"latency", "completeness"},
        "services": {"round_trip"},
        "actions": {"goal"},
    }[name] <= kinds


@pytest.mark.thorough
def test_a_run_with_a_kernel_trace_meets_what_is_suggested_from_it(
    traced: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    targets = tmp_path / "targets.yaml"
    with Database(traced) as database:
        assert "preempted" not in database.suggest_targets()  # Of so few values.
        monkeypatch.setattr("msgflow.verify.suggested_targets.LEAST_VALUES", 1)
        for margin in (0.2, 0):
            targets.write_text(database.suggest_targets(margin=margin), encoding="utf-8")
            found = rows(database.verify(targets))
            assert {"cpu", "preempted", "wakeup"} <= {row["metric"] for row in found}
            assert {row["verdict"] for row in found} == {"passed"}
    assert (
        '  - callback: "Timer(5 ms)"\n    node: "/planner"\n    cpu: "p99 < 190 ns"\n'
        '    preempted: "< 24 %"\n'
    ) in targets.read_text("utf-8")
    with Database(traced) as database:
        # Twice 60 % is no limit.
        text = database.suggest_targets(margin=0)
        assert 'preempted: "< 61 %"' in text
        assert '  - process: "/planner"\n    wakeup: ' in text
        goal = database.suggest_targets(margin=1).split('"Subscription(/goal)"')[1]
    assert "preempted" not in goal.split("  - ")[0]
    with duckdb.connect(str(traced)) as connection:
        connection.execute("UPDATE store.node SET full_name = NULL")
    with Database(traced) as database:
        # The id of a process is another one in the next run.
        assert '  - process: "process"\n    wakeup: ' in database.suggest_targets()


def test_a_negative_margin_is_refused(system: Path) -> None:
    with Database(system) as database, pytest.raises(UsageError, match="0 or more"):
        database.suggest_targets(margin=-0.1)


def test_junit_has_a_case_per_verdict(check: Check) -> None:
    text = (
        "targets:\n  - path: [/a, /b]\n    latency: [max < 1 us, max > 0 ns]\n"
        "  - path: [/b, /c]\n    latency: max < 1 us\n"
    )
    verification = check(text)
    root = ElementTree.fromstring(verification.to_junit())
    assert {key: root.attrib[key] for key in ("tests", "failures", "errors", "skipped")} == {
        "tests": "3",
        "failures": "1",
        "errors": "1",
        "skipped": "0",
    }
    tags = [[child.tag for child in case] for case in root.iter("testcase")]
    assert tags == [["failure"], ["error"], []]
    failure = next(root.iter("failure"))
    assert failure.attrib["message"] == "measured 996.330 µs"
    assert "msgflow flow --take" in (failure.text or "")
    skipped = ElementTree.fromstring(verification.to_junit(allow_not_measured=True))
    assert (skipped.attrib["errors"], skipped.attrib["skipped"]) == ("0", "1")


def test_hostile_names_are_text_in_junit(system: Path, tmp_path: Path) -> None:
    names = (*HOSTILE, "]]>&amp;<x a='", "line\nfeed\r\x07")
    path = renamed(system, tmp_path / "hostile.duckdb", names)
    targets = tmp_path / "targets.yaml"
    targets.write_text(
        'targets:\n  - callback: "*"\n    duration: max < 1 ns\n'
        '  - topic: "*"\n    rate: < 0 Hz\n  - process: "*"\n    utilisation: < 0 %\n',
        encoding="utf-8",
    )
    with Database(path) as database:
        text = database.verify(targets).to_junit()
    root = ElementTree.fromstring(text)
    assert len(list(root.iter("testcase"))) > 8
    assert {element.tag for element in root.iter()} <= {
        "testsuites",
        "testsuite",
        "testcase",
        "failure",
        "error",
    }
    for element in root.iter():
        for value in element.attrib.values():
            assert value.isprintable()


PATHS = """
paths:
  - name: there
    from: /a
    to: /b
  - name: by-node
    from: /source
    via: ["/rel*"]
    without: [/slow]
  - name: nowhere
    from: /a
    to: /b
    without: [/relay]
"""


def with_paths(system: Path, tmp_path: Path, text: str) -> list[dict[str, Any]]:
    (tmp_path / "paths.yaml").write_text(PATHS, encoding="utf-8")
    (tmp_path / "targets.yaml").write_text(text, encoding="utf-8")
    with Database(system) as database:
        return rows(
            database.verify(tmp_path / "targets.yaml", paths=tmp_path / "paths.yaml", run=1)
        )


@pytest.mark.thorough
def test_a_path_may_have_a_name_of_its_file(system: Path, tmp_path: Path, check: Check) -> None:
    (named,) = with_paths(system, tmp_path, "targets: [{path: there, latency: max < 1 us}]")
    (listed,) = rows(check("targets: [{path: [/a, /b], latency: max < 1 us}]"))
    assert (named["target"], named["subject"]) == ("there", "there")
    for column in ("verdict", "value", "samples", "path", "worst_ns", "see"):
        assert named[column] == listed[column]
    assert named["verdict"] == "failed"
    (other,) = with_paths(
        system, tmp_path, "targets: [{path: by-node, name: x, completeness: '>= 0 %'}]"
    )
    assert other["target"] == "x"
    assert "/relay" in other["path"]
    assert "/slow" not in other["path"]
    (none,) = with_paths(system, tmp_path, "targets: [{path: nowhere, latency: max < 1 us}]")
    assert none["verdict"] == "no data"
    assert "this path" in none["reason"]


@pytest.mark.parametrize(
    ("text", "line", "message", "hint"),
    [
        ("targets:\n  - path: ther\n    latency: max < 1 s", 2, "no path of this name", "there"),
        (
            "targets:\n  - path: there\n    latency: max < 1 s\n  - path: there\n"
            "    latency: max < 2 s",
            5,
            "required twice",
            "line 3",
        ),
    ],
)
def test_a_wrong_name_of_a_path_is_named_with_its_line(
    system: Path, tmp_path: Path, text: str, line: int, message: str, hint: str
) -> None:
    with pytest.raises(UsageError) as raised:
        with_paths(system, tmp_path, text)
    assert raised.value.message.startswith(f"{tmp_path / 'targets.yaml'}, line {line}: ")
    assert message in raised.value.message
    assert hint in str(raised.value.hint)


def test_without_the_file_a_name_means_nothing(system: Path, tmp_path: Path) -> None:
    (tmp_path / "targets.yaml").write_text("targets: [{path: there, latency: max < 1 s}]")
    with Database(system) as database, pytest.raises(UsageError, match=r"none\.yaml"):
        database.verify(tmp_path / "targets.yaml", paths=tmp_path / "none.yaml")


def test_scheduling_where_the_kernel_was_traced(check: Check, traced: Path) -> None:
    text = """
targets:
  - callback: Timer(5 ms) *
    cpu: [median < 151 ns, p99 < 180 ns]
    preempted: < 24 %
  - callback: Subscription(/goal)
    preempted: < 50 %
  - process: process
    wakeup: p99 < 31 ns
  - process: /planner
    wakeup: p99 < 30 ns
"""
    found = {
        (row["subject"], row["condition"]): (row["verdict"], row["value"], row["see"])
        for row in rows(check(text, traced))
    }
    assert found == {
        ("/planner Timer(5 ms) Planner::plan", "median < 151 ns"): ("passed", 150, None),
        ("/planner Timer(5 ms) Planner::plan", "p99 < 180 ns"): ("failed", 180, None),
        ("/planner Timer(5 ms) Planner::plan", "< 24 %"): ("passed", 140 / 600, None),
        ("/planner Subscription(/goal)", "< 50 %"): (
            "failed",
            0.6,
            "msgflow flow --callback-instance 5",
        ),
        ("/planner, thread 1", "p99 < 31 ns"): ("passed", 30, None),
        ("/planner, thread 1", "p99 < 30 ns"): ("failed", 30, None),
    }
    without = rows(check(text))
    assert {row["verdict"] for row in without} == {"not measured"}
