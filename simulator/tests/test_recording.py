"""Recordings with faults: what is missing from the trace is what the truth says is missing."""

from __future__ import annotations

import itertools
import json
import struct
from collections import Counter
from dataclasses import replace

import duckdb
import pyarrow.parquet as pq
import pytest
from support.thorough import few

from msgflow.errors import UsageError
from msgflow_sim import Buffers, Recording, long_recording, simulate

SECOND = 1_000_000_000
LENGTH = 0.3
FAULTS = {
    "late": Recording(start_ns=SECOND // 3),
    "loss": Recording(lost_event_share=0.5),
    "packets": Recording(lost_packet_share=0.3),
    "pause": Recording(pauses=((SECOND // 4, SECOND // 3), (SECOND // 2, SECOND * 2 // 3))),
    "unfinished": Recording(unfinished_streams=2),
    "dual": Recording(start_ns=SECOND // 3, is_dual_session=True),
    "rotated": Recording(rotations=(SECOND // 3, SECOND // 2)),
    "chunk": Recording(rotations=(SECOND // 3, SECOND // 2), missing_chunk=1),
    "per_process": Recording(buffers=Buffers.PER_PROCESS),
    "brim": Recording(lost_event_share=0.5, filled_share=0.5, packet_bytes=4096),
    "one_cpu": Recording(lost_event_share=0.9, packet_bytes=4096, lossy_cpus=(1,)),
    "stopped": Recording(
        pauses=((SECOND // 2, SECOND * 3 // 4),), rotations=(SECOND // 3, SECOND * 2 // 3)
    ),
    "snapshots": Recording(
        snapshots=(SECOND // 3, SECOND // 2, SECOND), kept_packets=2, packet_bytes=4096
    ),
    "last_snapshot": Recording(
        snapshots=(SECOND // 2, SECOND),
        kept_packets=16,
        is_last_snapshot_only=True,
        packet_bytes=4096,
    ),
}
LOSSES = ("loss", "brim", "one_cpu")
CAUSES = {
    "late": "late start",
    "loss": "loss",
    "packets": "packets",
    "pause": "pause",
    "unfinished": "truncation",
    "chunk": "packets",
    "dual": "late start",
    "brim": "loss",
    "one_cpu": "loss",
    "stopped": "pause",
    "snapshots": "packets",
    "last_snapshot": "packets",
}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Simulates the pipeline with a fault, or without, once."""
    done = {}

    def make(name):
        if name not in done:
            directory = tmp_path_factory.mktemp("recording") / name
            recording = FAULTS.get(name, Recording())
            done[name] = simulate("pipeline", directory, factor=LENGTH, recording=recording)
        return done[name]

    return make


def _events(bt2, simulation):
    """Events with place and time, and how many were discarded as babeltrace 2 says."""
    events, discarded, packets = Counter(), 0, 0
    for message in bt2.TraceCollectionMessageIterator(str(simulation.directory)):
        kind = type(message).__name__
        if kind == "_EventMessageConst":
            context = message.event.common_context_field
            key = (int(context["vpid"]), int(context["vtid"]), message.event.name)
            events[(*key, message.default_clock_snapshot.ns_from_origin)] += 1
        elif kind == "_DiscardedEventsMessageConst":
            discarded += message.count or 0
        elif kind == "_DiscardedPacketsMessageConst":
            packets += message.count
    return events, discarded, packets


@pytest.fixture(scope="module")
def perfect(bt2, made):
    return _events(bt2, made("perfect"))


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(FAULTS, "brim", "last_snapshot"))
def test_the_truth_names_exactly_what_is_missing(bt2, made, perfect, name):
    simulation = made(name)
    events, discarded, packets = _events(bt2, simulation)
    everything, none, _ = perfect
    missing = duckdb.sql(f"FROM '{simulation.truth['unrecorded']}'").project(
        "pid, tid, event, ts_ns, cause"
    )
    rows = missing.fetchall()
    assert none == 0
    assert everything - events == Counter(row[:4] for row in rows)
    assert not events - everything
    assert sum(events.values()) == simulation.event_count
    assert {row[4] for row in rows} == ({CAUSES[name]} if name in CAUSES else set())
    # LTTng counts what it discards while it records, and numbers packets.
    assert (discarded > 0) is (name in LOSSES)
    assert discarded <= len(rows)
    assert (packets > 0) is (name in {"packets", "chunk", "snapshots"})


def test_counters_rise_with_every_loss(made):
    simulation = made("loss")
    header = struct.Struct("<I16sIQQQQQQQI")
    total = 0
    for stream in simulation.trace_directories[0].glob("ros2_*"):
        data, offset, last = stream.read_bytes(), 0, 0
        while offset < len(data):
            *_, begin, end, _, size, _, discarded, _ = header.unpack_from(data, offset)
            assert begin < end
            assert discarded >= last
            offset, last = offset + size // 8, discarded
        total += last
    ((count,),) = duckdb.sql(f"SELECT count(*) FROM '{simulation.truth['unrecorded']}'").fetchall()
    assert total == count > 50


HEADER = struct.Struct("<I16sIQQQQQQQI")


def _packets(directory):
    """Begin, end, sequence number and discarded events of the packets, by CPU."""
    found = {}
    for stream in sorted(directory.glob("ros2_*")):
        data, offset = stream.read_bytes(), 0
        packets = found[int(stream.name.removeprefix("ros2_"))] = []
        while offset < len(data):
            *_, begin, end, _, size, sequence, discarded, _ = HEADER.unpack_from(data, offset)
            packets.append((begin, end, sequence, discarded))
            offset += size // 8
    return found


def test_a_packet_that_is_filled_is_followed_by_a_hole_with_the_loss(made):
    """The packet behind the hole counts it; without a loss packets are continuous."""
    (directory,) = made("brim").trace_directories
    holes = []
    for packets in _packets(directory).values():
        for (_, end, _, before), (begin, _, _, after) in itertools.pairwise(packets):
            assert begin == end or after > before
            holes.append(begin - end)
    assert min(holes) == 0
    assert max(holes) > SECOND // 100
    (directory,) = made("loss").trace_directories
    for packets in _packets(directory).values():
        assert all(b[0] == a[1] for a, b in itertools.pairwise(packets))


def test_only_one_cpu_loses_events(made):
    (directory,) = made("one_cpu").trace_directories
    losing = {cpu for cpu, packets in _packets(directory).items() if packets[-1][3]}
    assert losing == {1}


def test_a_chunk_begins_with_an_empty_packet_of_every_cpu(made):
    """A few microseconds behind the last one of the chunk before; the next has the first event."""
    before, *chunks = map(_packets, made("rotated").trace_directories)
    filled = followed = 0
    for chunk in chunks:
        for cpu, packets in chunk.items():
            begin, end, sequence, _ = packets[0]
            assert begin == end
            assert sequence == before[cpu][-1][2] + 1
            last_begin, last_end, *_ = before[cpu][-1]
            if last_begin < last_end:
                assert 0 <= begin - last_end <= 10_000
                followed += 1
            assert all(later[0] > begin for later in packets[1:])
            filled += len(packets) > 1
        before = chunk
    assert filled
    assert followed


def test_a_session_that_is_rotated_while_stopped_goes_on_when_started(made):
    first, second, third = map(_packets, made("stopped").trace_directories)
    assert {packets[0][0] - first[cpu][-1][1] < 20_000 for cpu, packets in second.items()} == {True}
    for cpu, packets in third.items():
        assert packets[0][0] - second[cpu][-1][1] == SECOND // 4
        assert packets[0][2] == second[cpu][-1][2] + 1


def test_a_snapshot_has_what_is_in_the_buffers(made):
    """The newest packets of each CPU, also those that the snapshot before it has."""
    for directory in made("snapshots").trace_directories:
        assert directory.parts[-5].startswith("snapshot-1-")
        assert all(len(packets) <= 2 for packets in _packets(directory).values())
    (only,) = made("last_snapshot").trace_directories
    assert only.parts[-4].startswith("snapshot") or only.parts[-5] == "snapshot-1-1"
    ends = [
        end
        for packets in _packets(only).values()
        for (_, end, *_), _ in itertools.pairwise(packets)
    ]
    # The earlier one ended the packets of all CPUs at one time.
    assert max(ends.count(end) for end in ends) > 1


def test_a_snapshot_has_the_initialisation_events(made):
    snapshot, runtime = made("dual").trace_directories
    assert snapshot.parts[-5:-3] == ("snapshot", "ust")
    assert runtime.parts[-5:-3] == ("runtime", "ust")
    simulation = made("dual")
    counts = json.loads(simulation.meta.read_text())["hosts"]["alpha"]["events"]
    perfect = json.loads(made("perfect").meta.read_text())["hosts"]["alpha"]["events"]
    for event in ("rcl_node_init", "rcl_publisher_init", "rclcpp_subscription_callback_added"):
        assert counts[f"ros2:{event}"] == perfect[f"ros2:{event}"]
    assert counts["ros2:callback_start"] < perfect["ros2:callback_start"]


def test_a_rotated_trace_is_one_trace_in_chunks(made):
    directories = made("rotated").trace_directories
    assert [path.parts[-6] for path in directories] == ["archives"] * 3
    assert len({path.joinpath("metadata").read_bytes() for path in directories}) == 1
    assert all(any(path.glob("ros2_*")) for path in directories)


def test_a_chunk_is_missing(made):
    """What the lost chunk held is missing, and nothing else."""
    simulation = made("chunk")
    kept = [path for path in made("rotated").trace_directories if not path.parts[-5].endswith("-1")]
    ends = [path.parts[-5:] for path in simulation.trace_directories]
    assert ends == [path.parts[-5:] for path in kept]
    assert all((path / "metadata").exists() for path in simulation.trace_directories)
    times = duckdb.sql(
        f"SELECT min(ts_ns), max(ts_ns) FROM '{simulation.truth['unrecorded']}' "
        "WHERE cause = 'packets'"
    ).fetchall()
    ((first, last),) = times
    assert 0 < last - first <= SECOND // 2 - SECOND // 3


def test_each_process_has_a_trace_and_a_clock_offset_of_its_own(bt2, tmp_path):
    recording = Recording(buffers=Buffers.PER_PROCESS, clock_error_ns=4_000)
    simulation = simulate("pipeline", tmp_path / "out", factor=0.02, recording=recording)
    names = sorted(path.name.split("-")[0] for path in simulation.trace_directories)
    assert names == ["relay", "sink", "source"]
    offsets = {}
    for message in bt2.TraceCollectionMessageIterator(str(simulation.directory)):
        if type(message).__name__ == "_StreamBeginningMessageConst":
            clock = message.stream.cls.default_clock_class
            offset = clock.offset.seconds * SECOND + clock.offset.cycles
            offsets[int(message.stream.trace.environment["vpid"])] = offset
    errors = dict(
        duckdb.sql(f"SELECT pid, clock_error_ns FROM '{simulation.truth['trace']}'").fetchall()
    )
    assert offsets.keys() == errors.keys() == {1101, 1201, 1301}
    assert len({offsets[pid] - errors[pid] for pid in offsets}) == 1
    assert len(set(offsets.values())) == 3


def test_the_truth_names_missing_packets_that_were_empty(tmp_path):
    """Of processes that were never on that CPU: their traces show the packets before it."""
    recording = Recording(
        rotations=(SECOND // 8,), buffers=Buffers.PER_PROCESS, unfinished_streams=1
    )
    simulation = simulate("two_hosts", tmp_path / "out", factor=0.03, recording=recording)
    found = duckdb.sql(
        f"SELECT host, pid, cpu, cause, since_ns FROM '{simulation.truth['missing_packet']}'"
    ).fetchall()
    assert {(cpu, cause) for _, _, cpu, cause, _ in found} == {(0, "truncation")}
    # Nothing of these processes is missing, and of the others something is.
    torn = set(
        duckdb.sql(f"SELECT DISTINCT host, pid FROM '{simulation.truth['unrecorded']}'").fetchall()
    )
    empty = {(host, pid) for host, pid, *_ in found}
    every = set(duckdb.sql(f"SELECT host, pid FROM '{simulation.truth['trace']}'").fetchall())
    assert empty | torn == every
    assert not empty & torn
    assert min(len(empty), len(torn)) > 0
    # The one before it opened the second chunk.
    hosts = json.loads((tmp_path / "out" / "truth" / "meta.json").read_text())["hosts"]
    assert {since - hosts[host]["begin_of_tracing_ns"] for host, *_, since in found} == {
        SECOND // 8
    }


def test_a_stream_may_end_within_a_packet(tmp_path):
    simulation = simulate(
        "pipeline", tmp_path / "out", factor=LENGTH, recording=Recording(cut_streams=1)
    )
    (directory,) = simulation.trace_directories
    assert directory.joinpath("ros2_0").stat().st_size % 4096
    assert not directory.joinpath("ros2_1").stat().st_size % 4096


def test_source_stamps_run_away_from_the_clock_of_the_trace(tmp_path):
    recording = Recording(realtime_offset_ns=5_000_000, slew_ppm=20)
    simulation = simulate("pipeline", tmp_path / "out", factor=0.5, recording=recording)
    ((first, last),) = duckdb.sql(
        "SELECT min_by(source_timestamp_ns - rmw_ns, rmw_ns), "
        "max_by(source_timestamp_ns - rmw_ns, rmw_ns) "
        f"FROM '{simulation.truth['publication']}'"
    ).fetchall()
    assert first == pytest.approx(5_000_000, abs=1_000)
    assert last - first == pytest.approx(5 * 20_000, abs=1_500)


def test_faults_do_not_change_what_happens(made):
    tables = {"publication", "take", "callback_instance", "undelivered", "executor_state"}
    for name in tables:
        perfect = pq.read_table(made("perfect").truth[name])
        assert pq.read_table(made("loss").truth[name]) == perfect
        assert pq.read_table(made("dual").truth[name]) == perfect


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"lost_event_share": 1.5}, "share"),
        ({"lost_packet_share": -0.1}, "share"),
        ({"pauses": ((2, 1),)}, "pause"),
        ({"start_ns": 5, "pauses": ((1, 2),)}, "follow"),
        ({"snapshots": (3,), "rotations": (4,)}, "snapshots"),
        ({"snapshots": (3,), "kept_packets": 0}, "snapshots"),
        ({"snapshots": (3, 3)}, "follow"),
        ({"filled_share": 2}, "share"),
        ({"pauses": ((2, 4),), "rotations": (2,)}, "follow"),
        ({"pauses": ((2, 4),), "rotations": (4,)}, "follow"),
        ({"pauses": ((2, 4), (4, 5))}, "follow"),
        ({"rotations": (3, 3)}, "follow"),
        ({"rotations": (3,), "missing_chunk": 2}, "no chunk 2"),
        ({"start_ns": -1}, "negative"),
        ({"cut_streams": -1}, "negative"),
        ({"longest_loss": 0}, "at least one"),
        ({"is_dual_session": True}, "dual session"),
        ({"slew_ppm": 5_000}, "ppm"),
    ],
)
def test_refuses_what_cannot_be_recorded(wrong, message):
    with pytest.raises(UsageError, match=message) as caught:
        replace(Recording(), **wrong)
    assert caught.value.hint


def test_half_an_hour_is_cheap_and_drifts_apart(tmp_path):
    simulation = simulate(long_recording(), tmp_path / "out", factor=0.02)
    assert simulation.event_count == pytest.approx(0.02 * 500_000, rel=0.2)
    rows = duckdb.sql(
        "SELECT rmw_ns, source_timestamp_ns - rmw_ns AS distance_ns "
        f"FROM '{simulation.truth['publication']}' WHERE topic_name = '/image' ORDER BY rmw_ns"
    ).fetchall()
    # 36 seconds of 20 ppm are 720 µs; each stamp is made some 2 ms after rmw_publish.
    assert len(rows) == pytest.approx(180, abs=3)
    assert all(1_500_000 < distance < 4_000_000 for _, distance in rows)
    half = len(rows) // 2
    first, second = (sum(d for _, d in part) / half for part in (rows[:half], rows[-half:]))
    assert second - first == pytest.approx(360_000, rel=0.3)


def test_a_timer_ends_packets_that_are_not_empty(tmp_path):
    """And nothing else: as many as there are seconds with an event on the CPU."""
    plain = simulate("quiet", tmp_path / "plain", factor=0.5)
    ended = simulate("quiet", tmp_path / "ended", factor=0.5, recording=Recording(flush_ns=SECOND))

    def packets(simulation):
        files = simulation.directory.glob("**/index/*.idx")
        return sum((file.stat().st_size - 16) // 72 for file in files)

    assert packets(plain) + 4 <= packets(ended) <= packets(plain) * 5
    hosts = [json.loads(one.meta.read_text())["hosts"] for one in (plain, ended)]
    assert hosts[0]["alpha"]["events"] == hosts[1]["alpha"]["events"]
