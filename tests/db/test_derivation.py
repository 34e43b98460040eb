"""What is stored of links follows from what the objects read."""

from __future__ import annotations

from pathlib import Path

import duckdb
import golden
import pytest
from thorough import thorough

from msgflow.db import derivation, objects
from msgflow.db.sandbox import open_file
from msgflow.files.resources import resource_directory
from msgflow.ingest import ingest
from msgflow.sql.header import parse
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
    with pytest.raises(ValueError, match="need each other"):
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
                    objects.replace(one, **(fields or {"body": f"{one.body} -- changed"}))
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
    for not_read in ("derive.executor_busy", "main.flow_edge", "derive.finding_kind"):
        assert hashes(not_read) == now, not_read
    # Nor is anything stored that an object leaves out, or takes together with others.
    for field, other in (
        ("sources", (("store.take", "method = 'x'"),)),
        ("unites", ("main.take",)),
    ):
        assert hashes(links[0], **{field: other}) != now, field
    derivation.derivation_hash.cache_clear()


# What is stored: the table of each object.
TABLES = {
    name: table
    for header in objects.views()
    for table in derivation.derived_tables()
    if header.name == f"derive.{table}"
    for name in (header.name, *header.also, *header.unites)
}
SOMETIMES_EMPTY = {
    header.name: header for header in objects.views() if header.when and header.name in TABLES
}


def test_only_what_is_stored_is_skipped() -> None:
    assert SOMETIMES_EMPTY.keys() == {header.name for header in objects.views() if header.when}
    assert len(SOMETIMES_EMPTY) >= 5


# Those with rows in runs of other systems than of one without stamps, with losses.
ELSEWHERE = {
    ("agnocast", "jazzy"): {"derive.link_transport_agnocast"},
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
