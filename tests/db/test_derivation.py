"""What is stored of links follows from what the objects read."""

from __future__ import annotations

import re
from dataclasses import replace
from graphlib import CycleError
from pathlib import Path

import duckdb
import pytest
from support import golden
from support.thorough import thorough

from msgflow.db import derivation, objects
from msgflow.db.sandbox import open_file
from msgflow.files.resources import resource_directory
from msgflow.ingest import ingest
from msgflow.sql.header import parse
from msgflow.sql.statement import RECORDED, recorded
from msgflow_sim import Recording, simulate


def header(name: str, *needs: str) -> objects.Header:
    text = f"-- description: A rule.\nFROM {', '.join(needs)}\n"
    return parse(text, resource_directory("schema") / "link" / f"{name.partition('.')[2]}.sql")


def test_what_a_table_holds_comes_from_the_object_of_its_name() -> None:
    headers = [
        header("derive.a", "store.link"),
        header("derive.link", "derive.z"),
        header("derive.z", "store.host"),
    ]
    assert [one.name for one in objects.sort(headers)] == ["derive.z", "derive.link", "derive.a"]


def test_a_way_back_by_a_table_is_a_circle() -> None:
    headers = [header("derive.link", "derive.z"), header("derive.z", "store.link")]
    with pytest.raises(CycleError):
        objects.sort(headers)


def test_each_table_is_derived_after_those_that_it_reads() -> None:
    order = derivation.derived_tables()
    assert set(order) == {
        "stamp_clock", "nearest_message", "link_transport", "link_causal", "orphan_take",
        "undelivered", "link_call", "flow_call", "flow_root", "flow_hop",
    }  # fmt: skip
    for later, earlier in (
        ("nearest_message", "stamp_clock"),
        ("link_transport", "nearest_message"),
        ("orphan_take", "link_transport"),
        ("undelivered", "link_transport"),
        ("undelivered", "orphan_take"),
        ("flow_call", "link_causal"),
        ("flow_root", "flow_call"),
        ("flow_hop", "flow_root"),
    ):
        assert order.index(later) > order.index(earlier), later


def test_only_what_reads_clocks_waits_for_them() -> None:
    assert [name for name in derivation.derived_tables() if derivation.reads_clocks(name)] == [
        "undelivered"
    ]


