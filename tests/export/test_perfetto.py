"""Perfetto traces, decoded again: every packet is read as the Perfetto UI reads it."""

from __future__ import annotations

import shutil
import sys
from collections import Counter, defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.thorough import few

from msgflow import Database, DatabaseError, UsageError
from msgflow.database import open_db
from msgflow.text.installation import install_command

SYSTEMS = ("demo", "services", "nested", "partial_sync", "multi_threaded")
IDENTITIES = (
    "callback_instance_id", "publication_id", "take_id", "request_id", "response_id", "executor_id",
)  # fmt: skip


@dataclass
class Slice:
    track: int
    name: str
    begin: int
    end: int
    notes: dict[str, Any]
    depth: int


@dataclass
class Decoded:
    """What a trace says: slices with names and notes, arrows, tracks, values of counters."""

    tracks: dict[int, Any] = field(default_factory=dict)
    slices: list[Slice] = field(default_factory=list)
    gaps: list[Slice] = field(default_factory=list)
    states: list[Slice] = field(default_factory=list)
    events: list[Slice] = field(default_factory=list)
    arrows: set[tuple[int, int]] = field(default_factory=set)
    values: dict[int, list[tuple[int, float]]] = field(default_factory=lambda: defaultdict(list))

    def place(self, track: int) -> tuple[str, ...]:
        """Return the names of a track and of those that it lies below, the outermost first."""
        described = self.tracks[track]
        above = self.place(described.parent_uuid) if described.parent_uuid else ()
        name = described.name or described.thread.thread_name or described.process.process_name
        return (*above, name)


def with_places(connection: duckdb.DuckDBPyConnection) -> duckdb.DuckDBPyConnection:
    """Let statements read the names of the track of each thread."""
    connection.execute(
        "CREATE TEMP VIEW place AS SELECT thread_id, p.name || ' ' || pid || ' on ' || hostname"
        " AS process, t.name || ' ' || tid AS thread"
        " FROM thread AS t JOIN process AS p USING (process_id) JOIN host USING (host_id)"
    )
    return connection


def decode(path: Path) -> Decoded:
    protos = pytest.importorskip("perfetto.protos.perfetto.trace.perfetto_trace_pb2")
    trace = protos.Trace()
    trace.ParseFromString(path.read_bytes())
    decoded = Decoded()
    names: dict[int, str] = {}
    notes: dict[int, str] = {}
    texts: dict[int, str] = {}
    open_slices: dict[int, list[Slice]] = defaultdict(list)
    begun: dict[int, int] = {}
    ended: dict[int, int] = {}
    categories: dict[int, str] = {}
    for packet in trace.packet:
        for table, entries in (
            (names, packet.interned_data.event_names),
            (notes, packet.interned_data.debug_annotation_names),
            (categories, packet.interned_data.event_categories),
        ):
            table.update({entry.iid: entry.name for entry in entries})
        for entry in packet.interned_data.debug_annotation_string_values:
            texts[entry.iid] = entry.str.decode()
        if packet.HasField("track_descriptor"):
            assert packet.track_descriptor.uuid not in decoded.tracks
            decoded.tracks[packet.track_descriptor.uuid] = packet.track_descriptor
        # What an event refers to, it or an earlier packet brings.
        event = packet.track_event
        assert not event.track_uuid or event.track_uuid in decoded.tracks
        assert not event.name_iid or event.name_iid in names
        assert {note.name_iid for note in event.debug_annotations} <= notes.keys()
    for packet in sorted(trace.packet, key=lambda packet: packet.timestamp):
        if not packet.HasField("track_event"):
            continue
        event = packet.track_event
        if event.type == event.TYPE_COUNTER:
            value = (packet.timestamp, event.double_counter_value)
            decoded.values[event.track_uuid].append(value)
        elif event.type == event.TYPE_SLICE_END:
            open_slices[event.track_uuid].pop().end = packet.timestamp
        else:
            said = {
                notes[note.name_iid]: texts[note.string_value_iid]
                if note.string_value_iid
                else getattr(note, note.WhichOneof("value"))
                for note in event.debug_annotations
            }
            stack = open_slices[event.track_uuid]
            (category,) = (categories[number] for number in event.category_iids)
            one = Slice(
                event.track_uuid, names[event.name_iid], packet.timestamp, packet.timestamp, said,
                len(stack),
            )  # fmt: skip
            for flow in event.flow_ids:
                assert flow not in begun
                begun[flow] = len(decoded.slices)
            for flow in event.terminating_flow_ids:
                assert flow not in ended
                ended[flow] = len(decoded.slices)
            special = {
                "gap": decoded.gaps, "schedule": decoded.states, "user_event": decoded.events,
            }  # fmt: skip
            assert not stack or category not in ("gap", "schedule")
            special.get(category, decoded.slices).append(one)
            if event.type == event.TYPE_SLICE_BEGIN:
                stack.append(one)
    assert not any(open_slices.values())
    assert set(begun) == set(ended)
    decoded.arrows = {(begun[flow], ended[flow]) for flow in begun}
    return decoded


