"""One value that makes no sense ends no ingest, no check and no query."""

from __future__ import annotations

import os
import shutil
import struct
from pathlib import Path

import pytest
from support.ingested import rows
from support.mutations import packet_begins, streams
from support.thorough import few

import msgflow_sim as sim
from msgflow import open_db
from msgflow.errors import TraceError
from msgflow.ingest import ingest


def copied(trace: Path, to: Path) -> Path:
    shutil.copytree(trace, to / "robot")
    return to / "robot"


def directories(root: Path) -> list[Path]:
    return sorted(path.parent for path in root.rglob("metadata"))


def findings(database: Path) -> dict[str, tuple[str, int, str]]:
    with open_db(database) as opened:
        rows = opened.sql("SELECT name, severity, count, detail FROM finding").to_arrow()
        for name in ("info-findings", "e2e-latency", "info-quality", "info"):
            opened.query(name)
    return {row["name"]: (row["severity"], row["count"], row["detail"]) for row in rows.to_pylist()}


def replace(root: Path, before: bytes, after: bytes) -> int:
    """Replace bytes in all streams; return how often they occurred."""
    count = 0
    for directory in directories(root):
        for path in streams(directory):
            content = path.read_bytes()
            count += content.count(before)
            path.write_bytes(content.replace(before, after))
    return count


@pytest.mark.thorough
@pytest.mark.parametrize("stamp", few([-(1 << 63), (1 << 63) - 1, 1 << 62, -(1 << 62)], 1 << 62))
def test_stamps(trace: Path, tmp_path: Path, database: Path, stamp: int) -> None:
    taken = "SELECT source_timestamp_ns FROM take WHERE source_timestamp_ns > 0 ORDER BY taken_ns"
    stamps = [stamp for (stamp,) in rows(database, taken)]
    good = struct.pack("<q", stamps[len(stamps) // 2])
    changed = copied(trace, tmp_path)
    wrong = replace(changed, good, struct.pack("<q", stamp))
    assert wrong >= 2
    # One nanosecond less is a time.
    latest = (1 << 62) - 1
    replace(changed, struct.pack("<q", max(stamps)), struct.pack("<q", latest))
    with open_db(database) as opened:
        opened.ingest(changed, name="changed", replace=True)
    severity, count, detail = findings(database)["implausible_value"]
    assert severity == "warning"
    assert 1 <= count <= wrong
    assert "that cannot be times: left out" in detail
    left = [stamp for (stamp,) in rows(database, taken)]
    assert len(left) < len(stamps)
    assert left.count(latest) == stamps.count(max(stamps))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("wrong", "right"),
    few(
        [((1 << 64) - 1, 1 << 40), (1 << 63, 1 << 40), ((1 << 48) + 1, 1 << 48)],
        ((1 << 48) + 1, 1 << 48),
    ),
)
def test_counters_of_lost_events(
    trace: Path, tmp_path: Path, new_database: Path, wrong: int, right: int
) -> None:
    changed = copied(trace, tmp_path)
    paths = streams(directories(changed)[0])
    for path, counter in zip(paths[:2], (wrong, right), strict=True):
        content = bytearray(path.read_bytes())
        struct.pack_into("<Q", content, packet_begins(bytes(content))[-1] + 72, counter)
        path.write_bytes(content)
    ingest([changed], new_database)
    found = findings(new_database)
    assert found["damaged_trace"][1] == 1
    assert paths[0].name in found["damaged_trace"][2]
    assert "discarded_events" in found


@pytest.mark.thorough
def test_a_stream_copied_beside_itself_and_a_pipe(
    trace: Path, tmp_path: Path, database: Path, new_database: Path
) -> None:
    changed = copied(trace, tmp_path)
    path = streams(directories(changed)[0])[0]
    shutil.copy(path, path.with_name("copy of it"))
    os.mkfifo(path.with_name("pipe"))
    ingest([changed], new_database)
    counts = "SELECT count(*), sum(event_count)::BIGINT FROM publication CROSS JOIN trace"
    assert rows(new_database, counts) == rows(database, counts)
    found = findings(new_database)
    severity, count, detail = found["repeated_packet"]
    assert (severity, count) == ("warning", len(packet_begins(path.read_bytes())))
    assert "copied beside" in detail
    assert "a pipe, no file: left out" in found["damaged_trace"][2]


def test_damage_is_the_reason_where_nothing_is_left(
    trace: Path, tmp_path: Path, new_database: Path
) -> None:
    changed = copied(trace, tmp_path)
    for directory in directories(changed):
        for path in streams(directory):
            content = path.read_bytes()
            path.write_bytes(b"\0" * len(content))
    with pytest.raises(
        TraceError, match="could be read, the trace is damaged: no packet"
    ) as caught:
        ingest([changed], new_database)
    assert "copy it again" in (caught.value.hint or "")
    assert not new_database.exists()


@pytest.mark.thorough
def test_a_stream_that_is_missing(trace: Path, tmp_path: Path, new_database: Path) -> None:
    changed = copied(trace, tmp_path)
    path = streams(directories(changed)[0])[0]
    if not (path.parent / "index" / f"{path.name}.idx").exists():
        (path.parent / "index").mkdir(exist_ok=True)
        (path.parent / "index" / f"{path.name}.idx").write_bytes(b"")
    path.unlink()
    ingest([changed], new_database)
    severity, _, detail = findings(new_database)["damaged_trace"]
    assert severity == "error"
    assert f"the stream {path.name} is missing, only its index is there" in detail


@pytest.mark.thorough
@pytest.mark.parametrize("length", few([1025, 1_000_000], 1025))
def test_names_that_are_too_long(tmp_path: Path, new_database: Path, length: int) -> None:
    """Each message is joined with the name of its topic, so that one took gigabytes."""
    topics = tuple("/" + "x" * (some - 1) for some in (1024, length))
    timer = sim.Timer(10**6, publishes=topics)
    talker = sim.Node("talker", publishers=tuple(map(sim.Publisher, topics)), timers=(timer,))
    hearer = sim.Node("hearer", subscriptions=tuple(map(sim.Subscription, topics)))
    scenario = sim.Scenario(
        "long_name",
        "A topic with a long name.",
        (sim.Host("alpha"),),
        (
            sim.Process("talker", "alpha", 100, (talker,)),
            sim.Process("hearer", "alpha", 200, (hearer,)),
        ),
        duration_ns=600_000_000,
    )
    packets = sim.Recording(start_ns=1, packet_bytes=1 << 23)
    trace = sim.simulate(scenario, tmp_path / "out", recording=packets).directory
    ingest([trace], new_database)
    found = findings(new_database)
    assert rows(new_database, "SELECT count(*) > 800 FROM link_transport") == [(True,)]
    severity, count, detail = found["implausible_value"]
    assert (severity, count) == ("warning", 1)
    assert "names: too long: left out" in detail
    long = "SELECT length(topic_name) AS long FROM publisher WHERE long >= 100"
    assert rows(new_database, long) == [(1024,)]
