"""Windows over the chunks of a recording have the numbers of an ingest of the whole."""

from __future__ import annotations

import os
import shutil
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from unittest.mock import Mock

import duckdb
import pytest
from support.robots import robot
from support.same_windows import by_path, require_equal, require_same_as_whole
from support.thorough import few, thorough

from msgflow.cli.show.watch_screen import window_line
from msgflow.clocks.clocks_file import read_clock_sync
from msgflow.database import Database
from msgflow.errors import TraceError
from msgflow.ingest import ingest
from msgflow.links.links_file import LinksFile, read_links
from msgflow.sql.interrupt import until_interrupted
from msgflow.watch import chunk as chunk_module
from msgflow.watch import history as history_module
from msgflow.watch.arrivals import Arrivals
from msgflow.watch.chunk import Chunk, finished_chunks
from msgflow.watch.follow import watch_finished, watch_live
from msgflow.watch.learned_answers import LearnedAnswers
from msgflow.watch.watcher import Watcher
from msgflow.watch.window_report import WindowReport
from msgflow_sim import (
    Node,
    Publisher,
    Recording,
    Subscription,
    Timer,
    Work,
    simulate,
)

MS = 1_000_000
SECOND = 1_000_000_000


def reports(
    directory: Path, *, window: float, step: float, notes: list[str] | None = None
) -> list[WindowReport]:
    return list(watch_finished(directory, watching([] if notes is None else notes, window, step)))


def watching(
    notes: list[str],
    window: float,
    step: float,
    links: LinksFile | None = None,
    clocks: str | Path = "none",
    late: float | None = None,
) -> Watcher:
    """Return a watcher; it waits for a step, or for so many seconds, for what is late."""
    return Watcher(
        window_ns=round(window * SECOND),
        step_ns=round(step * SECOND),
        late_ns=round((step if late is None else late) * SECOND),
        links=links,
        clocks=read_clock_sync(clocks),
        note=notes.append,
    )


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot of two hosts, rotated into four chunks each."""
    directory = tmp_path_factory.mktemp("simulated") / "trace"
    rotations = tuple(SECOND // 2 * number for number in (1, 2, 3))
    simulate("two_hosts", directory, factor=0.2, recording=Recording(rotations=rotations))
    return directory


def test_an_interrupt_ends_the_statement_of_a_step(
    simulated: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It does not wait for the end of the step, nor for the next one."""

    def slow(con: duckdb.DuckDBPyConnection, *_: object, **__: object) -> None:
        threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
        con.execute("SELECT sum(hash(i)) FROM range(9_000_000_000) AS numbers (i)").fetchall()

    monkeypatch.setattr("msgflow.watch.watcher.ingest_again", slow)
    begin = time.process_time()
    with until_interrupted():
        reports(simulated, window=0.5, step=0.5)
        raise AssertionError
    assert time.process_time() - begin < 5


