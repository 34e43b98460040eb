"""Calls are put together while they are read, and nothing of their events is lost by that."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

import duckdb
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from msgflow.ingest import calls, staging, whole
from msgflow.ingest.catalogue import load
from msgflow.ingest.sequences import Sequences
from msgflow.trace import COMMON_SCHEMA

LAYERS = tuple(layer.name for layer in calls.layers())
OTHERS = ("dds:read", "ros2:rclcpp_intra_publish", "ros2:rclcpp_executor_execute")

Event = dict[str, Any]

# Mostly what follows in a call, so that there are whole ones.
USUAL = st.sampled_from(
    [call.names for call in calls.CALLS] + [(name,) for name in (*LAYERS, *OTHERS)]
)
DETAILS = st.fixed_dictionaries(
    {
        "trace_index": st.sampled_from([0, 0, 0, 1]),
        "cpu_id": st.sampled_from([0, 0, 0, 1]),
        "vtid": st.sampled_from([1, 1, 2]),
        "value": st.sampled_from([7, 7, 7, 8, None]),
    }
)
EVENTS = st.lists(st.tuples(USUAL, st.lists(DETAILS, min_size=3, max_size=3)), max_size=12).map(
    lambda groups: [
        {"name": name} | detail
        for names, details in groups
        for name, detail in zip(names, details, strict=False)
    ]
)


@pytest.fixture(scope="module")
def con() -> Iterator[duckdb.DuckDBPyConnection]:
    """A connection with empty tables of what is read."""
    with duckdb.connect() as connection:
        staging.attach(connection, None)
        yield connection


def read(con: duckdb.DuckDBPyConnection, rounds: list[list[Event]]) -> list[Event]:
    """Stage events round by round, and return them with what was found out of their order."""
    staging.empty(con)
    sequences = Sequences(load(), [0, 0])
    found: list[Event] = []
    number = 0
    for position, of_round in enumerate(rounds):
        batches = []
        for event in of_round:
            number += 1
            event |= {"event_id": number, "ts_ns": number * 10, "vpid": 1, "round": position}
        for name in {event["name"]: None for event in of_round}:
            tracepoint = load().tracepoints[name]
            schema = pa.schema([*COMMON_SCHEMA, *tracepoint.arrow_schema()])
            rows = [
                {**dict.fromkeys([f.name for f in tracepoint.fields], event["value"]), **event}
                for event in of_round
                if event["name"] == name
            ]
            batches.append((name, pa.RecordBatch.from_pylist(rows, schema)))
        if batches:
            placed = sequences.place(batches).batches
            found += [
                {"name": name, "round": position} | row
                for name, rows in placed
                for row in rows.to_pylist()
            ]
            for table, rows in whole.staged(placed):
                con.from_arrow(rows).insert_into(f"raw.main.{table}")
    return found


@settings(deadline=None)
@given(rounds=st.lists(EVENTS, max_size=3))
def test_every_event_is_there_once(
    con: duckdb.DuckDBPyConnection, rounds: list[list[Event]]
) -> None:
    """With every column, whether its call is whole or not, and after that was taken apart."""
    found = read(con, rounds)
    for is_apart in (False, True):
        if is_apart:
            take_everything_apart(con)
        for layer in calls.layers():
            expected = [event for event in found if event["name"] == layer.name]
            relation = con.sql(f"SELECT * FROM raw.{layer.table} ORDER BY event_id")
            assert relation.columns == [name for name, _ in layer.columns(())]
            rows = [dict(zip(relation.columns, row, strict=True)) for row in relation.fetchall()]
            expected.sort(key=lambda event: int(event["event_id"]))
            assert rows == [{name: event[name] for name in relation.columns} for event in expected]
    assert [con.sql(f"FROM raw.{call.table}").fetchall() for call in calls.CALLS] == [[]] * len(
        calls.CALLS
    )


def take_everything_apart(con: duckdb.DuckDBPyConnection) -> None:
    """Half of the calls by their last event, the others by their thread."""
    con.execute(
        "CREATE OR REPLACE TABLE staging.taken_apart (thread_index INTEGER, event_id BIGINT)"
    )
    for call in calls.CALLS:
        last = call.column_of(len(call.names) - 1, "event_id")
        con.execute(
            f"INSERT INTO staging.taken_apart SELECT NULL, {last} FROM raw.{call.table} "
            f"WHERE {last} % 2 = 0 UNION ALL SELECT thread_index, NULL FROM raw.{call.table} "
            f"WHERE {last} % 2 = 1"
        )
        calls.take_apart(con, call)


@settings(deadline=None)
@given(rounds=st.lists(EVENTS, max_size=3))
def test_calls_are_whole_where_each_layer_directly_follows(
    con: duckdb.DuckDBPyConnection, rounds: list[list[Event]]
) -> None:
    found = {event["event_id"]: event for event in read(con, rounds)}
    for call in calls.CALLS:
        expected = {
            tuple(event["event_id"] for event in chain)
            for event in found.values()
            if event["name"] == call.names[-1] and (chain := whole_call(call, event, found))
        }
        columns = [call.column_of(n, "event_id") for n in range(len(call.names))]
        rows = con.sql(f"SELECT {', '.join(columns)} FROM raw.{call.table}").fetchall()
        assert set(rows) == expected
        assert len(rows) == len(expected)


def whole_call(call: calls.Call, last: Event, found: dict[int, Event]) -> list[Event]:
    """Return the events of the call that an event ends, none where that is not known."""
    chain = [last]
    for name in reversed(call.names[:-1]):
        before = found.get(chain[0][call.follows])
        if before is None or before["name"] != name or not is_same(call, before, chain[0]):
            return []
        chain.insert(0, before)
    before = found.get(chain[0][call.follows])
    if call.not_after and before:
        of_round = [
            event["event_id"]
            for event in found.values()
            if event["round"] == last["round"] and event["name"] in (*LAYERS, "dds:read")
        ]
        if before["name"] == call.not_after or before["event_id"] < min(of_round):
            return []
    return chain


def is_same(call: calls.Call, one: Event, other: Event) -> bool:
    keys = ("round", "trace_index", "cpu_id", call.same)
    return one[call.same] is not None and all(one[key] == other[key] for key in keys)


def test_columns_that_all_layers_share_are_there_once() -> None:
    """What a thread did of callbacks stays the same in a publication; calls go on in callbacks."""
    by_name = {call.name: call for call in calls.CALLS}
    assert list(by_name["publication"].columns) == [
        "rclcpp_publish_event_id",
        "rclcpp_publish_ts_ns",
        "trace_index",
        "cpu_id",
        "thread_index",
        "rclcpp_publish_previous_call_event_id",
        "previous_callback_event_id",
        "rclcpp_publish_publisher_handle",
        "message",
        "rclcpp_publish_message_timestamp",
        "rcl_publish_event_id",
        "rcl_publish_ts_ns",
        "rcl_publish_publisher_handle",
        "rmw_publish_event_id",
        "rmw_publish_ts_ns",
        "rmw_publish_rmw_publisher_handle",
        "rmw_publish_timestamp",
    ]
    assert "callback_end_previous_call_event_id" in by_name["callback"].columns


def test_taking_apart_leaves_nothing_behind_when_it_fails(
    con: duckdb.DuckDBPyConnection,
) -> None:
    """It is done again with more memory."""
    names = [{"name": name} for call in calls.CALLS for name in call.names]
    detail = {"trace_index": 0, "cpu_id": 0, "vtid": 1, "value": 7}
    read(con, [[event | detail for event in names]])
    layers = [f"raw.{layer.table}" for layer in calls.layers()]

    def events() -> list[list[Any]]:
        return [con.sql(f"FROM {layer} ORDER BY event_id").fetchall() for layer in layers]

    class Failing:
        """A connection whose memory is too short for some statements."""

        def __init__(self, word: str) -> None:
            self._word = word

        def __getattr__(self, name: str) -> Any:
            return getattr(con, name)

        def execute(self, statement: str) -> Any:
            if statement.startswith(self._word):
                raise duckdb.OutOfMemoryException("too little")
            return con.execute(statement)

    before = events()
    con.execute(
        "CREATE OR REPLACE TABLE staging.taken_apart AS SELECT 0 AS thread_index, 1 AS event_id"
    )
    publication = calls.CALLS[0]
    assert con.sql(f"FROM raw.{publication.table}").fetchall()
    for word in ("INSERT INTO raw.ros2_rmw_publish", "DELETE"):
        with pytest.raises(duckdb.OutOfMemoryException):
            calls.take_apart(cast("duckdb.DuckDBPyConnection", Failing(word)), publication)
        assert events() == before
        assert con.sql(f"FROM raw.{publication.table}").fetchall()
    calls.take_apart(con, publication)
    assert events() == before
    assert not con.sql(f"FROM raw.{publication.table}").fetchall()