def test_the_hash_follows_the_rules_that_are_stored(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = {"views": objects.views(), "load": objects.load("health/recording")}

    def hashes(changed: str, **fields: object) -> str:
        for cached in (derivation.derivation_hash, derivation.derived_tables):
            cached.cache_clear()
        with monkeypatch.context() as patched:
            for name, headers in whole.items():
                given = [
                    replace(one, **(fields or {"body": f"{one.body} -- changed"}))
                    if one.name == changed
                    else one
                    for one in headers
                ]
                patched.setattr(objects, name, lambda *_, given=given: given)
            return derivation.derivation_hash()

    now = hashes("none")
    links = (
        "derive.link_causal_direct", "derive.link_causal_by_hand", "derive.link_causal_annotated",
        "derive.process_gap", "derive.topic_group",
    )  # fmt: skip
    # Findings, a part that several share, and objects that only findings read.
    findings = ("finding.lost_packets", "finding.clock_name", "derive.clock_line", "main.node")
    for read in (*links, *findings):
        assert hashes(read) != now, read
    for not_read in ("derive.executor_busy", "main.flow_edge"):
        assert hashes(not_read) == now, not_read
    # Nor is anything stored that an object leaves out, or takes together with others.
    for field, other in (
        ("sources", (("store.take", "method = 'x'"),)),
        ("reads", ("main.take",)),
    ):
        assert hashes(links[0], **{field: other}) != now, field
    derivation.derivation_hash.cache_clear()


# What is stored: the table of each object.
TABLES = {
    name: table
    for header in objects.views()
    for table in derivation.derived_tables()
    if header.name == f"derive.{table}"
    for name in (header.name, *header.also, *header.united)
}
SOMETIMES_EMPTY = {
    header.name: header for header in objects.views() if header.when and header.name in TABLES
}


def test_only_what_is_stored_is_skipped() -> None:
    assert SOMETIMES_EMPTY.keys() == {header.name for header in objects.views() if header.when}
    assert len(SOMETIMES_EMPTY) >= 5


# Those with rows in runs of other systems than of one without stamps, with losses.
ELSEWHERE = {
    ("agnocast", "jazzy-agnocast"): {"derive.link_transport_agnocast"},
    ("calls", "rolling"): {"derive.flow_call", "derive.link_call"},
    ("intra_process", "jazzy"): {"derive.link_transport_ring_buffer"},
    ("python", "jazzy"): {"derive.link_causal_by_hand"},
    ("rtabmap", "rolling"): {"derive.link_causal_annotated"},
}


@pytest.mark.parametrize(
    ("system", "layout", "lost", "names"),
    [
        ("pipeline", "humble", 0.3, SOMETIMES_EMPTY.keys() - set().union(*ELSEWHERE.values())),
        *(thorough(*system, 0.0, names) for system, names in ELSEWHERE.items()),
    ],
)
def test_tables_have_no_row_without_those_of_their_when(
    tmp_path: Path, system: str, layout: str, lost: float, names: set[str]
) -> None:
    """Of a run in which each of them has rows."""
    path = tmp_path / "run.duckdb"
    recording = Recording(lost_event_share=lost)
    simulate(system, tmp_path / "trace", factor=0.3, layout=layout, recording=recording)
    ingest([tmp_path / "trace"], path)
    with open_file(path, read_only=False) as con:
        for name, header in SOMETIMES_EMPTY.items():
            if name not in names:
                continue
            con.begin()
            table = TABLES[name]
            before, own = count(con, f"store.{table}"), count(con, f"{name}(1)")
            assert before >= own > 0, name
            for each in header.when:
                golden.empty(con, each)
            assert count(con, f"{name}(1)") == 0, name
            derivation.derive_table(con, table, 1)
            assert count(con, f"store.{table}") == before - own, name
            con.rollback()


def count(con: duckdb.DuckDBPyConnection, rows: str) -> int:
    return int(con.execute(f"SELECT count(*) FROM {rows}").fetchall()[0][0])


MILLISECOND = 1_000_000
# What derivations leave out where no recording has it, and the tables that do.
LEFT_OUT = {
    "has_unnamed", "has_gaps", "has_pauses", "has_steps", "has_orphans", "has_clocks",
    "has_open_callbacks", "has_failed_takes",
}  # fmt: skip
# What to do before: else takes are found again, and nothing is of one clock.
BEFORE = {
    "has_orphans": "DELETE FROM store.take AS t USING store.orphan_take AS o "
    "WHERE t.take_id = o.take_id",
    "has_clocks": "UPDATE store.host SET clock_id = 1; DELETE FROM store.clock WHERE clock_id > 1",
}
LEAVING_OUT = ("link_transport", "orphan_take", "undelivered")


def test_all_that_derivations_leave_out_is_tried() -> None:
    texts = {each.name: each.body for each in objects.views() if each.name.startswith("derive.")}
    derived = objects.sources_of(f"derive.{name}" for name in derivation.derived_tables())
    using = {name for name in derived & texts.keys() if re.search(r"has_\w+ := ", texts[name])}
    assert {fact for name in using for fact in RECORDED if f"{fact} := " in texts[name]} == LEFT_OUT


@pytest.mark.thorough
def test_what_no_recording_has_changes_no_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of two runs, which have it all; one thing after the other is deleted."""
    path = tmp_path / "run.duckdb"
    pause = (1000 * MILLISECOND, 1100 * MILLISECOND)
    for layout, recording in (
        ("jazzy", Recording(start_ns=500 * MILLISECOND)),
        ("humble", Recording(lost_event_share=0.4, pauses=(pause,))),
    ):
        simulate("two_hosts", tmp_path / layout, factor=0.3, layout=layout, recording=recording)
        ingest([tmp_path / layout], path)
    with open_file(path, read_only=False) as con:

        def rows() -> dict[str, list[tuple[object, ...]]]:
            for table in LEAVING_OUT:
                derivation.derive_table(con, table, 1)
                derivation.derive_table(con, table, 2)
            return {
                table: con.execute(f"FROM store.{table} ORDER BY ALL").fetchall()
                for table in LEAVING_OUT
            }

        con.execute(  # threads that hang
            "UPDATE store.callback_instance SET end_ns = NULL, is_loss_affected = false "
            "WHERE callback_instance_id IN "
            "(SELECT max(callback_instance_id) FROM store.callback_instance GROUP BY thread_id)"
        )
        assert all(recorded(con, sorted(LEFT_OUT)).values()), recorded(con, sorted(LEFT_OUT))
        for fact in sorted(LEFT_OUT):
            con.begin()
            con.execute(BEFORE.get(fact, "SELECT 1"))
            while recorded(con, [fact])[fact]:
                for what in re.findall(r"FROM (store\.\w+(?: WHERE [^)]+)?)", RECORDED[fact]):
                    con.execute(f"DELETE FROM {what}")
            found = rows()
            assert found["undelivered"], fact
            with monkeypatch.context() as patched:
                patched.setattr(derivation, "recorded", lambda _, names: dict.fromkeys(names, True))
                assert rows() == found, fact
            con.rollback()