@pytest.fixture(scope="module", params=few(SYSTEMS, "demo"))
def exported(
    request: pytest.FixtureRequest,
    simulated: Callable[..., Path],
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[duckdb.DuckDBPyConnection, Decoded]:
    """A simulated system, its database and its Perfetto trace."""
    pytest.importorskip("perfetto.trace_builder.proto_builder")
    directory = tmp_path_factory.mktemp(request.param)
    path = Path(shutil.copy(simulated(request.param, 0.1), directory / "run.duckdb"))
    if request.param == "demo":
        open_db(path).apply_clocks("messages")
    with duckdb.connect(str(path)) as connection:
        connection.execute("UPDATE store.link_transport SET candidate_count = 2 + take_id % 2")
    with open_db(path) as database:
        written = database.export_perfetto(directory / "run.pftrace")
    decoded = decode(written.path)
    counted = len(decoded.slices), len(decoded.arrows), sum(map(len, decoded.values.values()))
    assert counted == (written.slices, written.arrows, written.values)
    return with_places(duckdb.connect(str(path), read_only=True)), decoded


Exported = tuple[duckdb.DuckDBPyConnection, Decoded]


def identity(one: Slice) -> tuple[str, int]:
    ((kind, number),) = [(kind, one.notes[kind]) for kind in IDENTITIES if kind in one.notes]
    return kind.removesuffix("_id"), number


def test_callbacks_and_publications_are_slices_of_their_threads(exported: Exported) -> None:
    connection, decoded = exported
    found = {
        (
            *identity(one),
            *decoded.place(one.track),
            one.begin,
            one.end,
            one.name,
            one.notes.get("symbol"),
        )
        for one in decoded.slices
        if identity(one)[0] in ("callback_instance", "publication", "take")
    }
    expected = connection.execute(
        "SELECT 'callback_instance', callback_instance_id, process, thread, start_ns,"
        " coalesce(end_ns, start_ns), node || ' ' || label, symbol"
        " FROM callback_instance JOIN callback USING (callback_id)"
        " JOIN callback_label USING (callback_id) JOIN place USING (thread_id)"
        " UNION ALL SELECT 'publication', publication_id, process, thread, start_ns, end_ns,"
        " 'publish ' || coalesce(topic_name, '?'), NULL"
        " FROM publication AS b LEFT JOIN publisher USING (publisher_id)"
        " JOIN place USING (thread_id)"
        " UNION ALL SELECT 'take', take_id, process, thread, taken_ns, taken_ns,"
        " 'take ' || coalesce(topic_name, '?'), NULL"
        " FROM take AS t LEFT JOIN subscription USING (subscription_id)"
        " JOIN place USING (thread_id)"
    ).fetchall()
    assert len(expected) > 50
    assert found == set(expected)


def test_what_has_several_possible_causes_says_so(exported: Exported) -> None:
    connection, decoded = exported
    found = {
        one.notes["take_id"]: one.notes["candidate_count"]
        for one in decoded.slices
        if "candidate_count" in one.notes and "take_id" in one.notes
    }
    links = connection.sql("SELECT take_id, candidate_count FROM link_transport").fetchall()
    assert found == dict(links)


def test_slices_are_nested_as_callbacks_are(exported: Exported) -> None:
    connection, decoded = exported
    depths = {
        identity(one)[1]: one.depth
        for one in decoded.slices
        if "callback_instance_id" in one.notes and one.end > one.begin
    }
    assert depths == dict(
        connection.execute(
            "SELECT callback_instance_id, depth - 1 FROM store.callback_instance"
            " WHERE end_ns > start_ns"
        ).fetchall()
    )


def test_every_link_is_an_arrow(exported: Exported) -> None:
    """Besides, an arrow leads from the sending of each request and response to its taking."""
    connection, decoded = exported
    found: Counter[tuple[Any, ...]] = Counter()
    for begin, end in decoded.arrows:
        found[(*identity(decoded.slices[begin]), *identity(decoded.slices[end]))] += 1
    expected = Counter(
        connection.execute(
            "SELECT from_kind, from_id, to_kind, to_id FROM flow_edge"
            " UNION ALL SELECT 'request', request_id, 'request', request_id FROM request"
            " WHERE sent_ns IS NOT NULL AND taken_ns IS NOT NULL"
            " UNION ALL SELECT 'response', response_id, 'response', response_id FROM response"
            " WHERE sent_ns IS NOT NULL AND taken_ns IS NOT NULL"
        ).fetchall()
    )
    assert found == expected
    assert len(found) > 50


def test_activities_of_executors_have_a_track_each(exported: Exported) -> None:
    connection, decoded = exported
    found = Counter(
        (*decoded.place(one.track), one.name, one.begin, one.end)
        for one in decoded.slices
        if "executor_id" in one.notes
    )
    expected = Counter(
        connection.execute(
            "SELECT process, thread, 'executor', activity, start_ns, coalesce(end_ns, start_ns)"
            " FROM executor_activity JOIN place USING (thread_id)"
            " SEMI JOIN executor_state USING (thread_id)"
        ).fetchall()
    )
    assert found == expected
    names = {name for *_, name, _, _ in found}
    assert names >= {"wait", "select", "take", "callback"}
    # Only executors of several threads block them.
    assert ("blocked" in names) == any(
        "multi" in kind for (kind,) in connection.execute("SELECT kind FROM executor").fetchall()
    )


def test_tracks_belong_to_processes_that_are_told_apart(exported: Exported) -> None:
    connection, decoded = exported
    processes = [one for one in decoded.tracks.values() if one.HasField("process")]
    threads = [one for one in decoded.tracks.values() if one.HasField("thread")]
    assert len({one.process.pid for one in processes}) == len(processes)
    assert len({one.thread.tid for one in threads}) == len(threads)
    pids = {one.uuid: one.process.pid for one in processes}
    assert all(pids[one.parent_uuid] == one.thread.pid for one in threads)
    named = connection.execute(
        "SELECT p.name || ' ' || pid || ' on ' || hostname"
        " FROM process AS p JOIN host USING (host_id) ORDER BY process_id"
    ).fetchall()
    assert [(one.process.process_name,) for one in processes] == named


def test_counters_have_rates_and_queues(exported: Exported) -> None:
    """Each publisher and subscription has a track of its own, in the order of their ids."""
    connection, decoded = exported
    rates: list[list[Any]] = []
    for (publisher,) in connection.execute(
        "SELECT publisher_id FROM publisher ORDER BY 1"
    ).fetchall():
        times = [
            time
            for (time,) in connection.execute(
                "SELECT start_ns FROM publication WHERE publisher_id = ? ORDER BY 1", [publisher]
            ).fetchall()
        ]
        # Each holds until the next message, and none comes after the last.
        rates.append(
            [
                (time, pytest.approx(1e9 / (following - time)))
                for time, following in pairwise(times)
                if following > time
            ]
            + [(time, 0) for time in times[-1:]]
        )
    values = {
        unit: [
            values
            for track, values in sorted(decoded.values.items())
            if decoded.tracks[track].counter.unit_name == unit
        ]
        for unit in ("Hz", "messages")
    }
    assert values["Hz"] == [rate for rate in rates if rate]
    waiting = [value for queue in values["messages"] for _, value in queue]
    assert min(waiting) == 0
    assert max(waiting) >= 1
    taken = (
        "FROM link_transport AS l JOIN publication AS b ON l.publication_id = b.publication_id"
        " JOIN take AS t ON l.take_id = t.take_id WHERE t.taken_ns >= b.end_ns"
    )
    subscriptions = connection.execute(
        f"SELECT DISTINCT subscription_id {taken} AND subscription_id IS NOT NULL ORDER BY 1"
    ).fetchall()
    for (subscription,), queue in zip(subscriptions, values["messages"], strict=True):
        at = queue[len(queue) // 2][0]
        ((there,),) = connection.execute(
            f"SELECT count(*) {taken} AND t.subscription_id = $id"
            " AND b.end_ns <= $at AND t.taken_ns > $at",
            {"id": subscription, "at": at},
        ).fetchall()
        assert [value for time, value in queue if time == at][-1] == there


@pytest.mark.thorough
def test_a_window_has_what_begins_in_it(simulated: Callable[..., Path], tmp_path: Path) -> None:
    pytest.importorskip("perfetto.trace_builder.proto_builder")
    with open_db(simulated("pipeline", 0.1)) as database:
        ((start, middle),) = database.connection.execute(
            "SELECT start_ns, (start_ns + end_ns) // 2 FROM run"
        ).fetchall()
        half = database.export_perfetto(tmp_path / "half.pftrace", end=middle)
        database.export_perfetto(tmp_path / "whole.pftrace")
    decoded, whole = decode(half.path), decode(tmp_path / "whole.pftrace")
    assert len(decoded.slices) == sum(one.begin < middle for one in whole.slices)
    assert all(start <= one.begin < middle for one in decoded.slices)
    assert 0 < len(decoded.arrows) < len(whole.arrows)


@pytest.mark.thorough
def test_gaps_are_slices_of_their_host(simulated: Callable[..., Path], tmp_path: Path) -> None:
    pytest.importorskip("perfetto.trace_builder.proto_builder")
    path = Path(shutil.copy(simulated("pipeline", 0.1), tmp_path / "run.duckdb"))
    with duckdb.connect(str(path)) as connection:
        ((trace, name, begin),) = connection.execute(
            "SELECT trace_id, hostname, r.start_ns FROM trace JOIN host USING (host_id)"
            " CROSS JOIN run AS r ORDER BY trace_id LIMIT 1"
        ).fetchall()
        connection.executemany(
            "INSERT INTO store.gap BY NAME SELECT 1 AS run_id, ? AS trace_id, ? AS cpu,"
            " ? AS kind, ? AS start_ns, ? AS end_ns, ? AS event_count",
            [
                (trace, cpu, kind, begin + start, begin + end, count)
                for cpu, kind, start, end, count in (
                    (0, "loss", 10, 20, 3),
                    # Touches the one before, and the next lies within it.
                    (1, "packets", 20, 50, 4),
                    (2, "loss", 30, 40, None),
                    (None, "pause", 51, 90, None),
                )
            ],
        )
    with open_db(path) as database:
        written = database.export_perfetto(tmp_path / "run.pftrace")
        cut = database.export_perfetto(tmp_path / "cut.pftrace", start=begin + 15, end=begin + 60)
    decoded = decode(written.path)
    track = f"{name}: not recorded"
    first, second = "not recorded: loss, packets", "not recorded: pause"
    assert [
        (*decoded.place(one.track), one.name, one.begin - begin, one.end - begin, one.notes)
        for one in decoded.gaps
    ] == [(track, first, 10, 50, {"lost_events": 7}), (track, second, 51, 90, {})]
    assert written.gaps == 2
    assert [(one.begin - begin, one.end - begin) for one in decode(cut.path).gaps] == [
        (15, 50), (51, 60),
    ]  # fmt: skip


def test_without_the_package_it_is_said(
    small_database: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "perfetto"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "perfetto", None)
    with Database(small_database) as database, pytest.raises(UsageError, match="perfetto") as error:
        database.export_perfetto(tmp_path / "a.pftrace")
    assert error.value.hint == install_command("perfetto")
    assert not (tmp_path / "a.pftrace").exists()


def test_a_trace_is_of_one_run(small_database: Path, tmp_path: Path) -> None:
    with Database(small_database) as database, pytest.raises(UsageError, match="one run"):
        database.export_perfetto(tmp_path / "a.pftrace", run="all")


def test_events_of_the_user_are_instants_on_their_thread(
    simulated: Callable[..., Path], tmp_path: Path
) -> None:
    """With their fields as arguments, each of its own type."""
    pytest.importorskip("perfetto.trace_builder.proto_builder")
    path = Path(shutil.copy(simulated("pipeline", 0.1), tmp_path / "run.duckdb"))
    fields = '{"big":18446744073709551615,"low":-5,"yes":true,"x":0.5,"text":"a","no":null,"l":[1]}'
    with duckdb.connect(str(path)) as connection:
        ((begin, tid),) = connection.execute(
            "SELECT start_ns, tid FROM run JOIN thread USING (run_id) WHERE thread_id = 2"
        ).fetchall()
        connection.executemany(
            "INSERT INTO store.user_event SELECT ?, 1, trace_id, process_id, thread_id, 0, ?,"
            " 'my_pkg:done', NULL, ?, false FROM store.trace JOIN store.thread"
            " USING (run_id) WHERE thread_id = 2 AND trace_id = 1",
            [(1, begin + 5, fields), (2, begin + 900, "{}")],
        )
    with open_db(path) as database:
        written = database.export_perfetto(tmp_path / "run.pftrace", end=begin + 900)
    decoded = decode(written.path)
    (event,) = decoded.events
    assert decoded.tracks[event.track].thread.tid == tid
    assert (event.begin, event.end, event.name) == (begin + 5, begin + 5, "my_pkg:done")
    assert event.notes == {
        "user_event_id": 1, "big": 2**64 - 1, "low": -5, "yes": True, "x": 0.5, "text": "a",
        "no": "null", "l": "[1]",
    }  # fmt: skip
    assert written.events == 1
    # A database that no ingest has made may have any text there.
    for forged in ("no JSON", "[1]", "[" * 100_000):
        with duckdb.connect(str(path)) as connection:
            connection.execute("UPDATE store.user_event SET fields = $text", {"text": forged})
        with open_db(path) as database, pytest.raises(DatabaseError, match="that no recording has"):
            database.export_perfetto(tmp_path / "run.pftrace", end=begin + 900)


def test_states_of_threads_and_cores_have_tracks(
    simulated: Callable[..., Path], tmp_path: Path
) -> None:
    pytest.importorskip("perfetto.trace_builder.proto_builder")
    path = Path(shutil.copy(simulated("pipeline", 0.1), tmp_path / "run.duckdb"))
    with duckdb.connect(str(path)) as connection:
        ((thread, host, name, begin),) = connection.execute(
            "SELECT thread_id, host_id, hostname, r.start_ns FROM thread JOIN process USING "
            "(process_id) JOIN host USING (host_id) CROSS JOIN run AS r ORDER BY thread_id LIMIT 1"
        ).fetchall()
        connection.execute(
            "INSERT INTO store.other_thread BY NAME SELECT 1 AS other_thread_id, 1 AS run_id, "
            "? AS host_id, 911 AS tid, 'stress' AS name",
            [host],
        )
        connection.executemany(
            "INSERT INTO store.thread_state BY NAME SELECT 1 AS run_id, ? AS thread_id, "
            "? AS start_ns, ? AS end_ns, ? AS state, 3 AS cpu, 120 AS priority, "
            "? AS preempted_by_other_thread_id, ? AS waker_kind, false AS is_loss_affected",
            [
                (thread, begin + start, begin + end, state, other, kind)
                for start, end, state, other, kind in (
                    (10, 20, "running", None, None),
                    (20, 50, "preempted", 1, None),
                    (50, 60, "running", None, None),
                    (60, 90, "sleeping", None, "timer"),
                )
            ],
        )
    with open_db(path) as database:
        written = database.export_perfetto(tmp_path / "run.pftrace")
    decoded = decode(written.path)
    assert written.states == 6
    by_track: dict[str, list[tuple[str, int, int]]] = defaultdict(list)
    for one in decoded.states:
        *above, track = decoded.place(one.track)
        assert bool(above) == (track == "kernel")
        by_track[track].append((one.name, one.begin - begin, one.end - begin))
    assert by_track.keys() == {"kernel", f"{name}: CPU 3"}
    assert by_track["kernel"] == [
        ("running", 10, 20), ("preempted by stress 911", 20, 50), ("running", 50, 60),
        ("sleeping", 60, 90),
    ]  # fmt: skip
    cores = by_track[f"{name}: CPU 3"]
    assert [(start, end) for _, start, end in cores] == [(10, 20), (50, 60)]
    (asleep,) = (one for one in decoded.states if one.name == "sleeping")
    assert asleep.notes == {"cpu": 3, "priority": 120, "woken_by": "timer"}


def test_samples_have_their_stacks(simulated: Callable[..., Path], tmp_path: Path) -> None:
    """Each function of a file is described once, the outermost call first."""
    protos = pytest.importorskip("perfetto.protos.perfetto.trace.perfetto_trace_pb2")
    path = Path(shutil.copy(simulated("pipeline", 0.1), tmp_path / "run.duckdb"))
    with duckdb.connect(str(path)) as connection:
        ((begin, tid),) = connection.execute(
            "SELECT start_ns, tid FROM run JOIN thread USING (run_id) WHERE thread_id = 2"
        ).fetchall()
        connection.execute(
            "INSERT INTO store.stack_frame VALUES (1, 1, 'main', '/bin/robot'),"
            " (2, 1, 'work', '/lib/a.so'), (3, 1, 'main', '/lib/a.so');"
            "INSERT INTO store.stack VALUES (7, 1, 2, 2), (8, 1, 3, 2);"
            "INSERT INTO store.stack_call VALUES (1, 7, 2, 2), (1, 7, 1, 1), (1, 8, 1, 1),"
            " (1, 8, 2, 3);"
        )
        connection.executemany(
            "INSERT INTO store.stack_sample BY NAME SELECT 1 AS run_id, process_id, ? AS thread_id,"
            " tid, ? AS at_ns, ? AS cpu, ? AS stack_id FROM store.thread WHERE thread_id = 2",
            [(2, begin + 5, 3, 7), (2, begin + 9, None, 8), (None, begin + 7, 0, 7)],
        )
    with open_db(path) as database:
        written = database.export_perfetto(tmp_path / "run.pftrace")
    trace = protos.Trace()
    trace.ParseFromString(written.path.read_bytes())
    tables: dict[str, dict[int, Any]] = defaultdict(dict)
    found = []
    for packet in trace.packet:
        for table, entries in packet.interned_data.ListFields():
            assert not tables[table.name].keys() & {entry.iid for entry in entries}
            tables[table.name].update({entry.iid: entry for entry in entries})
        if packet.HasField("perf_sample"):
            one = packet.perf_sample
            frames = [
                tables["frames"][number]
                for number in tables["callstacks"][one.callstack_iid].frame_ids
            ]
            stack = [
                (
                    tables["function_names"][frame.function_name_id].str.decode(),
                    *(
                        tables["mapping_paths"][number].str.decode()
                        for number in tables["mappings"][frame.mapping_id].path_string_ids
                    ),
                )
                for frame in frames
            ]
            found.append((packet.timestamp - begin, one.tid, one.cpu, stack))
    assert found == [
        (5, tid, 3, [("main", "/bin/robot"), ("work", "/lib/a.so")]),
        (9, tid, 0, [("main", "/bin/robot"), ("main", "/lib/a.so")]),
    ]
    assert written.samples == 2
    assert (len(tables["function_names"]), len(tables["mapping_paths"])) == (2, 2)
