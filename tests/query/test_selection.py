"""Rows that somebody chose, on a database of the simulated robot."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.golden import fill_case
from support.thorough import few, thorough

from msgflow.database import Database
from msgflow.errors import QueryError, UsageError
from msgflow.query.catalogue import load_queries
from msgflow.query.selection import KINDS, PATH, columns_of, make_selection, values_of

PLANNER = "/planning/planner"
_ANSWERS: dict[str, list[dict[str, Any]]] = {}


@pytest.fixture(scope="module")
def database(simulated: Callable[..., Path]) -> Iterator[Database]:
    with Database(simulated("demo", 0.1)) as opened:
        yield opened


def rows(database: Database, name: str, **given: Any) -> list[dict[str, Any]]:
    """What a query gives, which is asked once: nothing changes the database."""
    asked = f"{database.path} {name} {sorted(given.items())}"
    if asked not in _ANSWERS:
        _ANSWERS[asked] = database.query(name, **given).to_arrow().to_pylist()
    return _ANSWERS[asked]


def test_names_choose_rows(database: Database) -> None:
    every = rows(database, "waits")
    assert rows(database, "waits", node=PLANNER) == [row for row in every if row["node"] == PLANNER]
    both = rows(database, "waits", node=[PLANNER, "/camera/*"], callback="Timer(*")
    assert [(row["node"], row["callback"]) for row in both] == [
        ("/camera/driver", "Timer(33.333 ms)")
    ]
    assert {row["host"] for row in rows(database, "executor-usage", host="robot-base")} == {
        "robot-base"
    }
    pairs = rows(database, "clocks-pair", host="robot-base")
    assert len(pairs) == 2
    # A row with one of several names in a list.
    (node, *_) = (row["node"] for row in rows(database, "waits-pair"))
    waiting = rows(database, "waits-pair", node=node)
    assert waiting
    assert all(node in (row["node"], row["meanwhile_node"]) for row in waiting)


def test_topics_by_glob_and_in_one_text(database: Database) -> None:
    names = [
        row["topic_name"]
        for row in rows(database, "topics-delivery", topic="/imu/*, /camera/image")
    ]
    assert names == ["/camera/image", "/imu/data"]
    assert rows(database, "topics-unmatched", topic="/imu/data", internal=True) == [
        row
        for row in rows(database, "topics-unmatched", internal=True)
        if row["topic_name"] == "/imu/data"
    ]


def test_paths_by_topics_and_nodes(database: Database) -> None:
    every = [row["path"] for row in rows(database, "e2e-latency")]
    assert len(every) == 4

    def paths(**given: Any) -> list[str]:
        return [row["path"] for row in rows(database, "e2e-latency", **given)]

    assert paths(via=PLANNER) == [path for path in every if PLANNER in path]
    assert paths(via=[PLANNER, "/camera/*"]) == [
        path for path in every if PLANNER in path and "/camera/" in path
    ]
    assert paths(without="/planning/*") == [path for path in every if "/planning/" not in path]
    assert paths(via=every[1]) == [every[1]]
    assert paths(without=every[1]) == [every[0], *every[2:]]
    assert paths(from_="/lidar/*") == [path for path in every if path.startswith("/lidar/")]
    assert paths(from_="/camera/driver,/imu/driver") == [
        path for path in every if path.startswith(("/camera/driver", "/imu/driver"))
    ]
    ending = paths(to="/perception/tracker")
    assert [path.rpartition(" → ")[2] for path in ending] == ["/perception/tracker"]
    middle = rows(database, "e2e-latency", from_="/perception/tracker", to="/base/*")
    assert [row["path"].partition(" → ")[0] for row in middle] == ["/perception/tracker"]
    assert middle[0]["reached"] > 0


@pytest.mark.parametrize("query", ["e2e-latency", "critical-path"])
@pytest.mark.parametrize("word", ["via", "without", "from", "to"])
def test_a_path_has_places_of_the_run(database: Database, query: str, word: str) -> None:
    """It stands in place of places that are visited, not of those where flows start or end."""
    (path, *_) = [row["path"] for row in rows(database, "e2e-latency")]
    start = path.partition(" → ")[0]
    with pytest.raises(UsageError, match=r"there is no such topic or node .*/typo"):
        database.query(query, **{word: [f"{start} → /typo"]})
    # What has no name is no place, and a service stands in brackets.
    known = [f"(not traced) → (?) → ? → ({start}) → {start}"]
    if word in ("via", "without"):
        database.query(query, **{word: known})
    else:
        with pytest.raises(UsageError, match="no topic or node in the run fits"):
            database.query(query, **{word: known})


def test_a_path_that_leaves_no_rows_is_not_written_out(database: Database) -> None:
    (path, *_) = [row["path"] for row in rows(database, "e2e-latency")]
    nothing = database.query("e2e-latency", via=[path], where="roots < 0")
    assert nothing.notes[-1] == "nothing fits this path --where 'roots < 0': try with less"


def test_topics_are_as_they_were_before_there_were_nodes(database: Database) -> None:
    """A path from a topic is that from its publisher, unless that has others."""
    by_topic = rows(database, "flows", from_="/camera/image", to="/perception/detections")
    by_node = rows(database, "flows", from_="/camera/driver", to="/perception/tracker")
    assert by_topic == by_node
    assert len(by_topic) > 10


def test_sorting_and_limits(database: Database) -> None:
    every = rows(database, "flows")
    slowest = rows(database, "flows", slowest=3)
    reached = sorted(
        (row["latency_ns"] for row in every if row["latency_ns"] is not None), reverse=True
    )
    assert [row["latency_ns"] for row in slowest] == reached[:3]
    assert rows(database, "flows", sort="latency:desc", limit=3) == slowest
    # The order of the query decides between equals; what is missing comes last.
    by_status = rows(database, "flows", sort=["status", "take_id:asc"])
    assert by_status == sorted(
        every, key=lambda row: (row["status"], row["take_id"] is None, row["take_id"] or 0)
    )
    result = database.query("flows", limit=5)
    assert result.to_arrow().to_pylist() == every[:5]
    assert f"5 of {len(every):,} rows" in result.notes


def test_hidden_rows_do_not_count_to_the_limit(database: Database) -> None:
    result = database.query("topics", limit=2)
    assert len(result) == 2
    assert "2 of 10 rows" in result.notes
    assert "2 internal rows are hidden; --internal shows them" in result.notes
    none = database.query("topics", where="topic_name = '/rosout'")
    assert len(none) == 0
    assert "1 internal row is hidden; --internal shows them" in none.notes
    assert none.columns == result.columns


def test_conditions(database: Database) -> None:
    every = rows(database, "waits")
    assert rows(database, "waits", where="count > 50 AND node LIKE '/imu%'") == [
        row for row in every if row["count"] > 50 and row["node"].startswith("/imu")
    ]
    assert len(rows(database, "waits", where="true -- all of them")) == len(every)
    inner = "node IN (SELECT full_name FROM main.node WHERE name = 'planner')"
    assert {row["node"] for row in rows(database, "waits", where=inner)} == {PLANNER}


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ("count >", "--where is no condition in SQL"),
        ("count > 1; DROP TABLE store.node", "--where is no condition in SQL"),
        ("count > 1) OR (true", "--where is no condition in SQL"),
        ("count > 1, node", "--where is no condition in SQL"),
        ("count > 1 AS x", "--where is no condition in SQL"),
        ("true FROM main.node", "--where is no condition in SQL"),
        ("true ORDER BY 1", "--where is no condition in SQL"),
        ("true UNION SELECT true", "--where is no condition in SQL"),
        ("", "--where is no condition in SQL"),
        ("count > $runs", "--where takes no parameters"),
        ("count > ?", "--where takes no parameters"),
        (
            "(SELECT count(*) FROM read_csv('/etc/passwd')) > 0",
            "--where cannot be evaluated: Cannot access",
        ),
        ("getenv('HOME') = ''", "--where cannot be evaluated"),
        ("node", "--where cannot be evaluated"),
        ("cont > 1", "--where cannot be evaluated"),
        ("*", "--where cannot be evaluated"),
    ],
)
def test_what_is_no_condition_is_refused(database: Database, where: str, message: str) -> None:
    with pytest.raises(UsageError) as raised:
        database.query("waits", where=where)
    assert message in raised.value.message
    assert raised.value.hint


def test_the_nearest_column_is_named(database: Database) -> None:
    for given in ({"where": "cont > 1"}, {"sort": "cont"}):
        with pytest.raises(UsageError) as raised:
            database.query("waits", **given)  # type: ignore[arg-type]
        assert "did you mean count" in (raised.value.hint or "")


@pytest.mark.parametrize(
    ("query", "given", "message"),
    [
        ("clocks", {"node": "/a"}, "clocks has no column with a node — --node /a"),
        ("info", {"via": "/a"}, "info has no paths — --via /a"),
        (
            "e2e-latency",
            {"slowest": 3},
            "e2e-latency has no --slowest: its rows have no duration of their own",
        ),
        ("flows", {"slowest": 3, "limit": 3}, "--slowest N goes without --sort and --limit"),
        ("flows", {"sort": "latency:down"}, "rows are sorted asc or desc — latency:down"),
        ("flows", {"limit": 0}, "--limit is at least 1 — 0"),
        ("flows", {"limit": "3"}, "--limit is at least 1 — 3"),
        ("waits", {"node": 3}, "node is a name or several — 3"),
        ("waits", {"node": "\x1b31m"}, "there is no such node in the run"),
        ("e2e-latency", {"from_": "/camera/nothing*"}, "no topic or node in the run fits"),
    ],
)
def test_what_a_query_does_not_have_is_said(
    database: Database, query: str, given: dict[str, Any], message: str
) -> None:
    with pytest.raises(UsageError) as raised:
        database.query(query, **given)
    assert message in raised.value.message


NAMES = [header.name for header in load_queries()]
# They have the options of the query that they are variants of.
VARIANTS = {name for name in NAMES if any(name.startswith(f"{other}-") for other in NAMES)}


@pytest.mark.parametrize("one_by_one", few([False, True], False))
@pytest.mark.parametrize("of_variants", few([False, True], False))
@pytest.mark.parametrize("part", few(range(4), 0))
def test_every_query_can_be_wrapped(
    database: Database, *, of_variants: bool, one_by_one: bool, part: int
) -> None:
    """The options that a header promises work, and choose no row that was not there."""
    for header in load_queries():
        if (header.name in VARIANTS) != of_variants or NAMES.index(header.name) % 4 != part:
            continue
        given: dict[str, Any] = {"where": "true", "limit": 100_000, "internal": True}
        every = rows(database, header.name, internal=True)
        if one_by_one:
            assert rows(database, header.name, **given) == every, header.name
        names = {kind: "*" for kind in KINDS if columns_of(header, kind)}
        if columns_of(header, PATH):
            names["via"] = "*"
        for chosen in [{kind: name} for kind, name in names.items()] if one_by_one else [names]:
            kept = rows(database, header.name, **given, **chosen)
            assert chosen or kept == every, header.name
            assert len(kept) <= len(every)
            assert all(row in every for row in kept[:5])


def test_words_of_a_selection() -> None:
    assert values_of(None) == ()
    assert values_of("/a, /b,") == ("/a", "/b")
    assert values_of(["/a,/b", "/c"]) == ("/a,/b", "/c")
    assert make_selection({"via": "/a", "without": ["/b"]}).names() == {"visit": ("/a", "/b")}


def latencies(database: Database, **given: Any) -> list[int]:
    return sorted(
        (
            row["latency_ns"]
            for row in rows(database, "flows", case="every_pair", **given)
            if row["latency_ns"] is not None
        ),
        reverse=True,
    )


@pytest.mark.thorough
def test_the_slowest_flows_piece_by_piece(database: Database) -> None:
    every = latencies(database, to="/base/motors")
    for detail in ("short", "full"):
        pieces = rows(database, "critical-path", to="/base/motors", slowest=3, detail=detail)
        for rank, latency in enumerate(every[:3], start=1):
            own = [row for row in pieces if row["rank"] == rank]
            assert {row["latency_ns"] for row in own} == {latency}
            assert sum(row["duration_ns"] for row in own) == latency
            moments = [row["at_ns"] for row in own if row["at_ns"] is not None]
            assert moments == sorted(moments)
        assert {row["rank"] for row in pieces} == {1, 2, 3}


@pytest.mark.thorough
def test_short_pieces_are_one_line_and_layers_one_piece(database: Database) -> None:
    short = rows(database, "critical-path", to="/base/motors")
    full = rows(database, "critical-path", to="/base/motors", detail="full")
    assert {"rclcpp", "rcl"} <= {row["activity"] for row in full}
    assert [row["activity"] for row in short].count("rest") == 1
    assert short[-1]["activity"] == "rest"
    kept = [row for row in full if row["duration_ns"] >= 0.01 * row["latency_ns"]]
    # Others are sums of short ones that are alike, which begin at several moments.
    moments = [row["at_ns"] for row in short if row["at_ns"] is not None]
    assert moments == [row["at_ns"] for row in kept]
    assert sum(row["duration_ns"] for row in short) == full[0]["latency_ns"]
    folded = rows(database, "critical-path", to="/base/motors", by="part")
    layers = sum(r["duration_ns"] for r in full if r["activity"] in ("rclcpp", "rcl", "rmw"))
    (publish,) = (row for row in folded if row["activity"] == "publish")
    assert publish["duration_ns"] == layers
    assert publish["pieces"] == [row["activity"] for row in full].count("rcl") >= 3


@pytest.mark.thorough
def test_totals_add_up(database: Database) -> None:
    full = rows(database, "critical-path", to="/base/motors", detail="full")
    by_node = rows(database, "critical-path", to="/base/motors", by="node")
    for row in by_node:
        own = [piece["duration_ns"] for piece in full if piece["node"] == row["node"]]
        assert row["duration_ns"] == sum(own)
    assert sum(row["duration_ns"] for row in by_node) == full[0]["latency_ns"]
    totals = [row["duration_ns"] for row in by_node]
    assert totals == sorted(totals, reverse=True)


# Quantiles of other flows: tests/flow/test_end_to_end.py.
@pytest.mark.thorough
@pytest.mark.parametrize(("at", "share"), [("median", 50), ("p90", 90), ("p95", 95), ("max", 100)])
def test_the_flow_at_a_quantile(database: Database, at: str, share: int) -> None:
    every = latencies(database, to="/base/motors")[::-1]
    found = rows(database, "critical-path", to="/base/motors", quantile=at)
    assert found[0]["latency_ns"] == every[-(-share * len(every) // 100) - 1]


@pytest.mark.thorough
def test_flows_through_and_by_their_end(database: Database) -> None:
    lidar = rows(database, "critical-path", via="/lidar/driver, /planning/*")
    assert lidar[0]["node"] == "/lidar/driver"
    assert lidar[0]["latency_ns"] == latencies(database, via="/lidar/driver")[0]
    other = rows(database, "critical-path", without=["/camera/*", "/lidar/points"])
    assert other[0]["latency_ns"] == latencies(database, without=["/camera/*", "/lidar/points"])[0]
    (slowest,) = rows(database, "flows", slowest=1)
    assert rows(database, "critical-path", take=slowest["take_id"]) == rows(
        database, "critical-path"
    )
    with pytest.raises(UsageError, match="there is no such take in the run — 999999"):
        database.query("critical-path", take=999_999)
    with pytest.raises(UsageError, match="there is no such topic or node in the run"):
        database.query("critical-path", via="/lidar/drive")


@pytest.mark.parametrize(
    ("short", "whole"),
    [
        ("flow_path([1])", "flow_path([1], NULL, NULL, max_depth := 32, max_paths := 1000)"),
        (
            "end_to_end([1])",
            "end_to_end([1], NULL, NULL, 'callback_start', 'callback_end',"
            " -9223372036854775808, 9223372036854775807)",
        ),
        thorough(
            "end_to_end_part([1])",
            "end_to_end_part([1], NULL, NULL, 'callback_start', 'callback_end', 0,"
            " 9223372036854775807, 'first')",
        ),
        thorough(
            "critical_path([1])",
            "critical_path([1], NULL, NULL, 'callback_start', 'callback_end', 0,"
            " 9223372036854775807, most_flows := 1)",
        ),
    ],
)
def test_macros_need_no_more_than_the_runs(database: Database, short: str, whole: str) -> None:
    found = database.sql(f"FROM {short} ORDER BY ALL").to_arrow()
    assert found.num_rows > 4
    assert found == database.sql(f"FROM {whole} ORDER BY ALL").to_arrow()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ("end_to_end([1], from_event := 'start')", "from_event is one of callback_start, publish"),
        ("end_to_end([1], to_event := NULL)", "to_event is one of take, callback_start"),
        ("comparison('nodes', 1, 1)", "what is one of paths, ends, callbacks, topics, not nodes"),
        thorough(
            "comparison(NULL, 1, 1)", "what is one of paths, ends, callbacks, topics, not NULL"
        ),
        (
            "comparison('paths', 1, 1, wanted_case := 'fist')",
            "wanted_case is one of first, last, newest, every_pair, not fist",
        ),
        thorough(
            "end_to_end_part([1], flow_case := 'fist')", "flow_case is one of first, last, newest"
        ),
        thorough("critical_path([1], to_event := 'end')", "not end"),
    ],
)
def test_words_that_macros_do_not_know_are_errors(
    database: Database, call: str, message: str
) -> None:
    with pytest.raises(QueryError) as raised:
        database.sql(f"SELECT count(*) FROM {call}")
    assert message in raised.value.message


def test_what_left_nothing_is_said(database: Database) -> None:
    """Each name is one of the run, no path has both."""
    nothing = database.query(
        "e2e-latency", to="/base/motors", without=["/perception/*", "/lidar/*"]
    )
    assert len(nothing) == 0
    without = "--without '/perception/*' --without '/lidar/*'"
    assert f"nothing fits --to /base/motors {without}: try with less" in nothing.notes
    assert "nothing fits" not in " ".join(database.query("e2e-latency", to="/base/motors").notes)
    missed = database.query("callbacks", where="count < 0")
    assert missed.notes[-1] == "nothing fits --where 'count < 0': try with less"


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("start", "end", "why"),
    [
        (
            "/boxes",
            "/viewer",
            "flows from /boxes end at /fusion (on /boxes), and those to /viewer begin at /tracker:"
            " msgflow suggest links",
        ),
        thorough(
            "/boxes",
            "/objects",
            "flows from /boxes end at /fusion (on /boxes), which publishes towards /objects:"
            " msgflow suggest links",
        ),
        thorough(
            "/boxes",
            "/path",
            "flows from /boxes end at /fusion (on /boxes), and nothing arrives at /path:"
            " msgflow suggest links",
        ),
        thorough(
            "/tracks",
            "/boxes",
            "flows from /tracks end at /viewer (on /tracks), and those to /boxes begin at /camera",
        ),
        thorough(
            "/imu",
            "/odom",
            "flows from /imu end at /driver (on /plan), and those to /odom begin at /base:"
            " a link may be missing (msgflow links apply FILE)",
        ),
        thorough("/result", "/path", "no message of /result was received"),
    ],
)
def test_why_no_path_leads_from_one_place_to_another_is_said(
    fresh_database: Path, start: str, end: str, why: str
) -> None:
    case = Path(__file__).parents[1] / "schema" / "cases" / "main.dead_end" / "kept_messages.case"
    with duckdb.connect(str(fresh_database)) as con:
        fill_case(con, case)
    with Database(fresh_database) as database:
        for query in ("e2e-latency", "path-breakdown", "critical-path"):
            notes = database.query(query, from_=start, to=end).notes
            assert notes == [f"nothing fits --from {start} --to {end}: {why}"]
        there = database.query("e2e-latency", from_="/imu", to="/plan", where="reached < 0")
        assert there.notes[-1].endswith("--where 'reached < 0': try with less")
