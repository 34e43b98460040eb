"""End-to-end latency of hand-made systems, every row of it expected."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import duckdb
import pyarrow.compute as pc
import pytest
from support.analysis import Analysis
from support.fates import FATES
from support.golden import SYSTEMS, fill
from support.ros_system import RosSystem
from support.staged_events import Thread

from msgflow.database import Database
from msgflow.db.derivation import derive
from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query

TALKER, RELAY, SINK, LOGGER = (Thread(pid) for pid in (100, 200, 300, 400))
EVERYTHING = "-9223372036854775808, 9223372036854775807"


@dataclass
class Chain:
    """/talker publishes on /a, /relay takes that and publishes on /b, /sink takes that.

    /logger hears what /talker logs, which is no part of any path.

    Attributes:
        times: when each thing happened, by its name; stamps name the messages.
    """

    system: RosSystem = field(default_factory=RosSystem)
    times: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.system.node(TALKER, 0x1, "talker")
        self.system.publisher(TALKER, 0x10, "/a")
        self.system.publisher(TALKER, 0x11, "/rosout")
        self.system.timer(TALKER, 0x20, 0xC0)
        self.system.node(RELAY, 0x1, "relay")
        self.system.subscription(RELAY, 0x30, "/a", callback=0xC1)
        self.system.publisher(RELAY, 0x10, "/b")
        self.system.node(SINK, 0x1, "sink")
        self.system.subscription(SINK, 0x30, "/b", callback=0xC2)
        self.system.node(LOGGER, 0x1, "logger")
        self.system.subscription(LOGGER, 0x30, "/rosout", callback=0xC3)

    def tick(self, root: str, *stamps: int) -> None:
        """The timer's callback publishes messages, and logs."""
        self.times[f"{root} start"] = self.system.start(TALKER, 0xC0)
        for stamp in stamps:
            self.times[f"{stamp} published"] = self.system.publish(TALKER, 0x10, stamp)
        self.system.publish(TALKER, 0x11, 9_000_000 + stamps[0])
        self.system.end(TALKER, 0xC0)
        self.hear(LOGGER, 9_000_000 + stamps[0], callback=0xC3)

    def hear(
        self,
        thread: Thread,
        stamp: int,
        *outputs: int,
        callback: int,
        ends: bool = True,
    ) -> None:
        """A message is taken, and led to others."""
        self.times[f"{stamp} taken"] = self.system.take(thread, 0x30, stamp)
        self.times[f"{stamp} callback"] = self.system.start(thread, callback)
        for output in outputs:
            self.times[f"{output} published"] = self.system.publish(thread, 0x10, output)
        if ends:
            self.times[f"{stamp} end"] = self.system.end(thread, callback)
        self.system.ready(thread)

    def pass_on(self, stamp: int, *outputs: int) -> None:
        self.hear(RELAY, stamp, *outputs, callback=0xC1)

    def arrive(self, stamp: int, *, ends: bool = True) -> None:
        self.hear(SINK, stamp, callback=0xC2, ends=ends)


@pytest.fixture(scope="module")
def chain() -> Chain:
    """Ten roots, A to J; messages 1.. are on /a, 11.. on /b."""
    made = Chain()
    made.tick("A", 1)  # before anybody listens
    made.tick("B", 2)
    made.pass_on(2, 12)
    made.arrive(12)
    made.tick("C", 3)
    made.pass_on(3, 13, 113)  # two messages: the root arrives twice
    made.arrive(13)
    made.arrive(113)
    made.tick("D", 4)  # never taken
    made.tick("E", 5)
    made.pass_on(5)  # nothing published
    made.tick("F", 6)
    made.pass_on(6, 16)  # never taken at the sink
    made.tick("G", 7)
    made.pass_on(7, 17)
    made.arrive(17, ends=False)  # the sink's callback never ends
    made.tick("H", 8, 108)  # two messages of one root, the later arrives first
    made.pass_on(108, 118)
    made.pass_on(8, 18)
    made.arrive(118)
    made.arrive(18)
    made.tick("I", 9)
    made.pass_on(9, 19)  # the trace ends
    made.tick("J", 10)
    return made


@pytest.fixture(scope="module")
def built(
    chain: Chain, empty_database: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Analysis]:
    analysis = Analysis(empty_database, tmp_path_factory.mktemp("chain"))
    yield analysis.build(chain.system)
    analysis.close()


def flows(
    analysis: Analysis,
    columns: str,
    *,
    start: str | None = None,
    end: str | None = None,
    from_event: str = "callback_start",
    to_event: str = "callback_end",
    window: str = EVERYTHING,
) -> list[tuple[Any, ...]]:
    return analysis.connection.execute(
        f"SELECT {columns} FROM end_to_end([1], $from, $to, $from_event, $to_event, {window}) "
        "ORDER BY root_ns, sink_ns",
        {"from": start, "to": end, "from_event": from_event, "to_event": to_event},
    ).fetchall()


