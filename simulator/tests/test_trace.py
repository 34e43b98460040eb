"""The traces: babeltrace 2 reads them, and they look like what LTTng-UST records."""

from __future__ import annotations

import re
import shutil
import struct
import subprocess
from collections import Counter, defaultdict
from itertools import pairwise

import pytest

from msgflow_sim import simulate
from msgflow_sim.layout import layouts

_PACKET_HEADER = struct.Struct("<I16sIQQQQQQQI")
_INDEX_HEADER = struct.Struct(">IIII")
_INDEX_ENTRY = struct.Struct(">QQQQQQQQQ")

_LETTERS = {
    "ros2:rclcpp_executor_get_next_ready": "g",
    "ros2:rclcpp_executor_wait_for_work": "w",
    "ros2:rclcpp_executor_execute": "x",
    "ros2:rmw_take": "1",
    "failed": "0",
    "ros2:rcl_take": "2",
    "ros2:rclcpp_take": "3",
    "ros2:callback_start": "(",
    "ros2:callback_end": ")",
    "ros2:rclcpp_publish": "a",
    "ros2:rcl_publish": "b",
    "ros2:rmw_publish": "c",
}
_CALLBACK = r"\((abc|bc)*\)"
# What follows "execute": a timer's callback, a take with its callback, a take that failed.
_EXECUTION = rf"x({_CALLBACK}|123{_CALLBACK}|023)"
_SPIN = re.compile(rf"(g{_EXECUTION}|gwg{_EXECUTION}|gwg(?=g)|gwg$|gw$|g$)*")


def test_counts_equal_those_announced(recording):
    counted = defaultdict(Counter)
    for event in recording.events:
        counted[event.host][event.name] += 1
    announced = {host: facts["events"] for host, facts in recording.meta["hosts"].items()}
    assert counted == announced
    assert len(recording.events) == recording.simulation.event_count


