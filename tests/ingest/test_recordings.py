"""Which traces below some paths become one run."""

from __future__ import annotations

import tarfile
import uuid
from pathlib import Path

import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_trace

from msgflow.ingest.recordings import find_recordings

_INIT = "ros2:rcl_node_init"
_WORK = "ros2:callback_start"
_OF_ROS = {_INIT, _WORK}


def _record(
    directory: Path, begin: int, end: int, *, trace: int = 0, event: str = _INIT, clock: int = 1
) -> Path:
    """Write a trace of two moments; traces of one number are one trace."""
    return write_trace(
        directory,
        TraceContent(
            events={event: {"x": "u64"}},
            streams={0: [Packet([Event(time, event, (1,)) for time in (begin, end)])]},
            environment={"hostname": "robot", "domain": "ust" if event in _OF_ROS else "kernel"},
            trace_uuid=uuid.UUID(int=trace) if trace else uuid.uuid4(),
            clock_uuid=uuid.UUID(int=clock),
        ),
    )


def _found(*paths: Path, **hosts: list[str]) -> list[list[Path]]:
    return [list(map(Path, each.paths)) for each in find_recordings(paths, hosts)]


def test_sessions_of_different_times_are_recordings_in_order_of_time(tmp_path: Path) -> None:
    _record(tmp_path / "a/ust/uid/1000/64-bit", 500, 600)
    _record(tmp_path / "b/ust/uid/1000/64-bit", 100, 200)
    assert _found(tmp_path) == [[tmp_path / "b"], [tmp_path / "a"]]


def test_sessions_that_overlap_are_one_recording(tmp_path: Path) -> None:
    _record(tmp_path / "night/robot/ust", 100, 200)
    _record(tmp_path / "night/laptop/ust", 200, 300, clock=2)
    assert _found(tmp_path) == [[tmp_path]]
    _record(tmp_path / "day/ust", 301, 400)
    assert _found(tmp_path) == [[tmp_path / "night"], [tmp_path / "day"]]


def test_a_long_session_holds_those_beside_it_together(tmp_path: Path) -> None:
    _record(tmp_path / "long", 100, 900)
    _record(tmp_path / "early", 200, 300)
    _record(tmp_path / "late", 800, 850)
    assert _found(tmp_path) == [[tmp_path]]


def test_processes_of_one_session_are_one_recording_at_any_time(tmp_path: Path) -> None:
    _record(tmp_path / "night/ust/pid/first-7-20260314-120000", 100, 200)
    _record(tmp_path / "night/ust/pid/second-8-20260314-120001", 300, 400)
    assert _found(tmp_path) == [[tmp_path]]


def test_snapshots_of_one_trace_are_one_recording(tmp_path: Path) -> None:
    for number, begin in enumerate((100, 300, 500)):
        _record(tmp_path / f"snapshot-{number}/ust", begin, begin + 100, trace=number < 2)
    assert _found(tmp_path) == [
        [tmp_path / "snapshot-0", tmp_path / "snapshot-1"],
        [tmp_path / "snapshot-2"],
    ]


def test_a_session_without_initialisation_belongs_to_the_last_one_of_its_clock(
    tmp_path: Path,
) -> None:
    _record(tmp_path / "init-0", 100, 200)
    _record(tmp_path / "init-1", 300, 400)
    _record(tmp_path / "other-host", 450, 460, clock=2)
    _record(tmp_path / "run", 500, 600, event=_WORK)
    assert _found(tmp_path) == [
        [tmp_path / "init-0"],
        [tmp_path / "init-1", tmp_path / "run"],
        [tmp_path / "other-host"],
    ]


def test_links_lead_to_the_traces(tmp_path: Path) -> None:
    first = _record(tmp_path / "far/one/ust/uid", 100, 200)
    second = _record(tmp_path / "far/two/ust/uid", 300, 400)
    (tmp_path / "near").mkdir()
    (tmp_path / "near/b").symlink_to(tmp_path / "far/one")
    (tmp_path / "near/a").symlink_to(tmp_path / "far/two")
    assert _found(tmp_path / "near") == [[first], [second]]