def test_what_became_of_every_root(built: Analysis, chain: Chain) -> None:
    times = chain.times
    rows = flows(built, "root_kind, root_ns, sink_ns, latency_ns, status, reason")
    expected: list[tuple[Any, ...]] = []
    for root, sink in (("B", "12"), ("C", "13"), ("C", "113"), ("H", "118"), ("H", "18")):
        begin, end = times[f"{root} start"], times[f"{sink} end"]
        expected.append(("callback_instance", begin, end, end - begin, "reached", None))
    for root, status, reason in (
        ("A", "not_connected", "before_discovery"),
        ("D", "lost", "lost_in_transport"),
        ("E", "no_output", "no_output"),
        ("F", "lost", "lost_in_transport"),
        ("G", "unknown", "callback_not_finished"),
        ("I", "cut_by_recording", "pending_at_end"),
        ("J", "cut_by_recording", "pending_at_end"),
    ):
        begin = times[f"{root} start"]
        expected.append(("callback_instance", begin, None, None, status, reason))
    assert sorted(rows, key=str) == sorted(expected, key=str)


def test_first_last_and_newest(built: Analysis, chain: Chain) -> None:
    """An arrival reflects one root here; a root may arrive several times."""
    rows = flows(built, "root_ns, sink_ns, is_first, is_last, is_newest")
    reached = [row for row in rows if row[1] is not None]
    at = chain.times
    assert reached == [
        (at["B start"], at["12 end"], True, True, True),
        (at["C start"], at["13 end"], True, False, True),
        (at["C start"], at["113 end"], False, True, True),
        (at["H start"], at["118 end"], True, False, True),
        (at["H start"], at["18 end"], False, True, True),
    ]


@pytest.mark.parametrize(
    ("from_event", "to_event", "begin", "end"),
    [
        ("callback_start", "take", "start", "taken"),
        ("callback_start", "callback_start", "start", "callback"),
        ("callback_start", "callback_end", "start", "end"),
        ("publish", "take", "published", "taken"),
        ("publish", "callback_start", "published", "callback"),
        ("publish", "callback_end", "published", "end"),
    ],
)
def test_the_clock_starts_and_stops_at_any_event(
    built: Analysis, chain: Chain, from_event: str, to_event: str, begin: str, end: str
) -> None:
    at = chain.times
    names = [("B", 2, 12), ("C", 3, 13), ("C", 3, 113), ("G", 7, 17), ("H", 108, 118), ("H", 8, 18)]
    expected = []
    for root, message, sink in names:
        if f"{sink} {end}" not in at:
            continue
        started = at[f"{message} published" if begin == "published" else f"{root} start"]
        stopped = at[f"{sink} {end}"]
        expected.append((started, stopped, stopped - started))
    rows = flows(built, "root_ns, sink_ns, latency_ns", from_event=from_event, to_event=to_event)
    assert sorted(row for row in rows if row[1] is not None) == sorted(expected)
    kinds = {kind for (kind,) in flows(built, "root_kind", from_event=from_event)}
    assert kinds == {"publication" if begin == "published" else "callback_instance"}


@pytest.mark.parametrize(
    ("start", "end", "topics"),
    [
        (None, None, [["/a", "/b"]]),
        ("/a", "/b", [["/a", "/b"]]),
        (None, "/a", [["/a"]]),
        ("/b", None, [["/b"]]),
        ("/b", "/a", []),
        ("/nowhere", None, []),
        ("/rosout", None, []),
    ],
)
def test_ends_may_be_chosen(
    built: Analysis, start: str | None, end: str | None, topics: list[list[str]]
) -> None:
    assert built.connection.execute(
        "SELECT topics FROM flow_path([1], ?, ?) WHERE is_path", [start, end]
    ).fetchall() == [(chain,) for chain in topics]


def test_from_the_middle_the_publication_is_the_root(built: Analysis, chain: Chain) -> None:
    at = chain.times
    rows = flows(built, "root_kind, root_ns, sink_ns, status", start="/b")
    arrived = [(n, at[f"{n} published"], at.get(f"{n} end")) for n in (12, 13, 113, 118, 18)]
    expected: list[tuple[Any, ...]] = [
        ("publication", begin, end, "reached") for _, begin, end in arrived
    ]
    expected += [
        ("publication", at["16 published"], None, "lost"),
        ("publication", at["17 published"], None, "unknown"),
        ("publication", at["19 published"], None, "cut_by_recording"),
    ]
    assert sorted(rows, key=str) == sorted(expected, key=str)


