"""The model of a run: objects that need not be planned, and failures while it is built."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.network import Network, traffic
from support.ros_system import RosSystem
from support.staged_events import StagedEvents, Thread

from msgflow import trace
from msgflow.db import objects
from msgflow.errors import DatabaseError
from msgflow.ingest import ingest, model, staging
from msgflow.ingest.load import load_traces
from msgflow.sql.header import Header
from msgflow.sql.interrupt import Interrupts
from msgflow_sim import Recording, simulate

SOMETIMES_EMPTY = [header for header in objects.model() if header.when]
INPUT = {need for header in SOMETIMES_EMPTY for need in header.needs} - {
    header.name for header in objects.model()
}
S = 1_000_000_000
ADDRESSES = {"alpha": "10.0.0.1", "beta": "10.0.0.2", "gamma": "10.0.0.3"}


@pytest.fixture(scope="module")
def lossy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A trace with lost events and a pause."""
    recording = Recording(lost_event_share=0.2, pauses=((S // 4, S // 2),))
    return simulate(
        "pipeline", tmp_path_factory.mktemp("trace") / "trace", factor=0.1, recording=recording
    ).directory


def unconditional(header: Header) -> Header:
    """The object with all its steps, whatever their `when` says."""
    steps = tuple(replace(step, sources=()) for step in header.steps)
    return replace(header, sources=(), steps=steps)


def read(con: duckdb.DuckDBPyConnection, source: Path | StagedEvents) -> None:
    """Read a trace into `raw` and `staging`, or write events by hand there."""
    staging.attach(con, None)
    if isinstance(source, StagedEvents):
        source.write(con)
        return
    with trace.open([source]) as traces:
        load_traces(
            con, traces, hostnames={}, ignore=(), events=["my_pkg:*"], may_hold=False,
            replace=False, interrupts=Interrupts(), progress=None,
        )  # fmt: skip


def built(source: Path | StagedEvents, without: Header | None = None) -> dict[str, Any]:
    """Build the model, nothing skipped, and return (columns, count) of each `when` object.

    Where an object is given, only what it needs is built, and the tables of its `when` lose the
    rows that it names before anything reads them.
    """
    emptied = {
        name: f"DELETE FROM {name}" + (f" WHERE {condition}" if condition else "")
        for name, condition in (without.sources if without else ())
    }
    # What names an object of the model can only be told once that is there.
    early = {
        name
        for name, condition in (without.sources if without else ())
        if "staging." not in condition
    }
    headers = without_others(without) if without else objects.model()
    with duckdb.connect() as con:
        read(con, source)
        staging.narrow(con, staging.empty_tables(con))
        for name in early & INPUT:
            con.execute(emptied[name])
        for header in headers:
            if header is without:
                for name in emptied.keys() - early:
                    con.execute(emptied[name])
            model.create(con, unconditional(header), set())
            if header.name in early:
                con.execute(emptied[header.name])
        return {
            header.name: (
                con.execute(
                    f"SELECT column_name, column_type FROM (DESCRIBE {header.name})"
                ).fetchall(),
                con.execute(f"SELECT count(*) FROM {header.name}").fetchall()[0][0],
            )
            for header in headers
            if header.when
        }


def without_others(header: Header) -> list[Header]:
    """Return an object with all that it needs, in order."""
    needed = {header.name}
    kept = []
    for each in reversed(objects.model()):
        if each.name in needed:
            needed |= set(each.needs)
            kept.append(each)
    return kept[::-1]


@pytest.fixture(scope="module")
def planned(lossy: Path) -> dict[str, Any]:
    return built(lossy)


# Between them they fill each object that has a `when`, except schedules. Each is a system, its
# layout, and what is wrong with the recording.
SYSTEMS = (
    # Services answer later, of a release that records no end of them.
    ("services", "jazzy", Recording()),
    ("own_events", "humble", Recording()),
    ("calls", "rolling", Recording()),
    ("intra_process", "jazzy", Recording()),
    ("approximate_sync", "humble-fastdds", Recording()),
    ("channels", "humble-fastdds", Recording(lost_event_share=0.2)),
    ("pipeline", "humble", Recording(start_ns=S // 3)),
)


def network(directory: Path) -> Path:
    """Write traces of two hosts that exchange packets."""
    simulated = simulate("two_hosts", directory / "traces", factor=0.03)
    carried = Network(simulated.directory, ADDRESSES)
    traffic(carried, 1.0)
    carried.write()
    return simulated.directory


def managed_node_in_a_callback_group() -> StagedEvents:
    """What the simulator does not write: a node that changes its state, and what CARET records."""
    system = RosSystem()
    main, worker = Thread(100), Thread(100, 101)
    system.node(main, 0x1, "node")
    system.add("ros2:rcl_lifecycle_state_machine_init", main, node_handle=0x1, state_machine=0x5)
    system.add(
        "ros2:rcl_lifecycle_transition", main, state_machine=0x5, start_label="unconfigured",
        goal_label="configuring",
    )  # fmt: skip
    system.timer(main, 0x2, 0xC2)
    system.add(
        "ros2_caret:callback_group_add_timer", main, callback_group_addr=0xA1, timer_handle=0x2
    )
    system.add(
        "ros2_caret:construct_executor", main, executor_addr=0xE1, executor_type_name="single"
    )
    system.add(
        "ros2_caret:add_callback_group", main, executor_addr=0xE1, callback_group_addr=0xA1,
        group_type_name="reentrant",
    )  # fmt: skip
    system.start(worker, 0xC2)
    system.end(worker, 0xC2)
    return system


@pytest.fixture(scope="module")
def systems(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path | StagedEvents, ...]:
    """Traces of all of `SYSTEMS`, and two that the simulator does not write by itself."""
    simulated = [
        simulate(
            system,
            tmp_path_factory.mktemp(system) / "trace",
            factor=0.1,
            layout=layout,
            recording=recording,
        ).directory
        for system, layout, recording in SYSTEMS
    ]
    of_packets = network(tmp_path_factory.mktemp("network"))
    return (*simulated, of_packets, managed_node_in_a_callback_group())


@pytest.mark.thorough
def test_objects_have_no_row_without_the_tables_of_their_when(
    lossy: Path, systems: tuple[Path | StagedEvents, ...]
) -> None:
    headers = [header for header in SOMETIMES_EMPTY if not of_schedules(header)]
    assert have_no_row_without_their_when(headers, (lossy, *systems)) >= 52


def test_what_is_left_out_has_no_row(lossy: Path) -> None:
    assert not wrongly_left_out(lossy)


@pytest.mark.thorough
def test_what_is_left_out_of_many_recordings_has_no_row(
    systems: tuple[Path | StagedEvents, ...], shared_traces: Path, shared_kernel: Path
) -> None:
    recorded = sorted(path for path in shared_traces.glob("real_*") if path.is_dir())
    kernel = shared_kernel / "mutex" / "trace-chrisnux"
    assert recorded
    for source in (*systems, *recorded, kernel):
        assert not wrongly_left_out(source), source


def wrongly_left_out(source: Path | StagedEvents) -> list[str]:
    """Return objects that have rows, although an ingest would not have looked for them."""
    with duckdb.connect() as con:
        read(con, source)
        staging.narrow(con, staging.empty_tables(con))
        for header in objects.model():
            model.create(con, unconditional(header), set(), keep=True)
        empty = staging.empty_tables(con) | {
            name
            for (name,) in con.execute(
                "SELECT table_name FROM duckdb_tables() "
                "WHERE database_name = 'temp' AND estimated_size = 0"
            ).fetchall()
        }
        steps = [step for header in objects.model() for step in header.steps]
        return [
            name
            for name, sources in [
                *((header.name, header.sources) for header in SOMETIMES_EMPTY),
                *((step.table, step.sources) for step in steps),
            ]
            if name not in empty and not model.may_have_rows(con, sources, empty)
        ]


def of_schedules(header: Header) -> bool:
    return header.path.parent.name in ("alignment", "schedule")


@pytest.mark.thorough
def test_schedules_have_no_row_without_the_tables_of_their_when(shared_kernel: Path) -> None:
    headers = [header for header in SOMETIMES_EMPTY if of_schedules(header)]
    path = shared_kernel / "mutex" / "trace-chrisnux"
    assert have_no_row_without_their_when(headers, (path,)) >= 15


def have_no_row_without_their_when(
    headers: list[Header], sources: tuple[Path | StagedEvents, ...]
) -> int:
    """Return how many of the objects have rows in one of the sources, and were looked at."""
    found = {source: built(source) for source in sources}
    count = 0
    for header in headers:
        shown = [source for source, rows in found.items() if rows[header.name][1]]
        if shown:
            columns, _ = found[shown[0]][header.name]
            assert built(shown[0], header)[header.name] == (columns, 0), header.name
            count += 1
    return count


def test_every_table_says_when_it_has_no_row() -> None:
    tables = [header for header in objects.model() if header.kind == "view"]
    assert {each.name for each in tables if not each.when} <= {"staging.finding"}


@pytest.mark.parametrize("is_strange", [False, True])
def test_findings_of_which_nothing_tells_are_not_planned(
    lossy: Path, is_strange: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    planned = []
    statement = model.statement

    def note(kinds: Any) -> str:
        planned.append(statement(kinds))
        return planned[-1]

    monkeypatch.setattr(model, "statement", note)
    with duckdb.connect() as con:
        read(con, lossy)
        if is_strange:
            con.execute("INSERT INTO staging.damage VALUES (0, 'stream_0', 4096, 12, 'cut off')")
            con.execute("UPDATE staging.event_count SET is_known = false")
        model.build(con)
        found = con.execute("SELECT name FROM staging.finding").fetchall()
    (text,) = planned
    for name in ("damaged_trace", "unknown_event"):
        assert (f"'{name}'" in text) == is_strange
        assert ((name,) in found) == is_strange
    assert "'repeated_initialisation'" in text
    assert "'kernel_trace_not_joined'" not in text


@pytest.mark.thorough
def test_an_object_without_a_row_has_its_columns_all_the_same(planned: dict[str, Any]) -> None:
    with duckdb.connect() as con:
        con.execute("ATTACH ':memory:' AS staging")
        for header in SOMETIMES_EMPTY:
            empty = set(header.when)
            model.create(con, header, empty)
            assert header.name in empty
            columns = con.execute(
                f"SELECT column_name, column_type FROM (DESCRIBE {header.name})"
            ).fetchall()
            assert columns == planned[header.name][0], header.name


def test_a_step_without_a_row_has_its_columns_all_the_same() -> None:
    with duckdb.connect() as con:
        read(con, StagedEvents())
        staging.narrow(con, staging.empty_tables(con))
        for header in objects.model():
            model.create(con, unconditional(header), set(), keep=True)
            for step in header.steps:
                if step.columns:
                    con.execute(f"CREATE OR REPLACE TEMP TABLE declared ({step.columns})")
                    made, declared = (
                        con.execute(f"DESCRIBE {name}").fetchall()
                        for name in (step.table, "declared")
                    )
                    assert made == declared, step.table


def test_what_was_read_is_dropped_once_nothing_needs_it(lossy: Path) -> None:
    """Only what is not evaluated before it is stored stays until then."""
    with duckdb.connect() as con:
        read(con, lossy)
        before = tables_with_rows(con)
        model.build(con)
        after = tables_with_rows(con)
    assert len(before) > 20
    states = ("get_next_ready", "wait_for_work", "execute")
    assert after == {"packet", "thread", "thread_name"} | {
        f"ros2_rclcpp_executor_{state}" for state in states
    }


def tables_with_rows(con: duckdb.DuckDBPyConnection) -> set[str]:
    rows = con.execute(
        "SELECT table_name FROM duckdb_tables() WHERE database_name = 'raw' AND estimated_size > 0"
    ).fetchall()
    return {name for (name,) in rows}


def test_a_full_disk_is_said_at_once(
    lossy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fill(*args: Any) -> None:
        raise duckdb.OutOfMemoryException("failed to offload data block (max_temp_directory_size)")

    monkeypatch.setattr(model, "create", fill)
    with pytest.raises(DatabaseError, match="no space left"):
        ingest([lossy], tmp_path / "new.duckdb")
