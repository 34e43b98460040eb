"""Findings: together, and where one needs more than its golden case; what headers promise."""

from __future__ import annotations

import shutil
from pathlib import Path

import duckdb
import pytest
from golden import fill

from msgflow.db import objects
from msgflow.db.derive import derive
from msgflow.db.finding import SEVERITIES, find

Tables = dict[str, str]
PUBLISHED = "publication_id,publisher_id,process_id,start_ns,end_ns,source_timestamp_ns\n"
TAKEN = "take_id,subscription_id,process_id,taken_ns,source_timestamp_ns,method\n"
# Something of every kind, so that nothing is missing altogether.
SOUND: Tables = {
    "node": "node_id\n1\n",
    "publication": "publication_id\n1\n",
    "take": "take_id,method\n1,rmw\n",
    "callback_instance": "callback_instance_id,end_ns\n1,9\n",
    "executor_state": "state\nwait\n",
}


@pytest.fixture
def database(empty_database: Path, tmp_path: Path) -> duckdb.DuckDBPyConnection:
    path = tmp_path / "case.duckdb"
    shutil.copyfile(empty_database, path)
    return duckdb.connect(str(path))


@pytest.mark.parametrize("header", objects.load("health/finding"), ids=lambda header: header.name)
def test_a_finding_says_what_it_means_and_what_to_do(header: objects.Header) -> None:
    assert header.title != header.name
    assert header.severity in SEVERITIES
    assert header.phase
    assert header.cause
    assert header.cure


def test_a_whole_recording_has_none(database: duckdb.DuckDBPyConnection) -> None:
    fill(
        database,
        {
            "process": "process_id,pid,name,first_seen_ns,last_seen_ns\n1,1,ros,0,100000\n",
            "node": "node_id,full_name\n1,/node\n",
            "publisher": "publisher_id,topic_name\n1,/a\n",
            "subscription": "subscription_id,topic_name\n1,/a\n",
            "publication": PUBLISHED + "1,1,1,10,11,10\n",
            "take": TAKEN + "1,1,1,20,10,rmw\n",
            "callback": "callback_id,kind,created_ns\n1,subscription,1\n",
            "callback_instance": "callback_instance_id,take_id,start_ns,end_ns\n1,1,21,22\n",
            "executor_state": "state,start_ns\nwait,1\n",
            "packet": "begin_ns,end_ns,event_count\n0,100,9\n",
        },
    )
    derive(database, 1)
    assert find(database, [1]) == []


@pytest.mark.parametrize(("step_ms", "is_jump"), [(99, False), (101, True)])
def test_a_jump_is_more_than_a_tenth_of_a_second(
    database: duckdb.DuckDBPyConnection, step_ms: int, *, is_jump: bool
) -> None:
    stamp = 12_000_000_000 + step_ms * 1_000_000
    fill(
        database,
        {
            **SOUND,
            "publication": PUBLISHED + "1,1,1,1000,1000,1000\n2,1,1,12000000000,12000000000,9\n",
            "take": TAKEN + f"1,1,1,2000,1000,rmw\n2,1,1,12000000500,{stamp},rmw\n",
            "link_transport": "publication_id,take_id,method\n1,1,exact\n2,2,exact\n",
        },
    )
    assert ("clock_jumps" in {f.name for f in find(database, [1])}) is is_jump


@pytest.mark.parametrize(("early_ms", "is_early"), [(490, False), (510, True)])
def test_a_stream_ends_early_that_ends_half_a_second_before_another(
    database: duckdb.DuckDBPyConnection, early_ms: int, *, is_early: bool
) -> None:
    """However long the recording is."""
    hour = 3_600 * 10**9
    fill(
        database,
        {
            **SOUND,
            "packet": "cpu_id,stream_instance_id,begin_ns,end_ns\n"
            f"0,0,0,{hour}\n1,1,0,{hour - early_ms * 10**6}\n",
        },
    )
    assert [f.name for f in find(database, [1])] == ["stream_ends_early"] * is_early


def test_the_chunks_of_a_recording_are_one(database: duckdb.DuckDBPyConnection) -> None:
    """A CPU was idle in one of them, another in the last: only the latter may lack events."""
    fill(
        database,
        {
            **SOUND,
            "trace": "trace_id,uuid,path\n1,7e90b1e2-0000-4000-8000-000000000001,first\n"
            "2,7e90b1e2-0000-4000-8000-000000000001,second\n",
            "packet": "trace_id,cpu_id,stream_instance_id,begin_ns,end_ns\n"
            "1,0,0,0,5000000000\n1,1,1,0,100\n1,2,2,0,5000000000\n"
            "2,0,0,5000000000,10000000000\n2,1,1,5000000000,9900000000\n"
            "2,2,2,5000000000,5000000000\n",
        },
    )
    assert [(f.name, f.subject, f.detail) for f in find(database, [1])] == [
        ("stream_ends_early", "second", "1 stream (CPU 2) end up to 5.000 s early")
    ]


def test_events_discarded_in_lost_packets_are_not_counted(
    database: duckdb.DuckDBPyConnection,
) -> None:
    fill(
        database,
        {
            **SOUND,
            "gap": "kind,cpu,start_ns,end_ns,event_count\nloss,0,0,1000000000,82\n"
            "loss,0,2000000000,2500000000,\n",
            "packet": "event_count,discarded_event_count\n400,82\n400,\n",
        },
    )
    assert [(f.name, f.count, f.detail) for f in find(database, [1])] == [
        (
            "discarded_events",
            82,
            "at least 82 events in 2 places, 1.500 s in all; --subbuf-size=1M would have held "
            "the largest burst",
        )
    ]


@pytest.mark.parametrize(("count", "name"), [("", "damaged_trace"), ("7", "discarded_events")])
def test_a_packet_that_was_cut_off_is_no_full_buffer(
    database: duckdb.DuckDBPyConnection, count: str, name: str
) -> None:
    fill(
        database,
        {
            **SOUND,
            "gap": f"kind,cpu,start_ns,end_ns,event_count\nloss,0,20,29,{count}\n",
            "packet": "event_count\n100\n",
            "diagnostic": "trace_id,name,severity,count,detail\n"
            "1,damaged_trace,data_loss,1,cut off\n",
        },
    )
    assert {f.name for f in find(database, [1])} == {"damaged_trace", name}


def test_a_run_in_which_nothing_happened(database: duckdb.DuckDBPyConnection) -> None:
    """Not even what one part would call for of another."""
    fill(database, {"node": "node_id\n1\n"})
    assert [(f.name, f.subject) for f in find(database, [1])] == [("missing_layer", "everything")]


def test_errors_come_first(database: duckdb.DuckDBPyConnection) -> None:
    fill(
        database,
        {
            **SOUND,
            "gap": "kind,cpu,start_ns,end_ns,event_count\npause,,0,9,\nloss,0,20,29,5\n",
            "packet": "event_count\n100\n",
        },
    )
    assert [f.severity for f in find(database, [1])] == ["error", "warning"]
    assert find(database, [2]) == []
