"""Each finding, from the rows that show it; and what else its header promises."""

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
TWO_HOSTS: Tables = {
    "clock": "clock_id,method\n1,none\n2,none\n",
    "host": "host_id,clock_id,hostname\n1,1,alpha\n2,2,beta\n",
    "process": "process_id,host_id,pid,name,first_seen_ns,last_seen_ns\n"
    "1,1,10,talker,0,100000\n2,2,20,listener,0,100000\n",
    "node": "node_id,process_id,full_name\n1,1,/talker\n2,2,/listener\n",
}

# finding -> (input rows, expected (subject, count, detail))
CASES: dict[str, tuple[Tables, list[tuple[str, int, str]]]] = {
    "discarded_events": (
        {
            "gap": "kind,cpu,start_ns,end_ns,event_count\n"
            "loss,0,1000000000,1250000000,20000\nloss,1,3000000000,3250000000,5000\n"
            "pause,,5,6,\n",
            "packet": "cpu_id,event_count,discarded_event_count\n0,10000,0\n1,900,25000\n",
        },
        [
            (
                "trace",
                25000,
                "25,000 events in 2 places, 0.500 s in all; --subbuf-size=4M would have held "
                "the largest burst",
            )
        ],
    ),
    "lost_packets": (
        {"gap": "kind,cpu,start_ns,end_ns\npackets,0,0,2000000000\nloss,0,5,6\n"},
        [("trace", 1, "1 place on 1 CPU, 2.000 s in all")],
    ),
    "tracing_paused": (
        {"gap": "kind,start_ns,end_ns\npause,0,1000000000\npause,5000000000,5500000000\n"},
        [("trace", 2, "2 pauses, 1.500 s in all, the longest 1.000 s")],
    ),
    "damaged_trace": (
        {
            "diagnostic": "trace_id,name,severity,count,detail\n"
            "1,damaged_trace,data_loss,1,cut off\n1,pause,warning,1,none\n"
        },
        [("trace", 1, "cut off")],
    ),
    "audit_failed": (
        {"diagnostic": "name,severity,count,detail\ncheck_failed,error,3,two of one\n"},
        [("database", 3, "two of one")],
    ),
    "empty_trace": (
        {
            "diagnostic": "trace_id,name,severity,count,detail\n"
            "1,empty_trace,warning,1,not one event\n"
        },
        [("trace", 1, "no event was recorded")],
    ),
    "ignored_events": (
        {"diagnostic": "name,severity,count,detail\nignored_events,info,9,dds:* (9)\n"},
        [("case", 9, "dds:* (9)")],
    ),
    "overlapping_traces": (
        {
            "diagnostic": "trace_id,name,severity,count,detail\n"
            "1,overlapping_traces,warning,9,twice\n"
        },
        [("trace", 9, "twice")],
    ),
    "started_late": (
        {
            # the third is one that ROS makes for /rosout
            "publisher": "publisher_id,is_inferred,is_internal\n"
            "1,true,false\n2,false,false\n3,true,true\n",
            "callback": "callback_id,kind\n1,unknown\n",
            "node": "node_id,is_inferred\n1,false\n",
        },
        [
            (
                "process 1 on host",
                2,
                "not seen to be created: 1 of 1 callbacks, 1 of 2 publishers",
            )
        ],
    ),
    "initialisation_lost": (
        {
            # process 2 was seen before anything was lost, 3 in a trace without losses
            "process": "process_id,pid,name,first_seen_ns,last_seen_ns\n1,1,talker,10,90\n"
            "2,2,early,2,90\n3,3,late,10,90\n",
            "trace": "trace_id,path,start_ns,end_ns\n1,lossy,0,100\n2,whole,0,100\n",
            "publisher": "publisher_id,process_id,is_inferred,is_internal\n"
            "1,1,true,false\n2,2,true,false\n3,3,true,false\n",
            "node": "node_id,process_id,is_inferred\n1,1,false\n2,2,false\n3,3,false\n",
            "gap": "trace_id,kind,cpu,start_ns,end_ns\n1,loss,0,5,6\n",
            "callback_instance": "callback_instance_id,process_id,trace_id,start_ns,end_ns\n"
            "1,1,1,20,30\n2,2,1,3,4\n3,3,2,20,30\n",
        },
        [("talker 1 on host", 1, "not seen to be created: 1 of 1 publishers")],
    ),
    "uncertain_owner": (
        {
            "diagnostic": "name,severity,count,detail\n"
            "eliminated_owner,warning,2,timers\ninferred_timer,warning,2,none\n"
        },
        [("the input", 2, "timers")],
    ),
    "process_without_ros": (
        {
            "process": "process_id,pid,name,first_seen_ns,last_seen_ns\n"
            "1,1,ros,0,1\n2,2,bridge,0,1500000000\n3,3,client,0,1\n4,4,server,0,1\n",
            "node": "process_id\n1\n",
            "client": "process_id\n3\n",
            "service": "process_id\n4\n",
        },
        [("bridge 2 on host", 1, "seen for 1.500 s")],
    ),
    "publisher_not_traced": (
        {
            "subscription": "subscription_id,topic_name,is_internal\n1,/a,false\n2,/b,false\n",
            "orphan_take": "take_id,subscription_id,reason\n1,1,publisher_not_traced\n"
            "2,1,publisher_not_traced\n3,2,no_stamp\n",
            "take": "take_id,method\n1,rmw\n2,rmw\n3,rmw\n",
        },
        [("/a", 2, "2 messages")],
    ),
    "message_without_stamp": (
        {
            "subscription": "subscription_id,topic_name,is_internal\n1,/a,false\n2,/rosout,true\n",
            "orphan_take": "take_id,subscription_id,reason\n1,1,no_stamp\n2,2,no_stamp\n"
            "3,1,no_stamp\n4,1,ambiguous\n",
            # the third was kept by a ring buffer for a subscription that came late
            "take": "take_id,method\n1,callback_only\n2,rmw\n3,ring_buffer\n4,rmw\n",
        },
        [("/a", 1, "1 message")],
    ),
    "trace_ends_early": (
        {
            "process": "process_id,pid,name,last_seen_ns\n1,1,talker,1000000000\n",
            "publisher": "publisher_id,topic_name\n1,/a\n",
            "subscription": "subscription_id,topic_name\n1,/a\n",
            "orphan_take": "take_id,subscription_id,reason\n1,1,publisher_trace_ends\n",
            "take": "take_id,taken_ns,method\n1,1250000000,rmw\n",
        },
        [("/a", 1, "1 message until 0.250 s after the last event of talker 1 on host")],
    ),
    "stream_ends_early": (
        {
            "packet": "cpu_id,stream_instance_id,begin_ns,end_ns\n"
            "0,0,0,10000000000\n1,1,0,4000000000\n2,2,0,9900000000\n"
        },
        [("trace", 1, "1 stream (CPU 1) end up to 6.000 s early")],
    ),
    "unbalanced_callbacks": (
        {
            # the third is explained by a gap, the last may still be running; another callback is
            # cut while others run in it, then comes again
            "callback_instance": "callback_instance_id,callback_id,start_ns,end_ns,"
            "is_loss_affected\n"
            "1,1,10,,false\n7,1,12,,false\n2,1,20,,true\n3,1,30,35,false\n4,1,60,,false\n"
            "5,2,38,,false\n6,2,50,55,false\n",
            "thread_break": "thread_id,resumed_ns\n1,45\n",
        },
        [("process 1 on host", 2, "2 runs of 1 callback")],
    ),
    "clocks_apart": (
        {
            **TWO_HOSTS,
            "publication": PUBLISHED + "1,1,1,5000000,6000000,7\n2,1,1,5000,6000,8\n",
            "take": TAKEN + "1,1,2,4000000,7,rmw\n2,1,2,7000,8,rmw\n",
            "link_transport": "publication_id,take_id,method\n1,1,exact\n2,2,exact\n",
        },
        [("alpha → beta", 1, "1 message received up to 2.000 ms before publication")],
    ),
    "clocks_not_together": (
        {
            **TWO_HOSTS,
            "publication": PUBLISHED + "1,1,1,0,1000000,7\n2,2,2,0,1000000,8\n3,1,1,0,4000000,9\n",
            "take": TAKEN + "1,1,2,1500000,7,rmw\n2,1,1,999999,8,rmw\n3,1,2,7250000,9,rmw\n",
            "link_transport": "publication_id,take_id,method\n1,1,exact\n2,2,exact\n3,3,exact\n",
        },
        # The other way they are shown to be apart.
        [("alpha → beta", 2, "2 messages, from 0.500 ms to 3.250 ms as recorded")],
    ),
    "latency_uncertain": (
        {
            **TWO_HOSTS,
            "clock": "clock_id,method,reference_clock_id,uncertainty_ns\n1,none,1,0\n"
            "2,messages,1,5\n",
            "clock_uncertainty": "clock_id,at_ns,uncertainty_ns\n2,0,1000000\n2,10000000,2000000\n",
            "publication": PUBLISHED
            + "1,1,1,0,0,1\n2,1,1,0,0,2\n3,1,1,0,0,3\n4,2,2,0,0,4\n5,2,2,0,0,5\n",
            # Two of three one way, one of two the other.
            "take": TAKEN + "1,1,2,1000000,1,rmw\n2,1,2,1100000,2,rmw\n3,1,2,5000000,3,rmw\n"
            "4,1,1,999999,4,rmw\n5,1,1,1000000,5,rmw\n",
            "link_transport": "publication_id,take_id,method\n"
            "1,1,exact\n2,2,exact\n3,3,exact\n4,4,exact\n5,5,exact\n",
        },
        [
            (
                "alpha → beta",
                2,
                "2 of 3 messages took less than the possible error, which is up to 1.500 ms; "
                "the median took 1.100 ms",
            )
        ],
    ),
    "clock_jumps": (
        {
            "publication": PUBLISHED + "1,1,1,1000,1000,1000\n2,1,1,12000000000,12000000000,9\n",
            "take": TAKEN + "1,1,1,2000,1000,rmw\n2,1,1,12000000500,32000000000,rmw\n",
            "link_transport": "publication_id,take_id,method\n1,1,exact\n2,2,exact\n",
        },
        [("host", 1, "1 jump, the largest 20.000 s")],
    ),
    "missing_layer": (
        {
            "callback_instance": "callback_instance_id\n1\n",
            "executor_state": "state,start_ns\nwait,1\n",
        },
        [
            (
                "publications",
                1,
                "nothing was published as far as traced (rcl_publish, rclcpp_publish, "
                "rmw_publish): no flows",
            ),
            (
                "takes",
                1,
                "no message was taken as far as traced (rmw_take, rcl_take): no transport, no "
                "flows",
            ),
        ],
    ),
}


@pytest.fixture
def database(empty_database: Path, tmp_path: Path) -> duckdb.DuckDBPyConnection:
    path = tmp_path / "case.duckdb"
    shutil.copyfile(empty_database, path)
    return duckdb.connect(str(path))


def test_every_finding_has_a_case() -> None:
    assert {header.name for header in objects.load("finding")} == {f"finding.{n}" for n in CASES}


@pytest.mark.parametrize("name", CASES)
def test_finding(name: str, database: duckdb.DuckDBPyConnection) -> None:
    tables, expected = CASES[name]
    fill(database, tables)
    found = [f for f in find(database, [1]) if f.name == name]
    assert [(f.subject, f.count, f.detail) for f in found] == expected
    assert find(database, [2]) == []


@pytest.mark.parametrize("header", objects.load("finding"), ids=lambda header: header.name)
def test_a_finding_says_what_it_means_and_what_to_do(header: objects.Header) -> None:
    assert header.title != header.name
    assert header.severity in SEVERITIES
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