def test_babeltrace2_has_nothing_to_complain_about(recording):
    babeltrace2 = shutil.which("babeltrace2")
    if babeltrace2 is None:
        pytest.skip("the babeltrace2 command is not installed")
    done = subprocess.run(
        [babeltrace2, recording.simulation.directory, "-o", "dummy"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_time_passes_on_each_thread_and_cpu(recording):
    threads, cpus = defaultdict(list), defaultdict(list)
    for event in recording.events:
        threads[event.host, event.tid].append(event.ts_ns)
        cpus[event.host, event.cpu].append(event.ts_ns)
    for times in [*threads.values(), *cpus.values()]:
        assert all(before < after for before, after in pairwise(times))
    most = max(host["cpu_count"] for host in recording.meta["hosts"].values())
    assert most == 1 or len(cpus) > len(recording.meta["hosts"])


def test_executors_emit_in_the_order_of_rclcpp(basic):
    recording = basic
    texts = defaultdict(str)
    for event in recording.events:
        if event.tid == event.pid:
            is_failed = event.name == "ros2:rmw_take" and not event.fields["taken"]
            name = "failed" if is_failed else event.name
            texts[event.host, event.pid] += _LETTERS.get(name, "")
    assert len(texts) == len(recording.meta["processes"])
    for text in texts.values():
        spinning = text[text.index("g") :]
        assert len(spinning) > 50
        assert _SPIN.fullmatch(spinning), spinning[:300]


def test_threads_keep_their_names(basic):
    recording = basic
    names = {(e.host, e.pid): e.procname for e in recording.events}
    assert {(e.host, e.pid, e.procname) for e in recording.events} == {
        (*key, name) for key, name in names.items()
    }
    described = {(p["host"], p["pid"]): p["name"][:15] for p in recording.meta["processes"]}
    assert names == described


def test_messages_keep_their_pointer_through_the_layers(recording):
    last = {}
    layers = ["ros2:rclcpp_publish", "ros2:rcl_publish", "ros2:rmw_publish"]
    layers_of_take = ["ros2:rmw_take", "ros2:rcl_take", "ros2:rclcpp_take"]
    pairs = {*pairwise(layers), *pairwise(layers_of_take)}
    seen = Counter()
    for event in recording.events:
        before = last.get((event.host, event.tid))
        if before is not None and (before.name, event.name) in pairs:
            assert before.fields["message"] == event.fields["message"]
            seen[before.name, event.name] += 1
        last[event.host, event.tid] = event
    # Where all is in one process, only /rosout needs the middleware.
    is_alone = recording.meta["scenario"] == "intra_process"
    assert set(seen) == ({("ros2:rcl_publish", "ros2:rmw_publish")} if is_alone else pairs)


def test_index_describes_the_packets(recording):
    checked = 0
    for directory in recording.simulation.trace_directories:
        for stream in sorted(directory.glob("ros2_*")):
            index = (directory / "index" / f"{stream.name}.idx").read_bytes()
            assert _INDEX_HEADER.unpack_from(index) == (0xC1F1DCC1, 1, 1, _INDEX_ENTRY.size)
            assert list(_INDEX_ENTRY.iter_unpack(index[_INDEX_HEADER.size :])) == list(
                _packets(stream.read_bytes())
            )
            checked += 1
    assert checked == sum(host["cpu_count"] for host in recording.meta["hosts"].values())


def _packets(data):
    """Index entries that the packets of a stream file ask for, checked against each other."""
    offset, previous_end, sequence = 0, None, 0
    while offset < len(data):
        magic, _, stream_id, instance, begin, end, content, size, number, discarded, cpu = (
            _PACKET_HEADER.unpack_from(data, offset)
        )
        assert (magic, stream_id, instance, number, discarded) == (0xC1FC1FC1, 0, cpu, sequence, 0)
        assert _PACKET_HEADER.size * 8 <= content <= size
        assert begin < end
        assert previous_end in (None, begin)
        last = offset + size // 8 == len(data)
        assert size == 32 * 1024 * 8 or (last and size % (4096 * 8) == 0)
        assert not any(data[offset + content // 8 : offset + size // 8])
        yield (offset, size, content, begin, end, discarded, stream_id, instance, number)
        offset, previous_end, sequence = offset + size // 8, end, sequence + 1
    assert offset == len(data)


def test_long_silence_does_not_confuse_the_clock(tmp_path, quiet, read):
    # More than 2³² ns pass between events of one CPU: the short header cannot say that.
    simulation = simulate(quiet, tmp_path / "out")
    recording = read(simulation)
    starts = [e.ts_ns for e in recording.events if e.name == "ros2:callback_start"]
    expected = recording.truth("SELECT start_ns FROM callback_instance ORDER BY start_ns")
    assert starts == [start for (start,) in expected]
    timer_starts = recording.truth(
        "SELECT start_ns FROM callback_instance WHERE kind = 'timer' ORDER BY start_ns"
    )
    assert len(timer_starts) >= 3
    assert all(
        9_990_000_000 < after - before < 10_010_000_000
        for (before,), (after,) in pairwise(timer_starts)
    )


def test_layout_equals_that_of_a_recorded_trace(bt2, recorded_jazzy):
    recorded = {}
    for message in bt2.TraceCollectionMessageIterator(str(recorded_jazzy)):
        if type(message).__name__ == "_StreamBeginningMessageConst":
            recorded = {c.name: c for c in message.stream.cls.values()}
            break
    shared = [event for event in layouts()["jazzy"].events if event.name in recorded]
    assert len(shared) >= 30
    for event in shared:
        members = recorded[event.name].payload_field_class
        assert [field.name for field in event.fields] == list(members)
        for field in event.fields:
            length = getattr(members[field.name].field_class, "length", 0)
            assert length == field.length, f"{event.name}.{field.name}"


def test_traces_know_host_and_clock(bt2, recording):
    traces = {}
    for message in bt2.TraceCollectionMessageIterator(str(recording.simulation.directory)):
        if type(message).__name__ == "_StreamBeginningMessageConst":
            stream = message.stream
            traces[stream.trace.uuid] = (stream.trace.environment, stream.cls.default_clock_class)
    # A trace of the kernel is on the clock of its host.
    clocks = {(str(known["hostname"]), clock.uuid) for known, clock in traces.values()}
    assert sorted(hostname for hostname, _ in clocks) == sorted(recording.meta["hosts"])
    assert len({uuid for _, uuid in clocks}) == len(clocks)
    tracers = {"ust": "lttng-ust", "kernel": "lttng-modules"}
    for environment, clock in traces.values():
        assert environment["tracer_name"] == tracers[str(environment["domain"])]
        assert (clock.name, clock.frequency) == ("monotonic", 1_000_000_000)