def test_to_the_middle_the_relay_is_the_sink(built: Analysis, chain: Chain) -> None:
    at = chain.times
    rows = flows(built, "root_ns, sink_ns, status", end="/a")
    heard = [("B", 2), ("C", 3), ("E", 5), ("F", 6), ("G", 7), ("H", 108), ("H", 8), ("I", 9)]
    expected: list[tuple[Any, ...]] = [
        (at[f"{root} start"], at[f"{message} end"], "reached") for root, message in heard
    ]
    expected += [
        (at["A start"], None, "not_connected"),
        (at["D start"], None, "lost"),
        (at["J start"], None, "cut_by_recording"),
    ]
    assert sorted(rows, key=str) == sorted(expected, key=str)


def test_the_time_window_is_that_of_the_roots(built: Analysis, chain: Chain) -> None:
    """Its end is exclusive; what comes later still arrives."""
    at = chain.times
    window = f"{at['C start']}, {at['F start']}"
    rows = flows(built, "root_ns, sink_ns, status", window=window)
    assert rows == [
        (at["C start"], at["13 end"], "reached"),
        (at["C start"], at["113 end"], "reached"),
        (at["D start"], None, "lost"),
        (at["E start"], None, "no_output"),
    ]


@pytest.mark.parametrize(
    ("case", "sinks"),
    [
        ("first", [("B", 12), ("C", 13), ("H", 118)]),
        ("last", [("B", 12), ("C", 113), ("H", 18)]),
        ("newest", [("B", 12), ("C", 13), ("C", 113), ("H", 118), ("H", 18)]),
        ("every_pair", [("B", 12), ("C", 13), ("C", 113), ("H", 118), ("H", 18)]),
    ],
)
def test_the_query(built: Analysis, chain: Chain, case: str, sinks: list[tuple[str, int]]) -> None:
    latencies = sorted(
        chain.times[f"{sink} end"] - chain.times[f"{root} start"] for root, sink in sinks
    )
    result = run_query(built.connection, load_query("e2e-latency"), {"case": case})
    (row,) = result.to_arrow().to_pylist()
    assert row["path"] == "/talker → /a → /relay → /b → /sink"
    counts = {name: row[name] for name in ("roots", *FATES)}
    assert {name: number for name, number in counts.items() if number} == {
        "roots": 10,
        "reached": 3,
        "lost": 2,
        "no_output": 1,
        "not_connected": 1,
        "cut_by_recording": 2,
        "unknown": 1,
    }
    assert row["pairs"] == len(latencies)
    assert (row["min_ns"], row["max_ns"]) == (latencies[0], latencies[-1])
    assert row["median_ns"] == latencies[(len(latencies) - 1) // 2]
    assert dict(row["reasons"]) == {
        "lost_in_transport": 2,
        "pending_at_end": 2,
        "before_discovery": 1,
        "callback_not_finished": 1,
        "no_output": 1,
    }


def graph(system: RosSystem, *edges: tuple[str | None, int, str], rounds: int = 1) -> None:
    """Nodes in processes of their own that hear one topic (or a timer) and publish on another.

    `rounds` messages start at every timer; the first reader of a topic comes first.
    """
    stamps = iter(range(1, 10_000))
    for _, pid, topic in edges:
        thread = Thread(pid)
        system.node(thread, 0x1, f"n{pid}")
        if topic:
            system.publisher(thread, 0x10, topic)
    for heard, pid, _ in edges:
        if heard is None:
            system.timer(Thread(pid), 0x20, 0xC0)
        else:
            system.subscription(Thread(pid), 0x30, heard, callback=0xC1)

    def send(pid: int, topic: str, hops: int) -> None:
        stamp = next(stamps)
        system.publish(Thread(pid), 0x10, stamp)
        waiting.extend((stamp, reader, hops) for reader in edges if reader[0] == topic)

    waiting: list[tuple[int, tuple[str | None, int, str], int]] = []
    for _ in range(rounds):
        for heard, pid, topic in edges:
            if heard is None:
                system.start(Thread(pid), 0xC0)
                send(pid, topic, 0)
                system.end(Thread(pid), 0xC0)
        while waiting:
            stamp, (_, pid, topic), hops = waiting.pop(0)
            system.take(Thread(pid), 0x30, stamp)
            system.start(Thread(pid), 0xC1)
            if topic and hops < 6:
                send(pid, topic, hops + 1)
            system.end(Thread(pid), 0xC1)


def paths(analysis: Analysis, limits: str = "") -> list[tuple[str, bool]]:
    return [
        (path.replace(" → ", " "), is_cut)
        for path, is_cut in analysis.rows(
            f"SELECT path, is_cut FROM flow_path([1], NULL, NULL{limits}) WHERE is_path ORDER BY 1"
        )
    ]


@pytest.mark.thorough
def test_a_loop_visits_no_subscription_twice(analysis: Analysis) -> None:
    """Ping and pong for ever: the path ends where it would come back."""
    system = RosSystem()
    graph(system, (None, 100, "/ping"), ("/ping", 200, "/pong"), ("/pong", 300, "/ping"))
    analysis.build(system)
    assert paths(analysis) == [("/n100 /ping /n200 /pong /n300", False)]
    assert analysis.rows(
        f"SELECT status, count(*) FROM end_to_end([1], NULL, NULL, 'callback_start', "
        f"'callback_end', {EVERYTHING}) GROUP BY ALL"
    ) == [("reached", 1)]


def test_fan_in_and_fan_out(analysis: Analysis) -> None:
    """A path for each way from a source to a sink."""
    system = RosSystem()
    graph(
        system,
        (None, 100, "/in"),
        (None, 110, "/in"),
        ("/in", 200, "/out"),
        ("/out", 300, ""),
        ("/out", 310, ""),
        rounds=2,
    )
    analysis.build(system)
    assert paths(analysis) == [
        (f"/n{source} /in /n200 /out /n{sink}", False)
        for source in (100, 110)
        for sink in (300, 310)
    ]
    assert analysis.rows(
        "SELECT path_id, count(*), count(DISTINCT root_id), count(DISTINCT take_id) "
        f"FROM end_to_end([1], NULL, NULL, 'callback_start', 'callback_end', {EVERYTHING}) "
        "WHERE status = 'reached' GROUP BY ALL ORDER BY ALL"
    ) == [
        (path_id, 2, 2, 2)
        for path_id in analysis.column(
            "SELECT path_id FROM flow_path([1], NULL, NULL) WHERE is_path ORDER BY 1"
        )
    ]


@pytest.mark.thorough
def test_limits_cut_and_say_so(analysis: Analysis) -> None:
    system = RosSystem()
    graph(
        system,
        (None, 100, "/a"),
        ("/a", 200, "/b"),
        ("/a", 210, ""),
        ("/b", 300, "/c"),
        ("/b", 310, "/c"),
        ("/c", 400, ""),
    )
    analysis.build(system)
    whole = [
        ("/n100 /a /n200 /b /n300 /c /n400", False),
        ("/n100 /a /n200 /b /n310 /c /n400", False),
        ("/n100 /a /n210", False),
    ]
    assert paths(analysis) == whole
    assert paths(analysis, ", max_depth := 3, max_paths := 3") == whole
    assert paths(analysis, ", max_depth := 2") == [
        ("/n100 /a /n200 /b /n300", True),
        ("/n100 /a /n200 /b /n310", True),
        ("/n100 /a /n210", False),
    ]
    crowded = paths(analysis, ", max_paths := 1")
    assert len(crowded) == 1
    assert crowded[0][1]


@pytest.mark.thorough
def test_roots_without_a_callback_are_publications(analysis: Analysis) -> None:
    """A main loop that publishes; a publication inside a service's callback begins with that."""
    chain = Chain()
    begun = chain.system.publish(TALKER, 0x10, 1)
    chain.system.ready(TALKER)
    chain.pass_on(1, 11)
    chain.arrive(11)
    chain.tick("A", 2)
    chain.pass_on(2, 12)
    chain.arrive(12)
    analysis.build(chain.system)
    assert flows(analysis, "root_kind, root_ns, sink_ns") == [
        ("publication", begun, chain.times["11 end"]),
        ("callback_instance", chain.times["A start"], chain.times["12 end"]),
    ]


@pytest.mark.thorough
def test_the_flow_at_a_quantile(fresh_database: Path) -> None:
    with duckdb.connect(str(fresh_database)) as connection:
        fill(connection)
        connection.execute((SYSTEMS / "many_messages.sql").read_text())
        derive(connection, 1)
    with Database(fresh_database) as database:
        (expected,) = (
            database.sql(
                "SELECT quantile_disc(latency_ns, [0.5, 0.9, 0.95, 0.99, 1]) AS quantiles "
                "FROM end_to_end([1], to_topic := '/b')"
            )
            .to_arrow()
            .to_pylist()
        )
        found = [
            database.query("critical-path", quantile=at, by="part", to="/b").to_arrow()
            for at in ("median", "p90", "p95", "p99", "max")
        ]
    latencies = [pc.max(table["latency_ns"]).as_py() for table in found]
    assert latencies == expected["quantiles"]
    assert latencies == [pc.sum(table["duration_ns"]).as_py() for table in found]
    assert len(set(latencies)) == 5
