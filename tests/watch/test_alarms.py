"""Targets of windows: what is violated, by whom, and what is kept of it."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pyarrow as pa
import pytest
from support.same_windows import require_same_as_whole
from support.thorough import few
from typer.testing import CliRunner, Result

from msgflow.cli.app import app
from msgflow.database import Database
from msgflow.errors import UsageError
from msgflow.run.window import Window
from msgflow.trace import Continuation
from msgflow.verify.targets_file import TargetsFile
from msgflow.verify.verify import Verdict
from msgflow.watch.alarm import Alarm
from msgflow.watch.chunk import Chunk
from msgflow.watch.flight_recorder import FlightRecorder
from msgflow.watch.kept_chunk import KeptTraces, read_chunk
from msgflow.watch.window_report import WindowReport
from msgflow_sim import Recording, simulate

SECOND = 1_000_000_000

TARGETS = """
targets:
  - path: [/scan, /filtered]
    latency: max < 80 ms
"""


@pytest.fixture
def watched(shared_traces: Path, tmp_path: Path):
    """Run `msgflow watch --once` on a real recording with targets."""

    def run(text: str, *options: object) -> Result:
        file = tmp_path / "targets.yaml"
        file.write_text(text)
        words = ["watch", shared_traces / "real_rotate", "--once", "--targets", file, *options]
        return CliRunner().invoke(app, [str(word) for word in words])

    return run


@pytest.fixture(scope="module")
def violated(
    shared_traces: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[list[dict[str, Any]], str, Path]:
    """Windows of three seconds, what is said beside them, and where violations are kept.

    What violates the targets in the first one is told once.
    """
    place = tmp_path_factory.mktemp("violated")
    kept = place / "kept"
    for file in others_own(kept):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("matters")
    between = "  - {from: /scan, to: /filtered, latency: max < 80 ms}\n"
    (place / "targets.yaml").write_text(f"{TARGETS}{between}")
    words = ["watch", shared_traces / "real_rotate", "--once", "--json"]
    words += ["--window", "3s", "--step", "3s", "--late", "3s"]
    words += ["--targets", place / "targets.yaml", "--keep-most", 1, "--keep-on-violation", kept]
    result = CliRunner().invoke(app, [str(word) for word in words])
    assert result.exit_code == 1
    return [json.loads(line) for line in result.stdout.splitlines()], result.stderr, kept


def others_own(kept: Path) -> tuple[Path, Path]:
    """Return files that this program did not write."""
    return kept / "violation-19700101-000000" / "msgflow.duckdb", kept / "violation-report"


def test_a_violation_names_the_culprit_and_is_kept(violated) -> None:
    (first, *others), said_beside, kept = violated
    assert all(file.read_text() == "matters" for file in others_own(kept))
    subjects = [violation["subject"] for violation in first["violations"]]
    assert subjects == ["/scan → /filtered", "/scan → /filtered → /sink"]
    for violation in first["violations"]:
        assert violation["worst_ns"] == 99_343_279
        # What `why` says first of that window.
        culprit = violation["culprit"]
        assert culprit["headline"].startswith("/filter: ")
        assert (culprit["rank"], culprit["kind"]) == (1, "callback")
        assert (culprit["node"], culprit["callback"]) == ("/filter", "Subscription(/scan)")
        assert culprit["harm_ns"] > 0
        assert culprit["evidence"]
        assert culprit["next"].startswith("query callbacks ")
    assert not any(window["violations"] for window in others)
    (directory,) = kept.glob("violation-2*")
    assert len(list(directory.glob("archives/*/*"))) > 2
    with Database(directory / "msgflow.duckdb") as database:
        rows = database.query("e2e-latency").to_arrow().to_pylist()
        assert max(row["max_ns"] or 0 for row in rows) == violation["worst_ns"]
    assert f"kept: msgflow why --db {directory}" in said_beside


def test_its_windows_have_the_numbers_of_the_whole(violated, real: Callable[[str], Path]) -> None:
    """It lost 12 events in its fourth chunk, which is no reason to call a border a gap."""
    names = ("paths", "executors", "losses", "topics", "discarded_events")
    found = [
        WindowReport(
            window=Window(line["start_ns"], line["end_ns"]), **{name: line[name] for name in names}
        )
        for line in violated[0]
    ]
    require_same_as_whole(found, real("real_rotate"))
    assert sum(report.discarded_events for report in found) == 12


@pytest.mark.thorough
def test_a_target_that_is_met(watched) -> None:
    """The exit code is that of verify."""
    result = watched(TARGETS.replace("80 ms", "1 s"), "--window", "8s", "--step", "8s")
    assert result.exit_code == 0
    assert "violation" not in result.stdout


@pytest.mark.thorough
def test_what_was_never_measured(watched) -> None:
    text = TARGETS.replace("/scan", "/no_such_topic")
    assert watched(text, "--window", "8s", "--step", "8s").exit_code == 5


@pytest.mark.thorough
def test_a_target_that_falls_silent_is_said_once(tmp_path: Path) -> None:
    """The relay ends after one second, and begins again after 1.2 s."""
    rotations = tuple(SECOND // 20 * number for number in range(17, 27))
    simulate("restarts", tmp_path / "trace", recording=Recording(rotations=rotations))
    (tmp_path / "targets.yaml").write_text("targets: [{topic: /result, rate: '> 1 Hz'}]")
    words = ("watch", "trace", "--once", "--window", "50ms", "--step", "50ms", "--json")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path)
        result = CliRunner().invoke(app, [*words, "--targets", "targets.yaml"])
    windows = [json.loads(line)["verdicts"] for line in result.stdout.splitlines()]
    counted = [set(verdicts) for verdicts in windows]
    assert {"no data"} in counted[counted.index({"passed"}) :]
    # A topic without a message has no known publisher.
    said = re.findall(r"no data of (?:/relay → )?/result: rate > 1 Hz", result.stderr)
    assert len(said) == 1
    assert result.exit_code == 0


@pytest.mark.thorough
def test_a_target_on_part_of_a_path_names_the_culprit(tmp_path: Path) -> None:
    """Messages of the last topic go on to further nodes."""
    recording = Recording(rotations=(SECOND // 2,))
    simulate("cpu_hog", tmp_path / "trace", factor=0.3, recording=recording)
    file = tmp_path / "targets.yaml"
    file.write_text("targets: [{path: [/image, /objects], latency: max < 30 ms}]")
    words = ["watch", tmp_path / "trace", "--once", "--json", "--targets", file]
    result = CliRunner().invoke(app, [str(word) for word in words])
    windows = [json.loads(line) for line in result.stdout.splitlines()]
    culprits = [each["culprit"] for window in windows for each in window["violations"]]
    assert {culprit["node"] for culprit in culprits} == {"/detector"}


@pytest.mark.thorough
def test_what_was_kept_before_stays(watched, tmp_path: Path) -> None:
    """The same recording is watched twice: the name of its violation is taken."""
    options = ("--window", "8s", "--step", "8s", "--keep-on-violation", tmp_path / "kept")
    for count in (1, 2, 2):
        watched(TARGETS, *options, "--keep-most", 2)
        kept = list((tmp_path / "kept").iterdir())
        assert len(kept) == count
        assert all((directory / "msgflow.duckdb").exists() for directory in kept)


@pytest.mark.thorough
def test_more_of_what_came_before_is_kept(watched, tmp_path: Path) -> None:
    """Chunks, and their events in the database, with the names of nodes that began earlier."""
    # The last violation, which is the one kept, has more than two seconds before it.
    targets = TARGETS.replace("80 ms", "70 ms")
    options = ("--window", "1s", "--step", "1s", "--late", "500ms")
    options += ("--keep-on-violation", tmp_path / "kept")
    lengths = []
    printed = set()
    for before in ((), ("--keep-before", "2s")):
        printed.add(watched(targets, *options, "--keep-most", 1, *before).stdout)
        (directory,) = (tmp_path / "kept").iterdir()
        chunks = len(list(directory.glob("archives/*/*")))
        with Database(directory / "msgflow.duckdb") as database:
            (run,) = database.runs()
            names = database.sql("SELECT full_name FROM node").to_arrow()["full_name"].to_pylist()
        assert run.start_ns is not None
        assert run.end_ns is not None
        lengths.append((chunks, run.end_ns - run.start_ns))
        assert {"/source", "/filter", "/sink"} <= set(names)
        shutil.rmtree(tmp_path / "kept")
    # Windows are the same.
    assert len(printed) == 1
    (chunks, length_ns), (more_chunks, more_ns) = lengths
    # A chunk that reaches into the time is kept as a whole.
    assert chunks + 2 <= more_chunks <= chunks + 3
    # The first message comes up to a period of 0.1 s after the begin of what is kept.
    assert 1.9 <= (more_ns - length_ns) / SECOND < 3.1


def test_what_came_before_is_kept_of_violations_only(watched) -> None:
    result = watched(TARGETS, "--keep-before", "2s")
    assert result.exit_code == 2
    assert "--keep-on-violation DIR --keep-before 2s" in result.stderr


@pytest.mark.thorough
@pytest.mark.parametrize("kilobytes", few([100, 2_000], 2_000))
def test_a_full_disk_ends_no_view(watched, tmp_path: Path, kilobytes: int) -> None:
    """There is room for nothing, or for the chunks but not for the database."""
    kept = tmp_path / "kept"
    kept.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", str(kept)]
    if os.geteuid() or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("file systems can be mounted by root only")
    try:
        options = ("--window", "3s", "--step", "3s", "--keep-on-violation", kept)
        result = watched(TARGETS, *options)
        assert list(kept.iterdir()) == []
    finally:
        subprocess.run(["umount", str(kept)], check=True)
    assert result.exit_code == 1
    assert "violation: /scan → /filtered: latency 99.343 ms" in result.stdout
    assert len([line for line in result.stdout.splitlines() if " paths, " in line]) > 1
    said = " ".join(result.stderr.split())
    assert f"the violation is not kept in {kept}/violation-" in said
    assert "no space left on" in said.lower()
    assert "another directory with --keep-on-violation" in said
    # Of many files, one is enough to say.
    assert said.lower().count("no space left on") == 1


@pytest.mark.thorough
def test_sessions_of_one_name_on_two_hosts_are_kept(tmp_path: Path) -> None:
    """lttng-relayd has a directory for each host; their chunks may have equal names.

    Links and pipes in them are not followed.
    """
    directory = tmp_path / "trace"
    rotations = (SECOND // 2,)
    simulate("two_hosts", directory, factor=0.1, recording=Recording(rotations=rotations))
    chunks = []
    for source in {path.parents[1] for path in directory.glob("**/archives/*")}:
        moved = tmp_path / source.name / "drive"
        shutil.copytree(source, moved)
        first = min((moved / "archives").iterdir())
        chunks.append(Chunk(0, moved, first.rename(first.with_name("chunk-0"))))
    read = [read_chunk(chunk, Continuation()) for chunk in chunks]
    notes: list[str] = []
    secret = tmp_path / "secret"
    secret.write_text("matters")
    (chunks[0].path / "link").symlink_to(secret)
    (chunks[0].path / "loop").symlink_to(chunks[0].path)
    os.mkfifo(chunks[0].path / "pipe")
    recorder = FlightRecorder(
        tmp_path / "kept",
        most=1,
        window_ns=SECOND,
        earlier_ns=0,
        clock_sync="none",
        note=notes.append,
    )
    traces = KeptTraces([], [chunk for chunk in read if chunk is not None])
    recorder.keep(SECOND, traces, [chunk.path for chunk in chunks], None, None)
    recorder.close()
    assert notes[0].startswith("kept: ")
    kept = list((tmp_path / "kept").glob("*/archives/*/drive/chunk-0"))
    assert len(kept) == 2
    assert not {"link", "loop", "pipe"} & {path.name for one in kept for path in one.iterdir()}


@pytest.mark.thorough
def test_an_error_of_the_targets_is_told_as_it_is(watched, monkeypatch) -> None:
    def judge(*_: object) -> None:
        raise UsageError("no such thing", "choose another")

    monkeypatch.setattr("msgflow.watch.alarm.Alarm.judge", judge)
    result = watched(TARGETS)
    assert result.exit_code == 2
    assert "no such thing" in result.stderr


def test_without_a_window_nothing_is_measured(watched, monkeypatch) -> None:
    monkeypatch.setattr("msgflow.watch.follow.watch_finished", lambda place, watcher: iter(()))
    assert watched(TARGETS).exit_code == 5


Rows = list[dict[str, Any]]


def judged(monkeypatch: pytest.MonkeyPatch, *windows: Rows) -> list[tuple[Rows, Rows]]:
    """Return violations and verdicts of an alarm in windows of ten seconds, one second apart.

    Args:
        windows: for each, `subject`, `worst_ns` and `worst_at_ns` of the requirements that failed.
    """
    alarm = Alarm(TargetsFile((), ()), {}, print)
    found = []
    for number, failed in enumerate(windows):
        rows = [
            {
                "target": "drive",
                "metric": "latency",
                "condition": "max < 80 ms",
                "verdict": Verdict.FAILED,
                "value": 1.0,
                "measured": "",
                "see": None,
                "path": None,
            }
            | row
            for row in failed
        ]
        verified = SimpleNamespace(result=SimpleNamespace(table=pa.Table.from_pylist(rows)))
        monkeypatch.setattr("msgflow.watch.alarm.verify", lambda *_, v=verified, **__: v)
        window = Window((number - 10) * SECOND, number * SECOND)
        found.append(alarm.judge(None, window, window.end_ns))
    return found


def told(monkeypatch: pytest.MonkeyPatch, *windows: Rows) -> list[list[str]]:
    """Return the subjects that an alarm tells of, see `judged`."""
    monkeypatch.setattr("msgflow.watch.alarm._culprits", lambda *_: [])
    found = judged(monkeypatch, *windows)
    return [[each["subject"] for each in violations] for violations, _ in found]


def test_what_goes_on_failing_keeps_what_was_to_blame(monkeypatch) -> None:
    """Diagnostics show each verdict of a window; `why` is asked when a violation is told."""
    path = "/a → /x → /b"
    row = {"subject": "a", "path": path, "worst_ns": 90, "worst_at_ns": -SECOND}
    sentences = iter(["the first", "the second"])
    monkeypatch.setattr(
        "msgflow.watch.alarm._culprits",
        lambda *_: [
            {
                "kind": "callback",
                "path": path,
                "node": "/b",
                "topic_name": None,
                "headline": next(sentences),
            }
        ],
    )
    windows = [[row, row | {"subject": "b"}]] * 2 + [[row | {"worst_ns": 95}]]
    found = [[row["culprit"] for row in rows] for _, rows in judged(monkeypatch, *windows)]
    told = [[culprit["headline"] for culprit in culprits] for culprits in found]
    assert told == [["the first"] * 2, ["the first"] * 2, ["the second"]]


@pytest.mark.parametrize(
    ("subject", "path", "node", "topic", "is_to_blame"),
    [
        # A target on a path: one of its nodes, or who sends a topic that another one waits for.
        ("drive", "/b → /y → /c", "/c", None, True),
        ("drive", "/b → /y → /c", "/b", "/y", True),
        ("drive", "/b → /y → /other", "/other", "/y", True),
        # What its first node does before it publishes, and what comes behind its end.
        ("drive", "/b → /y → /c", "/b", "/x", False),
        ("drive", "/b → /y → /c", "/d", "/z", False),
        # A path may pass its first node again.
        ("drive", "/b → /y → /c → /x → /b", "/c", "/y", True),
        # Between two topics: on the path that the culprit delays.
        ("/x → /z → /d", None, "/c", "/y", True),
        ("/x → /z → /d", None, "/a", None, False),
        ("/x → /z → /e", None, "/c", "/y", False),
        # The latency of a topic, and its rate, which its reader does not change.
        ("/y → /c", None, "/c", "/y", True),
        ("/b → /y", None, "/c", "/y", False),
        ("/b Timer(100 ms)", None, "/b", "/x", False),
        # Nothing stands out: on the slowest path, and on another one.
        ("drive", "/b → /y → /c", None, None, True),
        ("/x → /z → /d", None, None, None, True),
        ("drive", "/b → /y → /other", None, None, False),
    ],
)
def test_a_culprit_is_on_the_way_of_what_fails(
    monkeypatch, subject: str, path: str | None, node: str | None, topic: str | None,
    is_to_blame: bool,
) -> None:  # fmt: skip
    culprit = {
        "kind": node and "callback",
        "path": "/a → /x → /b → /y → /c → /z → /d",
        "node": node,
        "topic_name": topic,
    }
    monkeypatch.setattr("msgflow.watch.alarm._culprits", lambda *_: [culprit])
    row = {"subject": subject, "path": path, "worst_ns": 90, "worst_at_ns": -SECOND}
    (((violation,), _),) = judged(monkeypatch, [row])
    assert violation["culprit"] == (culprit if is_to_blame else None)


def test_what_becomes_the_worst_when_the_worst_has_passed_is_no_news(monkeypatch) -> None:
    """Messages of 200, 180, 220 and 190 ms, at 1, 3, 14 and 16 s."""

    def row(worst_ms: int, at: int) -> dict[str, Any]:
        return {"subject": "a", "worst_ns": worst_ms * 10**6, "worst_at_ns": at * SECOND}

    windows = [[row(200, 1)]] * 10 + [[row(180, 3)]] * 3 + [[row(220, 14)]] * 2 + [[row(190, 16)]]
    windows = [[], [], *windows, [], [row(180, 17)]]
    found = [number for number, each in enumerate(told(monkeypatch, *windows)) if each]
    assert found == [2, 15, 17, 19]


def test_a_case_that_gets_worse_is_told_again(monkeypatch) -> None:
    def row(worst_ms: int) -> dict[str, Any]:
        return {"subject": "a", "worst_ns": worst_ms * 10**6, "worst_at_ns": -SECOND}

    assert told(monkeypatch, [row(90)], [row(90)], [row(95)]) == [["a"], [], ["a"]]


def test_paths_of_one_target_are_told_apart(monkeypatch) -> None:
    """Completeness has no worst case."""

    def row(path: str) -> dict[str, Any]:
        return {"subject": None, "path": path, "worst_ns": None, "worst_at_ns": None}

    first, second = row("/a → /x → /b"), row("/c → /x → /b")
    assert told(monkeypatch, [first], [first, second], [first, second]) == [
        ["drive"],
        ["drive"],
        [],
    ]


@pytest.mark.thorough
def test_of_violations_the_oldest_goes_first(tmp_path: Path) -> None:
    """Not by name: a name that became free is taken again."""
    recorder = FlightRecorder(
        tmp_path, most=2, window_ns=1, earlier_ns=0, clock_sync="none", note=lambda _: None
    )
    simulate(
        "quiet", tmp_path / "trace", factor=0.05, recording=Recording(rotations=(SECOND // 50,))
    )
    (chunk,) = list(tmp_path.glob("trace/**/archives/*"))[:1]
    read = read_chunk(Chunk(0, chunk.parents[1], chunk), Continuation())
    assert read is not None
    ends = [SECOND + number for number in range(4)]
    for end_ns in ends:
        recorder.keep(end_ns, KeptTraces([], [read]), [chunk], None, None)
    recorder.close()
    marks = [path.read_text() for path in tmp_path.glob("violation-*/.msgflow-violation")]
    assert sorted(map(int, marks)) == ends[-2:]