def test_an_interrupt_does_not_wait_for_a_backlog(
    simulated: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[Chunk] = []

    def interrupted(watcher: Watcher, chunk: Chunk) -> None:
        read.append(chunk)
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(Watcher, "read", interrupted)
    watcher = watching([], 0.5, 0.5)
    with until_interrupted():
        list(watch_live(simulated, watcher, step_ns=SECOND, is_over=lambda: True, note=print))
        raise AssertionError
    watcher.close()
    assert len(read) == 1


@pytest.mark.thorough
def test_a_simulated_recording(simulated: Path, tmp_path: Path) -> None:
    ingest([simulated], tmp_path / "whole.duckdb")
    found = reports(simulated, window=0.5, step=0.5)
    require_same_as_whole(found, tmp_path / "whole.duckdb")


@pytest.mark.thorough
def test_windows_that_overlap(simulated: Path) -> None:
    """A window of two steps has what each of both has."""
    single = reports(simulated, window=0.5, step=0.5)
    double = reports(simulated, window=1.0, step=0.5)
    assert [report.window.end_ns for report in double] == [r.window.end_ns for r in single]
    both = by_path(list(double[1].paths))
    halves = [by_path(list(report.paths)) for report in single[:2]]
    for path, row in both.items():
        assert row["roots"] == sum(half[path]["roots"] for half in halves if path in half)


def test_a_damaged_and_a_missing_chunk_are_said(simulated: Path, tmp_path: Path) -> None:
    directory = tmp_path / "trace"
    shutil.copytree(simulated, directory)
    second, third = sorted(directory.glob("*/archives/*"))[1:3]
    shutil.rmtree(second)
    for metadata in third.rglob("metadata"):
        metadata.write_bytes(b"nothing of CTF")
    notes: list[str] = []
    found = reports(directory, window=9, step=9, notes=notes)
    assert any(
        "chunks are missing before number 2 of" in note and note.endswith(": 1") for note in notes
    )
    assert any("a chunk cannot be read" in note for note in notes)
    assert sum(row["roots"] for report in found for row in report.paths) > 0


@pytest.mark.thorough
def test_a_chunk_without_any_file_is_no_damage(simulated: Path, tmp_path: Path) -> None:
    directory = tmp_path / "trace"
    shutil.copytree(simulated, directory)
    for host in directory.glob("*/archives"):
        last = max(host.iterdir())
        shutil.rmtree(last)
        (last / "ust").mkdir(parents=True)
    notes: list[str] = []
    assert reports(directory, window=9, step=9, notes=notes)
    assert notes == []


@pytest.mark.thorough
def test_a_clock_that_is_set_is_said_and_is_no_lag(
    simulated: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The tracer goes on with the clock that it began with."""
    notes: list[str] = []
    watcher = watching(notes, 0.5, 0.5)
    now = time.time_ns
    lags = []
    for number, chunk in enumerate(finished_chunks(simulated)):
        # Time servers correct it bit by bit, too: these hours are no lag.
        past = number * SECOND // 8 + (3600 * SECOND if number > 5 else 0)
        monkeypatch.setattr(time, "time_ns", lambda past=past: now() - past)
        watcher.read(chunk)
        report = watcher.report(watcher.history.newest_ns, is_live=True)
        if report is not None:
            lags.append(report.lag_s)
    watcher.close()
    assert len(lags) > 1
    assert max(lags) - min(lags) < 60
    (said,) = [note for note in notes if "the clock of this machine was set" in note]
    assert "by -3600" in said


@pytest.mark.thorough
def test_links_and_clocks_of_what_is_not_there_are_said(simulated: Path, tmp_path: Path) -> None:
    """It may start later: the view goes on, with the other links."""
    clocks = tmp_path / "clocks.yaml"
    clocks.write_text("later: {offset_ns: 1000}")
    file = tmp_path / "links.yaml"
    file.write_text(
        "links:\n"
        "- {kind: direct, node: /later, inputs: [/a], outputs: [/b]}\n"
        "- {kind: independent, node: /relay, inputs: [/topic_a], outputs: [/topic_b]}\n"
    )
    notes: list[str] = []
    watcher = watching(notes, 1, 1, read_links(file), clocks)
    found = list(watch_finished(simulated, watcher))
    assert len(found) > 1
    # The link of the relay is forbidden.
    paths = {row["path"] for report in found for row in report.paths if row["reached"]}
    assert paths
    assert not any("/topic_a → /relay → /topic_b" in path for path in paths)
    # Each is said once.
    of_links, of_clocks = sorted(notes)
    assert of_links.startswith("a link is left out for now: ")
    assert "/later" in of_links
    assert of_clocks.startswith("clocks are not corrected for now: ")
    assert "later" in of_clocks


@pytest.mark.thorough
def test_what_was_learned_may_not_fit_a_window(
    simulated: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where two containers have the node by now."""
    learned = "links: [{kind: direct, node: /later, inputs: [/a], outputs: [/b]}]"
    monkeypatch.setattr(LearnedAnswers, "doubted", lambda self, con: learned)
    notes: list[str] = []
    (report,) = reports(simulated, window=9, step=9, notes=notes)
    assert sum(path["reached"] for path in report.paths) > 0
    (said,) = notes
    assert said.startswith("a link is left out for now: ")
    assert "/later" in said


@pytest.mark.thorough
def test_a_recording_that_ended_long_ago_is_no_lag(simulated: Path) -> None:
    notes: list[str] = []
    watcher = watching(notes, 0.5, 0.5)
    looks = iter([False, True])
    found = list(
        watch_live(
            simulated, watcher, step_ns=SECOND // 2, is_over=lambda: next(looks), note=notes.append
        )
    )
    watcher.close()
    assert found
    (said,) = [note for note in notes if "no chunk comes any more" not in note]
    assert said.startswith("the last event is ")
    assert "--once" in said


def fed(
    chunks: list[list[Path]], directory: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[[], bool]:
    """Return a function that lets the next chunks come, and tells whether these were the last.

    Args:
        chunks: those that come at one time; each is `…/host/archives/name`.
        directory: into which they come.
        monkeypatch: has recordings searched at each look.
    """
    monkeypatch.setattr(chunk_module, "_BETWEEN_SEARCHES", 0)
    monkeypatch.setattr(chunk_module, "_MOST_OF_TIME", float("inf"))
    left = iter([[], *chunks])

    def is_over() -> bool:
        coming = next(left, None)
        for path in coming or ():
            shutil.copytree(path, directory.joinpath(*path.parts[-3:]))
        return coming is None

    return is_over


@pytest.mark.thorough
@pytest.mark.parametrize("sync", few(["none", "messages"], "messages"))
def test_a_clock_that_errs_is_said_and_its_host_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sync: str
) -> None:
    """Windows of the other one are as long as they should be, and full."""
    rotations = tuple(SECOND // 4 * number for number in range(1, 8))
    recording = Recording(rotations=rotations)
    source = tmp_path / "whole"
    simulate("two_hosts", source, factor=0.2, recording=recording, clock_offset_ns=60 * SECOND)
    hosts = [sorted(host.iterdir()) for host in sorted(source.glob("*/archives"))]
    notes: list[str] = []
    watcher = watching(notes, 0.25, 0.25, clocks=sync)
    found = list(
        watch_live(
            tmp_path / "live",
            watcher,
            # Chunks come as fast as they are read: none is missed.
            step_ns=10 * SECOND,
            is_over=fed(
                [list(pair) for pair in zip(*hosts, strict=True)], tmp_path / "live", monkeypatch
            ),
            note=notes.append,
        )
    )
    watcher.close()
    (said,) = [note for note in notes if "the clock of" in note]
    assert "is 60 s behind the others: going on without it" in said
    assert "chrony" in said
    assert not any("no chunk comes any more" in note for note in notes)
    lengths = [report.window.end_ns - report.window.start_ns for report in found]
    assert max(lengths[-3:]) < SECOND // 2
    assert all(any(row["callbacks"] for row in report.executors) for report in found[-3:])


@pytest.mark.thorough
def test_the_only_host_that_vanishes_and_a_clock_apart_are_said_once(
    simulated: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    notes: list[str] = []
    watcher = watching(notes, 0.5, 0.5)
    host = sorted(simulated.glob("*/archives"))[0]
    vanished = iter([[], [tmp_path / host.parent.name], []])
    monkeypatch.setattr(Arrivals, "vanished", lambda self, looked_s, waiting: next(vanished, []))
    monkeypatch.setattr(Arrivals, "clocks_ahead_s", lambda self: {Path("robot"): -1.2})
    looks = fed([[path] for path in sorted(host.iterdir())], tmp_path, monkeypatch)
    found = list(
        watch_live(tmp_path, watcher, step_ns=SECOND // 2, is_over=looks, note=notes.append)
    )
    watcher.close()
    assert found
    assert [note for note in notes if "no chunk comes any more" in note] == [
        f"no chunk comes any more from {tmp_path / host.parent.name}"
    ]
    (said,) = [note for note in notes if "the clock of" in note]
    assert said.startswith("the clock of robot is 1 s behind the others: windows wait as long as")


@pytest.mark.thorough
def test_a_session_created_anew_is_said_and_gone_on_with(
    simulated: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Numbers of its chunks begin again."""
    first, second, third, fourth = sorted(sorted(simulated.glob("*/archives"))[0].iterdir())
    later = tmp_path / "renamed" / third.parts[-3] / "archives"
    later.mkdir(parents=True)
    anew = [
        Path(shutil.copytree(path, later / f"{path.name.rpartition('-')[0]}-{number}"))
        for number, path in enumerate((third, fourth))
    ]
    notes: list[str] = []
    watcher = watching(notes, 0.5, 0.5)
    looks = fed([[first], [second], [anew[0]], [anew[1]]], tmp_path / "live", monkeypatch)
    found = list(
        watch_live(
            tmp_path / "live", watcher, step_ns=100 * SECOND, is_over=looks, note=notes.append
        )
    )
    watcher.close()
    # The first chunk of the new one counts when its second one has come.
    assert len(found) == 3
    assert all(one.window.end_ns == next_.window.start_ns for one, next_ in pairwise(found))
    assert all(any(row["callbacks"] for row in report.executors) for report in found)
    (said,) = [note for note in notes if "last event" not in note]
    assert said.startswith(f"a new recording has begun in {tmp_path / 'live' / third.parts[-3]}: ")


@pytest.mark.thorough
def test_a_backlog_is_read_step_by_step(
    simulated: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All of one host came before all of the other: windows wait for the one that is behind."""
    monkeypatch.setattr(history_module, "_MOST_EVENTS", 1)
    first, second = (sorted(host.iterdir()) for host in sorted(simulated.glob("*/archives")))
    notes: list[str] = []
    watcher = watching(notes, 0.25, 0.25)
    come = [[first[0], second[0]], [*first[1:], *second[1:]]]
    looks = fed(come, tmp_path / "live", monkeypatch)
    found = list(
        watch_live(
            tmp_path / "live", watcher, step_ns=10 * SECOND, is_over=looks, note=notes.append
        )
    )
    watcher.close()
    assert len(found) > 3
    assert not any(report.late_events for report in found)
    assert not any("no chunk comes" in note for note in notes)
    callbacks = sum(row["callbacks"] for report in found for row in report.executors)
    (whole,) = reports(simulated, window=9, step=9)
    assert callbacks == sum(row["callbacks"] for row in whole.executors)


def test_a_recording_without_chunks(tmp_path: Path) -> None:
    with pytest.raises(TraceError, match="no chunks of a rotated recording"):
        reports(tmp_path, window=1, step=1)


@pytest.fixture(scope="module")
def hang(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A detector that reads its calibration for 700 ms, once; in chunks of 200 ms."""
    camera = Node(
        "camera",
        publishers=(Publisher("/image"),),
        timers=(Timer(20 * MS, publishes=("/image",)),),
    )
    detector = Node(
        "detector",
        publishers=(Publisher("/objects"),),
        subscriptions=(Subscription("/image", ("/objects",)),),
        timers=(Timer(1_300 * MS, work=Work(typical_ns=700 * MS)),),
    )
    sink = Node("sink", subscriptions=(Subscription("/objects"),))
    scenario = robot(camera, detector, sink, duration_ns=2_600 * MS)
    directory = tmp_path_factory.mktemp("hang") / "trace"
    rotations = tuple(200 * MS * number for number in range(1, 13))
    simulate(scenario, directory, recording=Recording(rotations=rotations))
    return directory


def live(directory: Path, watcher: Watcher) -> list[WindowReport]:
    """Return what a view shows that gets one chunk after the other."""
    found = []
    for chunk in finished_chunks(directory):
        watcher.read(chunk)
        if (report := watcher.report(watcher.history.newest_ns, is_live=True)) is not None:
            found.append(report)
    return found


@pytest.mark.thorough
def test_a_node_may_hang_for_as_long_as_windows_wait(hang: Path, tmp_path: Path) -> None:
    """What waits for it is counted in the window in which it began."""
    found = list(watch_finished(hang, watching([], 0.4, 0.2, late=0.8)))
    with Database(tmp_path / "whole.duckdb") as whole:
        whole.ingest([hang])
        for report in found:
            require_equal(whole, report)
    assert max(row["max_ns"] or 0 for report in found for row in report.paths) > 650 * MS


@pytest.mark.thorough
def test_windows_and_alarms_wait_for_nothing_that_takes_longer(hang: Path) -> None:
    """It has not arrived there; each moment is counted once, when its window is closed."""
    alarm, exporter = Mock(), Mock()
    alarm.judge.return_value = ([], Counter())
    watcher = Watcher(
        window_ns=2 * SECOND // 5,
        step_ns=SECOND // 5,
        late_ns=SECOND // 5,
        links=None,
        clocks=read_clock_sync("none"),
        note=print,
        alarm=alarm,
        exporter=exporter,
    )
    shown = live(hang, watcher)
    watcher.close()
    windows = [report.window for report in shown]
    assert len(windows) > 8
    assert all(after.end_ns - before.end_ns == SECOND // 5 for before, after in pairwise(windows))
    # Before the first ones nothing was recorded.
    assert {window.end_ns - window.start_ns for window in windows[2:]} == {2 * SECOND // 5}
    to_sink = [row for report in shown for row in report.paths if "/objects" in row["path"]]
    assert max(row["max_ns"] or 0 for row in to_sink) < 650 * MS
    # The detector has not read them, since it is in its callback.
    hung = [row["reasons"]["reader_in_callback"] for row in to_sink if row["reasons"]]
    assert max(hung) > 10
    judged = [call.args[1] for call in alarm.judge.call_args_list]
    finals = [call.args[2] for call in alarm.judge.call_args_list]
    for window, part, final_ns in zip(windows, judged, finals, strict=True):
        assert part.start_ns == window.start_ns
        # What came behind the window counts, too, and is provisional.
        assert part.end_ns - window.end_ns > SECOND // 5
        assert final_ns == window.end_ns
    counted = [call.args[1] for call in exporter.count.call_args_list]
    assert [window.end_ns for window in counted] == [window.end_ns for window in windows]
    assert all(before.end_ns == after.start_ns for before, after in pairwise(counted))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("late", "is_late"),
    [thorough(0.6, False, id="within_late"), pytest.param(0.1, True, id="later")],
)
def test_a_chunk_that_comes_after_those_of_another_host(
    simulated: Path, late: float, is_late: bool
) -> None:
    """Each chunk of one host comes when the next one of the other one is there."""
    first, second = (
        [chunk for chunk in finished_chunks(simulated) if chunk.source == source]
        for source in sorted({chunk.source for chunk in finished_chunks(simulated)})
    )
    notes: list[str] = []
    watcher = watching(notes, 0.5, 0.5, late=late)
    found = []
    for chunks in ([first[0]], *([a, b] for a, b in zip(first[1:], second[:-1], strict=True))):
        for chunk in chunks:
            watcher.read(chunk)
            report = watcher.report(watcher.history.newest_ns, is_live=True)
            if report is not None:
                found.append(report)
    watcher.read(second[-1])
    last = watcher.report(watcher.history.newest_ns, is_last=True)
    watcher.close()
    assert last is not None
    found.append(last)
    numbers = sum(report.late_events for report in found)
    callbacks = sum(row["callbacks"] for report in found for row in report.executors)
    whole = reports(simulated, window=9, step=9)
    missed = sum(row["callbacks"] for row in whole[0].executors) - callbacks
    if is_late:
        assert numbers > 0
        assert missed > 0
        assert notes == [
            f"events of {second[0].source} come after their window was closed: a longer --late"
            " waits for them"
        ]
        assert all("came late" in window_line(report) for report in found if report.late_events)
        assert f'"late_events": {found[-1].late_events}' in found[-1].to_json()
    else:
        assert (numbers, missed, notes) == (0, 0, [])


@pytest.mark.thorough
def test_of_a_finished_recording_no_chunk_is_late(simulated: Path) -> None:
    """Even where chunks are longer than a window and what it waits for."""
    notes: list[str] = []
    found = list(watch_finished(simulated, watching(notes, 0.2, 0.2, late=0.05)))
    assert len(found) > 2
    assert not any(report.late_events for report in found)
    assert notes == []


@pytest.mark.thorough
def test_a_source_that_stops_holds_up_no_window(simulated: Path) -> None:
    """It is neither waited for nor late."""
    chunks = finished_chunks(simulated)
    stops = chunks[0].source
    watcher = watching([], 0.5, 0.5)
    found = []
    for chunk in chunks:
        if chunk.source != stops or chunk is chunks[0]:
            watcher.read(chunk)
            report = watcher.report(watcher.history.newest_ns, is_live=True)
            if report is not None:
                found.append(report)
    newest_ns = watcher.history.newest_ns
    watcher.close()
    assert len(found) > 1
    assert newest_ns - found[-1].window.end_ns < SECOND
    assert not any(report.late_events for report in found)


@pytest.mark.thorough
def test_of_a_finished_recording_windows_wait_for_a_host_that_begins_empty(
    simulated: Path, tmp_path: Path
) -> None:
    copy = shutil.copytree(simulated, tmp_path / "trace")
    # The one that is read later.
    first = finished_chunks(copy)[1]
    assert first.number == finished_chunks(copy)[0].number
    for file in first.path.rglob("*"):
        if file.is_file():
            file.unlink()
    notes: list[str] = []
    found = list(watch_finished(copy, watching(notes, 0.2, 0.2, late=0.05)))
    assert len(found) > 2
    assert not any(report.late_events for report in found)


@pytest.mark.thorough
def test_a_clock_that_is_ahead_makes_nothing_late(
    simulated: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Here one source comes two chunks earlier than the other one, as far as its times say."""
    ahead, behind = (sorted(path.iterdir()) for path in sorted(simulated.glob("*/archives")))
    notes: list[str] = []
    watcher = watching(notes, 0.5, 0.5)
    place = tmp_path / ahead[0].parts[-3]
    monkeypatch.setattr(Arrivals, "clocks_ahead_s", lambda self: {place: 1.0})
    order = [[*ahead[:3], behind[0]], [ahead[3], behind[1]], [behind[2]], [behind[3]]]
    looks = fed(order, tmp_path, monkeypatch)
    found = list(
        watch_live(tmp_path, watcher, step_ns=SECOND // 2, is_over=looks, note=notes.append)
    )
    watcher.close()
    assert len(found) > 1
    assert not any(report.late_events for report in found)
