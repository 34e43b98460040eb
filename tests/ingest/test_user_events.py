"""Events of the user's own tracepoints: which are loaded, and their fields as JSON."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any
from uuid import UUID

import duckdb
import pytest
from support.ctf_writer import Event, Packet, TraceContent, write_trace
from support.ingested import rows
from support.thorough import few

from msgflow import open_db
from msgflow.ingest import ingest
from msgflow.trace import open as open_traces
from msgflow_sim import simulate

Make = Callable[..., Path]
# What makes it a trace of ROS 2.
ROS = {"ros2:rcl_init": {"context_handle": "u64", "version": "str"}}
FIELDS = {
    **ROS,
    "ros2:callback_start": {"callback": "u64", "is_intra_process": "i32"},
    "ros2:callback_end": {"callback": "u64"},
    "my_pkg:done": {"x": "i32"},
    "my_pkg:started": {},
    "other:thing": {"x": "i32"},
}
EVENTS = [
    ("ros2:rcl_init", (1, b"8.2.3")),
    ("my_pkg:started", ()),
    ("ros2:callback_start", (0xC1, 0)),
    ("my_pkg:done", (1,)),
    ("ros2:callback_end", (0xC1,)),
    ("my_pkg:done", (2,)),
    ("other:thing", (3,)),
]
READERS = ["msgflow", "bt2"]
LOADED = (
    "SELECT name, fields, callback_instance_id IS NOT NULL FROM user_event ORDER BY user_event_id"
)


def findings(report: Any, name: str) -> list[tuple[str, int, str]]:
    return [(f.severity, f.count, f.detail) for f in report.findings if f.name == name]


def fields_of(database: Path) -> list[dict[str, Any]]:
    found = rows(database, "SELECT fields FROM user_event ORDER BY user_event_id")
    return [json.loads(text) for (text,) in found]


@pytest.mark.parametrize("reader", few(READERS, "msgflow"))
def test_events_that_match_a_pattern_are_loaded(
    make_trace: Make, new_database: Path, reader: str
) -> None:
    trace = make_trace(FIELDS, EVENTS)
    report = ingest([trace], new_database, events=["my_pkg:*"], reader=reader)
    assert rows(new_database, LOADED) == [
        ("my_pkg:started", "{}", False),
        ("my_pkg:done", '{"x":1}', True),
        ("my_pkg:done", '{"x":2}', False),
    ]
    (unknown,) = findings(report, "unknown_event")
    assert unknown[1:] == (
        1,
        "events that are not in the catalogue and were not loaded: other:thing (1)",
    )
    assert findings(report, "user_event_not_loaded") == []
    with open_db(new_database) as opened:
        assert opened.check() == []


@pytest.mark.thorough
def test_none_is_loaded_unless_asked_for(make_trace: Make, new_database: Path) -> None:
    report = ingest([make_trace(FIELDS, EVENTS)], new_database)
    assert rows(new_database, LOADED) == []
    ((_, count, _),) = findings(report, "unknown_event")
    assert count == 4


def test_patterns_that_load_nothing_are_told(make_trace: Make, new_database: Path) -> None:
    """With what the trace has. Events that are read in any case are not missing."""
    report = ingest(
        [make_trace(FIELDS, EVENTS)],
        new_database,
        events=["my_pgk:*", "ros2:*", "*:done", "my_pgk:*"],
    )
    assert [name for name, *_ in rows(new_database, LOADED)] == ["my_pkg:done", "my_pkg:done"]
    assert findings(report, "user_event_not_loaded") == [
        (
            "warning",
            1,
            "patterns that load no event: my_pgk:*; the traces have my_pkg:started (1),"
            " other:thing (1)",
        )
    ]


@pytest.mark.thorough
def test_all_that_msgflow_does_not_read_is_loaded_by_a_star(
    make_trace: Make, new_database: Path
) -> None:
    """And what msgflow reads is not read twice."""
    report = ingest([make_trace(FIELDS, EVENTS)], new_database, events=["*"])
    assert [name for name, *_ in rows(new_database, LOADED)] == [
        "my_pkg:started",
        "my_pkg:done",
        "my_pkg:done",
        "other:thing",
    ]
    assert findings(report, "unknown_event") == []
    assert findings(report, "user_event_not_loaded") == []
    assert rows(new_database, "SELECT count(*) FROM callback_instance") == [(1,)]


@pytest.mark.thorough
def test_nothing_else_to_load_is_told(make_trace: Make, new_database: Path) -> None:
    report = ingest([make_trace(ROS, EVENTS[:1])], new_database, events=["my_pkg:*"])
    ((_, _, detail),) = findings(report, "user_event_not_loaded")
    assert detail.endswith("the traces have no others to load")


@pytest.mark.thorough
def test_what_is_ignored_is_not_loaded(make_trace: Make, new_database: Path) -> None:
    report = ingest(
        [make_trace(FIELDS, EVENTS)], new_database, events=["my_pkg:*"], ignore=["*:started"]
    )
    assert {name for name, *_ in rows(new_database, LOADED)} == {"my_pkg:done"}
    assert findings(report, "user_event_not_loaded") == []


@pytest.mark.thorough
def test_the_ingest_names_a_pattern_whose_events_are_ignored(
    make_trace: Make, new_database: Path
) -> None:
    report = ingest(
        [make_trace(FIELDS, EVENTS)], new_database, events=["my_pkg:*"], ignore=["my_pkg:*"]
    )
    assert rows(new_database, LOADED) == []
    ((_, count, detail),) = findings(report, "user_event_not_loaded")
    assert count == 1
    assert detail == (
        "patterns that load no event: my_pkg:* (left out on request); the traces have"
        " other:thing (1)"
    )


def test_events_of_the_kernel_are_of_no_thread(make_trace: Make, new_database: Path) -> None:
    """They have no process either, in which a row could be."""
    kernel = make_trace(
        {"block_rq": {"x": "i32"}},
        [("block_rq", (1,))],
        name="kernel",
        contexts={},
        environment={"hostname": "robot", "domain": "kernel", "tracer_name": "lttng-modules"},
        trace_uuid=UUID(int=7),
    )
    report = ingest([make_trace(FIELDS, EVENTS), kernel], new_database, events=["block*", "my*"])
    assert {name for name, *_ in rows(new_database, LOADED)} == {"my_pkg:started", "my_pkg:done"}
    ((_, count, detail),) = findings(report, "user_event_not_loaded")
    assert count == 1
    assert detail.startswith("patterns that load no event: block* (of no thread); the traces have")


MANY_TYPES = {
    **{f"u{bits}": f"u{bits}" for bits in (8, 16, 32, 64)},
    **{f"i{bits}": f"i{bits}" for bits in (8, 16, 32, 64)},
    "address": "x64",
    "single": "f32",
    "double": "f64",
    "text": "str",
    "letters": "text[8]",
    "fixed": "i16[3]",
    "any": "u64[]",
    "bytes": "u8[]",
    "ratios": "f64[2]",
    # Names that msgflow's own columns have, and two that differ in case alone.
    "event_id": "i32",
    "ts_ns": "i32",
    "name": "str",
    "Name": "str",
    "payload_0": "i8",
}
LOW = {f"i{bits}": -(1 << (bits - 1)) for bits in (8, 16, 32, 64)}
HIGH = {f"u{bits}": (1 << bits) - 1 for bits in (8, 16, 32, 64)}


@pytest.mark.parametrize("reader", few(READERS, "msgflow"))
def test_every_type_of_field_becomes_json(tmp_path: Path, reader: str) -> None:
    """Integers to the last digit; bytes that are no UTF-8 get replacement characters."""
    values: dict[str, Any] = {
        **LOW,
        **HIGH,
        "address": 0xFFFF_FFFF_FFFF_FFFF,
        "single": 0.5,
        "double": 1e-310,
        "text": b'\xff"\\\n\xc3\xa4',
        "letters": b"abc",
        "fixed": (-1, 0, 1),
        "any": (1 << 63, 0),
        "bytes": (0, 255),
        "ratios": (0.25, math.nan),
        "event_id": -7,
        "ts_ns": 8,
        "name": b"",
        "Name": b"N",
        "payload_0": 3,
    }
    odd = {**values, "double": math.inf, "single": -math.inf, "any": (), "bytes": ()}
    made = [
        Event(1_000 + number, "my_pkg:all", [given[name] for name in MANY_TYPES])
        for number, given in enumerate((values, odd))
    ]
    made.insert(0, Event(900, "ros2:rcl_init", (1, b"8.2.3")))
    trace = write_trace(
        tmp_path / "trace",
        TraceContent({**ROS, "my_pkg:all": MANY_TYPES}, {0: [Packet(made, begin=900)]}),
    )
    ingest([trace], tmp_path / "run.duckdb", events=["my_pkg:*"], reader=reader)
    first, second = fields_of(tmp_path / "run.duckdb")
    expected = {
        **{name: values[name] for name in MANY_TYPES},
        "text": '\N{REPLACEMENT CHARACTER}"\\\nä',
        "letters": "abc",
        "fixed": [-1, 0, 1],
        "any": [1 << 63, 0],
        "bytes": [0, 255],
        "ratios": [0.25, None],
        "name": "",
        "Name": "N",
    }
    lengths = {name for name in first if name.endswith("_length")}
    assert {name: value for name, value in first.items() if name not in lengths} == expected
    assert second | {"text": None, "letters": None} == first | {
        "double": None,
        "single": None,
        "any": [],
        "bytes": [],
        "text": None,
        "letters": None,
        **dict.fromkeys(lengths, 0),
    }


LABELLED = {
    "state": """u8{IDLE, "it's busy" = 5 ... 7, DONE = 7 ... 8, DONE = 7, LAST = 255}""",
    "side": "i8{LEFT = -128 ... -1, RIGHT = 1 ... 127}",
    "most": "u64{ALL = 18446744073709551615}",
    "each": "u8{A, B}[2]",
}


@pytest.mark.thorough
@pytest.mark.parametrize("reader", few(READERS, "msgflow"))
def test_an_enumeration_is_its_label(make_trace: Make, new_database: Path, reader: str) -> None:
    """The number where no label or several belong to it, and inside an array."""
    made = [
        ("my_pkg:labelled", (0, -128, (1 << 64) - 1, (0, 1))),
        ("my_pkg:labelled", (4, -1, 0, (0, 1))),
        ("my_pkg:labelled", (5, 0, 0, (0, 1))),
        ("my_pkg:labelled", (6, 1, 0, (0, 1))),
        ("my_pkg:labelled", (7, 127, 0, (0, 1))),
        ("my_pkg:labelled", (8, 0, 0, (0, 1))),
        ("my_pkg:labelled", (255, 0, 0, (0, 1))),
    ]
    trace = make_trace({**ROS, "my_pkg:labelled": LABELLED}, [EVENTS[0], *made])
    ingest([trace], new_database, events=["my_pkg:*"], reader=reader)
    found = fields_of(new_database)
    assert [fields["state"] for fields in found] == [
        "IDLE",
        4,
        "it's busy",
        "it's busy",
        7,
        "DONE",
        "LAST",
    ]
    assert [fields["side"] for fields in found] == ["LEFT", "LEFT", 0, "RIGHT", "RIGHT", 0, 0]
    assert [fields["most"] for fields in found] == ["ALL", 0, 0, 0, 0, 0, 0]
    assert [fields["each"] for fields in found] == [[0, 1]] * len(made)


@pytest.mark.thorough
@pytest.mark.parametrize("reader", few(READERS, "msgflow"))
def test_labels_of_several_programs_count_together(
    make_trace: Make, new_database: Path, reader: str
) -> None:
    """A number to which they give different labels has none."""
    kinds = ("u8{OFF, ON, BOTH, MORE}", "u8{OFF, BROKEN, NEW = 4, MORE = 5 ... 6}", "i16")
    traces = [
        make_trace(
            {**ROS, "my_pkg:state": {"state": kind}},
            [EVENTS[0], *[("my_pkg:state", (value,)) for value in range(7)]],
            name=f"trace{number}",
            trace_uuid=UUID(int=number + 1),
            clock_uuid=UUID(int=number + 1),
        )
        for number, kind in enumerate(kinds)
    ]
    ingest(traces, new_database, events=["my_pkg:*"], reader=reader)
    found = [fields["state"] for fields in fields_of(new_database)]
    assert sorted(map(str, found)) == sorted(
        3 * ["OFF", "1", "BOTH", "MORE", "NEW", "MORE", "MORE"]
    )


@pytest.mark.thorough
def test_both_readers_give_the_same(tmp_path: Path) -> None:
    trace = simulate("own_events", tmp_path / "trace", factor=0.05).directory
    tables = []
    for reader in READERS:
        path = tmp_path / f"{reader}.duckdb"
        ingest([trace], path, events=["my_pkg:*"], reader=reader)
        with duckdb.connect(str(path), read_only=True) as con:
            tables.append(con.execute("FROM store.user_event ORDER BY user_event_id").fetchall())
    assert tables[0] == tables[1] != []


@pytest.mark.thorough
def test_all_other_tables_stay_as_they_are(tmp_path: Path) -> None:
    """But that threads are there which no event of ROS 2 was of, and were seen longer."""
    trace = simulate("own_events", tmp_path / "trace", factor=0.05).directory
    contents = []
    for number, events in enumerate(([], ["my_pkg:*"])):
        path = tmp_path / f"{number}.duckdb"
        ingest([trace], path, events=events)
        with duckdb.connect(str(path), read_only=True) as con:
            names = [
                name
                for (name,) in con.execute(
                    "SELECT table_name FROM duckdb_tables() WHERE schema_name = 'store'"
                ).fetchall()
            ]
            same = {"run", "user_event", "finding", "process", "thread", "definition"}
            contents.append(
                {
                    name: con.execute(f"FROM store.{name} ORDER BY ALL").fetchall()
                    for name in names
                    if name not in same
                }
            )
    assert contents[0] == contents[1]


@pytest.mark.thorough
def test_an_event_that_two_sessions_recorded_is_loaded_once(tmp_path: Path) -> None:
    """Each name for itself: what only one of the sessions has enabled is not lost."""
    trace = simulate("own_events", tmp_path / "once" / "first", factor=0.05).directory
    shutil.rmtree(trace / "truth")
    twice = tmp_path / "twice"
    for name in ("first", "second"):
        shutil.copytree(trace, twice / name)
    (metadata,) = (twice / "second").rglob("metadata")
    with open_traces([trace]) as traces:
        uuid = UUID(traces.traces[0].uuid)
    other = UUID(int=0x2A)
    for file in (twice / "second").rglob("*"):
        if file.is_file():
            content = file.read_bytes().replace(uuid.bytes, other.bytes)
            content = content.replace(str(uuid).encode(), str(other).encode())
            if file == metadata:
                # The second session calls it otherwise: another event, which only it has.
                content = content.replace(b"my_pkg:frame_done", b"my_pkg:frame_DONE")
            file.write_bytes(content)
    ingest([trace], tmp_path / "once.duckdb", events=["my_pkg:*"])
    ingest([twice], tmp_path / "twice.duckdb", events=["my_pkg:*"])
    ((count,),) = rows(tmp_path / "once.duckdb", "SELECT count(*) FROM user_event")
    assert rows(
        tmp_path / "twice.duckdb", "SELECT name, count(*) FROM user_event GROUP BY ALL ORDER BY 1"
    ) == [("my_pkg:frame_DONE", count), ("my_pkg:frame_done", count)]
