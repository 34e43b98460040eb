"""What windows teach about nodes of rclpy, and that it counts in those that doubt it."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pytest
from support.thorough import thorough

from msgflow.clocks.clocks_file import read_clock_sync
from msgflow.database import Database
from msgflow.links.links_file import read_links
from msgflow.watch.follow import watch_finished
from msgflow.watch.learned_answers import LearnedAnswers, with_learned
from msgflow.watch.watcher import Watcher
from msgflow.watch.window_database import WindowDatabase

NODE_NAME = Path(__file__).parents[2] / "schema" / "public" / "node_name.sql"
SECOND = 1_000_000_000
TABLES = """
CREATE SCHEMA store;
CREATE TABLE store.host AS SELECT 1 AS host_id, 'robot' AS hostname;
CREATE TABLE store.process AS SELECT 1 AS process_id, 1 AS host_id, 42 AS pid;
CREATE TABLE store.node AS SELECT 1 AS node_id, 1 AS process_id, '/filter' AS full_name;
CREATE TABLE store.publisher AS
SELECT 1 AS publisher_id, 1 AS node_id, '/filtered' AS topic_name, false AS is_internal;
CREATE TABLE store.subscription AS
SELECT 1 AS subscription_id, '/scan' AS topic_name, false AS is_internal;
CREATE TABLE store.link_causal (
    kind VARCHAR, publisher_id INT, subscription_id INT, candidate_count INT
);
"""


def test_what_most_windows_have_shown_counts_where_one_doubts_it() -> None:
    answers = LearnedAnswers()

    def doubted(*candidates: int) -> str | None:
        with duckdb.connect() as con:
            con.execute(TABLES)
            con.execute(NODE_NAME.read_text())
            rows = [("take_adjacent", 1, 1, count) for count in candidates]
            con.executemany("INSERT INTO store.link_causal VALUES (?, ?, ?, ?)", rows)
            return answers.doubted(con)

    # Nothing is known of it yet.
    assert doubted(2, 2, 2) is None
    assert [doubted(1, 1, 2), doubted(1, 2), doubted(1)] == [None] * 3
    learned = doubted(1, 2, 2)
    assert learned is not None
    (link,) = with_learned(None, learned).links
    assert (link.kind, link.node.value) == ("direct", "/filter")
    assert (link.process.value, link.host.value) == ("42", "robot")
    assert ([each.value for each in link.inputs], [each.value for each in link.outputs]) == (
        ["/scan"],
        ["/filtered"],
    )
    of_user = "links: [{kind: direct, node: /filter, inputs: [/scan], outputs: [/rosout]}]"
    both = with_learned(read_links(Path("links.yaml"), of_user), learned).links
    assert [each.outputs[0].value for each in both] == ["/rosout", "/filtered"]
    # As many windows doubt it now as have shown it.
    assert doubted(2) is not None
    assert doubted(2) is None


@pytest.mark.thorough
@pytest.mark.parametrize(
    "of_user",
    [
        thorough(None, id="alone"),
        pytest.param(
            "links: [{kind: direct, node: /filter, inputs: [/scan], outputs: [/rosout]}]",
            id="beside_others",
        ),
        thorough(
            "links: [{kind: direct, node: /later, inputs: [/scan], outputs: [/filtered]}]",
            id="beside_others_that_do_not_fit",
        ),
    ],
)
def test_what_is_learned_is_declared(
    shared_traces: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, of_user: str | None
) -> None:
    """Here the contrary of what is true, to see it, also in what is kept of a window."""
    declared = "links: [{kind: independent, node: /filter, inputs: [/scan], outputs: [/filtered]}]"
    monkeypatch.setattr(LearnedAnswers, "doubted", lambda self, con: declared)
    database = WindowDatabase(tmp_path / "window.duckdb", clock_sync="none")
    watcher = Watcher(
        window_ns=8 * SECOND,
        step_ns=8 * SECOND,
        late_ns=8 * SECOND,
        links=None if of_user is None else read_links(Path("links.yaml"), of_user),
        clocks=read_clock_sync("none"),
        note=print,
        database=database,
    )
    (report,) = watch_finished(shared_traces / "real_rotate", watcher)
    database.prepare()
    database.show()
    with Database(database.path) as opened:
        paths = opened.query("e2e-latency").to_arrow()["path"].to_pylist()
    assert not [path for path in paths if "/scan" in path and "/filtered" in path]
    reached = {path["path"]: path["reached"] for path in report.paths if path["reached"]}
    assert set(reached) == {"/source → /scan → /filter", "/filter → /filtered → /sink"}
