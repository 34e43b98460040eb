"""Findings: stored and read, and broken rules; and where one needs more than its golden case."""

from __future__ import annotations

import shutil
from pathlib import Path

import duckdb
import pytest
from support import golden
from support.golden import derived_for, fill, insert_case

from msgflow.db import objects
from msgflow.db.derivation import derive, derive_findings, derive_table, learn_topics
from msgflow.db.finding import (
    Finding,
    broken_rules,
    kinds_of,
    read_findings,
    statement,
)
from msgflow.sql.header import Header

CASES = Path(__file__).resolve().parents[1] / "schema" / "cases"
# What leaves views without a row that findings do not read themselves.
WITHOUT = {
    "derive.several_clocks": "DELETE FROM store.clock WHERE clock_id > 1",
    "derive.clocks_to_synchronise": "UPDATE store.run SET clock_sync = 'none'",
    "derive.many_chains": "DELETE FROM store.flow_hop",
}
MACROS = {header.name for header in objects.views() if header.kind == "macro"}
Tables = dict[str, str]
PUBLISHED = "publication_id,publisher_id,process_id,start_ns,end_ns,source_timestamp_ns\n"
TAKEN = "take_id,subscription_id,process_id,taken_ns,source_timestamp_ns,method\n"
# Something of every kind, so that nothing is missing altogether.
SOUND: Tables = {
    "node": "node_id\n1\n",
    "publication": "publication_id\n1\n",
    "take": "take_id,method\n1,rmw\n",
    "link_transport": "publication_id,take_id,method\n1,1,exact\n",
    "callback_instance": "callback_instance_id,end_ns\n1,9\n",
    "executor_state": "state\nwait\n",
}


@pytest.fixture
def database(empty_database: Path, tmp_path: Path) -> duckdb.DuckDBPyConnection:
    path = tmp_path / "case.duckdb"
    shutil.copyfile(empty_database, path)
    return duckdb.connect(str(path))


def find(connection: duckdb.DuckDBPyConnection, run_id: int = 1) -> list[Finding]:
    """Find anew what a run shows, and return all that is stored of it."""
    derive_findings(connection, run_id)
    return read_findings(connection, [run_id])


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
    assert find(database) == []


def test_a_run_in_which_nothing_happened(database: duckdb.DuckDBPyConnection) -> None:
    """Not even what one part would call for of another."""
    fill(database, {"node": "node_id\n1\n"})
    assert [(f.name, f.subject) for f in find(database)] == [("missing_layer", "everything")]


def test_errors_come_first(database: duckdb.DuckDBPyConnection) -> None:
    fill(
        database,
        {
            **SOUND,
            "gap": "kind,cpu,start_ns,end_ns,event_count\npause,,0,9,\nloss,0,20,29,5\n",
            "packet": "event_count\n100\n",
        },
    )
    assert [f.severity for f in find(database)] == ["error", "warning"]
    assert find(database, 2) == []


def test_those_of_a_recording_are_found_anew_and_others_stay(
    database: duckdb.DuckDBPyConnection,
) -> None:
    fill(
        database,
        {
            **SOUND,
            "finding": "name,subject,count\npath_cut,,1\nempty_trace,,1\n",
            "gap": "kind,cpu,start_ns,end_ns\npause,,0,9\n",
        },
    )
    for _ in range(2):
        names = [finding.name for finding in find(database)]
        assert names == ["empty_trace", "tracing_paused"]


@pytest.mark.parametrize(
    "header",
    [header for header in kinds_of("recording") if header.when],
    ids=lambda header: header.name,
)
def test_without_the_rows_that_when_names_nothing_is_found(
    database: duckdb.DuckDBPyConnection, header: Header
) -> None:
    """So that the query need not run."""
    paths = sorted((CASES / header.name).glob("*.case"))
    # Some say when nothing is found.
    paths = [path for path in paths if golden.parse_csv(golden.read_case(path).expected)[1:]]
    assert paths
    for path in paths:
        database.begin()
        case = insert_case(database, path)
        if case.derives:
            learn_topics(database, 1)
        for table in derived_for(header.name, case):
            derive_table(database, table, 1)
        rows = f"SELECT count(*) FROM ({statement([header])}) WHERE run_id = $run_id"
        assert database.execute(rows, {"run_id": 1}).fetchall() > [(0,)]
        for name, condition in header.sources:
            if name in WITHOUT:
                database.execute(WITHOUT[name])
            else:
                golden.empty(database, name, condition)
            given = "(1)" if name in MACROS else ""
            which = f" WHERE {condition}" if condition else ""
            assert database.execute(f"FROM {name}{given}{which}").fetchall() == []
        assert database.execute(rows, {"run_id": 1}).fetchall() == [(0,)]
        database.rollback()


@pytest.mark.parametrize(
    "header",
    [header for header in kinds_of("input") if header.when],
    ids=lambda header: header.name,
)
def test_of_the_input_nothing_is_found_without_the_rows_that_when_names(header: Header) -> None:
    cases = [golden.read_case(path) for path in (CASES / header.name).glob("*.case")]
    cases = [case for case in cases if golden.parse_csv(case.expected)[1:]]
    assert cases
    for case in cases:
        with duckdb.connect() as con:
            golden.stage(con, case)
            rows = f"SELECT count(*) FROM ({statement([header])})"
            assert con.execute(rows).fetchall() > [(0,)]
            for name, condition in header.sources:
                golden.empty(con, name, condition)
            assert con.execute(rows).fetchall() == [(0,)]


def test_what_is_not_wrong_is_read_on_request(database: duckdb.DuckDBPyConnection) -> None:
    fill(database, {"finding": "name,count\nunknown_event,3\nempty_trace,1\n"})
    assert [finding.name for finding in read_findings(database, [1])] == ["empty_trace"]
    every = read_findings(database, [1], info=True)
    assert [(finding.name, finding.severity) for finding in every] == [
        ("empty_trace", "warning"),
        ("unknown_event", "info"),
    ]


def test_a_broken_rule_names_the_run_and_the_place(database: duckdb.DuckDBPyConnection) -> None:
    fill(
        database,
        {
            "run": "run_id,name\n1,first\n2,second\n",
            "publication": "publication_id,run_id,start_ns,end_ns\n1,1,1,2\n2,2,2,1\n",
            "thread": "thread_id,run_id,process_id\n1,1,1\n2,2,7\n",
        },
    )
    assert broken_rules(database, 1) == []
    # The trace, process and thread of the second publication are of the first run.
    broken = [
        ("interval_is_ordered", 2, "publication", 1),
        *3 * [("relation_is_kept", 2, "publication", 1)],
        ("relation_is_kept", 2, "thread", 1),
    ]
    for found in (broken_rules(database), broken_rules(database, 2)):
        assert [
            (each.name, each.run_id, each.subject.partition(".")[0], each.count) for each in found
        ] == broken
        assert all(each.phase == "database" and each.severity == "error" for each in found)
    assert read_findings(database, [1, 2]) == []