def test_an_archive_is_a_session(tmp_path: Path) -> None:
    files = []
    for name, begin in (("one", 300), ("two", 100)):
        _record(tmp_path / name / "a", begin, begin + 10)
        _record(tmp_path / name / "b", begin + 50, begin + 60)
        files.append(tmp_path / f"{name}.tar")
        with tarfile.open(files[-1], "w") as archive:
            archive.add(tmp_path / name, name)
    assert _found(*files) == [[files[1]], [files[0]]]
    assert _found(files[0]) == [[files[0]]]


def test_an_archive_in_the_folder_of_a_session_belongs_to_it(tmp_path: Path) -> None:
    _record(tmp_path / "night/ust/uid/1000/64-bit", 500, 600)
    _record(tmp_path / "day/ust/uid/1000/64-bit", 100, 200)
    _record(tmp_path / "kernel", 10, 20, event="sched_switch", clock=2)
    archive = tmp_path / "night/kernel.tar"
    with tarfile.open(archive, "w") as file:
        file.add(tmp_path / "kernel", "kernel")
    assert _found(tmp_path / "night", archive) == [[tmp_path / "night", archive]]
    # The folder alone does not have what is in the archive: both are named.
    assert _found(tmp_path / "night", tmp_path / "day", archive) == [
        [tmp_path / "day"],
        [archive, tmp_path / "night"],
    ]


def test_times_of_kernel_traces_beside_those_of_ros_do_not_count(tmp_path: Path) -> None:
    for name, begin in (("day", 100), ("night", 500)):
        _record(tmp_path / name / "ust", begin, begin + 100)
        _record(tmp_path / name / "kernel", 10, 900, event="sched_switch", clock=2)
    assert _found(tmp_path) == [[tmp_path / "day"], [tmp_path / "night"]]


@pytest.mark.parametrize(
    ("ros", "perf"), [("ust/uid/1000/64-bit", "perf"), ("ros", "perf"), ("perf/ros", "perf")]
)
def test_a_trace_of_perf_belongs_to_the_session_that_it_lies_in_beside_or_around(
    tmp_path: Path, ros: str, perf: str
) -> None:
    for name, begin in (("day", 10_100), ("night", 10_500)):
        # From the boot, which was anew between the two.
        _record(tmp_path / name / perf, 10, 90, event="sched_switch", clock=2)
        _record(tmp_path / name / ros, begin, begin + 100)
    assert _found(tmp_path / "day") == [[tmp_path / "day"]]
    assert _found(tmp_path) == [[tmp_path / "day"], [tmp_path / "night"]]


def test_of_several_sessions_beside_it_a_kernel_trace_belongs_to_those_of_its_time(
    tmp_path: Path,
) -> None:
    for name, begin in (("day", 100), ("evening", 300), ("night", 500)):
        _record(tmp_path / name, begin, begin + 100)
    _record(tmp_path / "kernel", 350, 560, event="sched_switch", clock=2)
    assert _found(tmp_path) == [
        [tmp_path / "day"],
        [tmp_path / "evening", tmp_path / "night", tmp_path / "kernel"],
    ]


def test_kernel_traces_of_no_session_stay_apart(tmp_path: Path) -> None:
    for name, begin in (("day", 10_100), ("night", 10_500)):
        _record(tmp_path / name, begin, begin + 100)
    for name in ("one", "two"):
        _record(tmp_path / name, 10, 90, event="sched_switch", clock=2)
    alone = [[tmp_path / name] for name in ("day", "night", "one", "two")]
    assert _found(tmp_path) == alone


def test_each_recording_has_its_hosts(tmp_path: Path) -> None:
    first = _record(tmp_path / "a", 100, 200)
    second = _record(tmp_path / "b", 300, 400)
    found = find_recordings([tmp_path], {"robot": [str(tmp_path)], "laptop": [str(second)]})
    assert [dict(each.hosts) for each in found] == [{"robot": [first]}, {"laptop": [second]}]


@pytest.mark.parametrize("begin", [200, 201])
def test_times_that_touch_overlap(tmp_path: Path, begin: int) -> None:
    _record(tmp_path / "a", 100, 200)
    _record(tmp_path / "b", begin, 300)
    assert len(_found(tmp_path)) == begin - 199
