from __future__ import annotations

import re
from pathlib import Path

import duckdb
import pytest

from msgflow.db import objects
from msgflow.errors import QueryError, UsageError
from msgflow.query.catalogue import load_query
from msgflow.query.runner import Steps, bind, run_query
from msgflow.query.selection import make_selection
from msgflow.run.slice import Slice
from msgflow.sql.header import Header, parse
from msgflow.sql.statement import RECORDED, Statements, recorded
from msgflow.sql.value import Value

PARAMS = """\
-- description: x
-- param: from VARCHAR = NULL  Text
-- param: case VARCHAR {first|last} = 'first'  Choice
-- param: depth BIGINT  Has to be given
SELECT 1
"""
QUERY = """\
-- description: x
-- param: channel VARCHAR = NULL  Only this one
-- column: topic VARCHAR [topic]  Topic
-- column: start_ns BIGINT [epoch ns]  When
-- column: is_internal BOOLEAN  Hidden
SELECT topic, start_ns, is_internal
FROM message
WHERE list_contains($runs, run_id)
    AND start_ns BETWEEN $start_ns AND $end_ns
    AND ($channel IS NULL OR topic = $channel)
ORDER BY start_ns
"""


@pytest.fixture
def connection() -> duckdb.DuckDBPyConnection:
    con = duckdb.connect()
    con.execute("CREATE TABLE run AS SELECT 1 AS run_id, 'first' AS name, 100::BIGINT AS start_ns")
    con.execute("INSERT INTO run VALUES (2, 'second', 1000000000)")
    con.execute("ALTER TABLE run ADD COLUMN end_ns BIGINT")
    con.execute("ALTER TABLE run ADD COLUMN labels VARCHAR[]")
    con.execute("UPDATE run SET end_ns = start_ns + 2000000000")
    con.execute(
        "CREATE TABLE message AS SELECT * FROM (VALUES "
        "(1, '/a', 100::BIGINT, false), (1, '/b', 200, false), (1, '/rosout', 300, true), "
        "(1, '/c', 400, NULL), (2, '/a', 1000000000, false), (2, '/a', 2500000000, false)"
        ") AS t (run_id, topic, start_ns, is_internal)"
    )
    con.execute("CREATE TABLE simulated_time (run_id BIGINT, at_ns BIGINT, simulated_ns BIGINT)")
    con.execute(
        "CREATE TABLE finding (run_id BIGINT, name VARCHAR, layer VARCHAR, subject VARCHAR, "
        "detail VARCHAR)"
    )
    con.execute("CREATE TABLE thread_state (run_id BIGINT)")
    con.execute("CREATE TABLE stack_sample (run_id BIGINT)")
    con.execute("CREATE TABLE host_usage (run_id BIGINT)")
    con.execute("CREATE SCHEMA store")
    con.execute("CREATE TABLE store.simulated_time AS FROM simulated_time")
    con.execute("CREATE SCHEMA derive")
    (together,) = (each for each in objects.views() if each.name == "derive.clock_group_id")
    con.execute(together.body)
    return con


def header(text: str) -> Header:
    return parse(text, Path("example.sql"))


def starts(con: duckdb.DuckDBPyConnection, **options: object) -> list[int]:
    parameters, internal = options.pop("parameters", {}), options.pop("internal", False)
    part = Slice(**options)  # type: ignore[arg-type]
    result = run_query(con, header(QUERY), parameters, part, internal=internal)  # type: ignore[arg-type]
    return result.to_arrow()["start_ns"].to_pylist()


def test_the_latest_run_is_the_default(connection: duckdb.DuckDBPyConnection) -> None:
    assert starts(connection) == [1_000_000_000, 2_500_000_000]
    result = run_query(connection, header(QUERY), {})
    assert [run.name for run in result.runs] == ["second"]


def test_runs_window_and_parameters_select(connection: duckdb.DuckDBPyConnection) -> None:
    assert starts(connection, run="first") == [100, 200, 400]
    assert starts(connection, run="all") == [100, 200, 400, 1_000_000_000, 2_500_000_000]
    assert starts(connection, run="first", start=150, end="300ns") == [200, 400]
    assert starts(connection, start="1.0") == [2_500_000_000]
    assert starts(connection, run="first", parameters={"channel": "/b"}) == [200]


def test_internal_rows_are_hidden_and_counted(connection: duckdb.DuckDBPyConnection) -> None:
    hidden = run_query(connection, header(QUERY), {}, Slice("first"))
    assert hidden.columns == ("topic", "start_ns")
    assert hidden.notes == ["1 internal row is hidden; --internal shows them"]
    shown = run_query(connection, header(QUERY), {}, Slice("first"), internal=True)
    assert shown.to_arrow()["is_internal"].to_pylist() == [False, False, True, None]
    assert shown.notes == []


def test_a_database_without_runs_gives_nothing_and_says_so(
    connection: duckdb.DuckDBPyConnection,
) -> None:
    connection.execute("DELETE FROM run")
    result = run_query(connection, header(QUERY), {})
    assert len(result) == 0
    assert result.notes == ["the database holds no run yet"]


@pytest.mark.parametrize(
    ("run", "start", "end", "note"),
    [
        (
            "second",
            "3",
            None,
            "the run has nothing in this time window: it lasts 2.000 s, from 1970",
        ),
        ("second", None, 1_000_000_000, "the run has nothing in this time window"),
        ("all", 3_000_000_001, None, "none of the runs has anything in this time window"),
        ("second", 3_000_000_000, None, None),
        ("second", None, 1_000_000_001, None),
        ("all", 2_500_000_000, None, None),
    ],
)
def test_a_window_without_data_is_said(
    connection: duckdb.DuckDBPyConnection,
    run: str,
    start: str | int | None,
    end: int | None,
    note: str | None,
) -> None:
    result = run_query(connection, header(QUERY), {}, Slice(run, start, end), internal=True)
    assert [said.startswith(note or "") for said in result.notes] == (
        [] if note is None else [True]
    )


def test_a_query_without_a_window_refuses_one(connection: duckdb.DuckDBPyConnection) -> None:
    plain = header("-- description: x\nSELECT 1 AS one\n")
    with pytest.raises(UsageError, match="no time window — example"):
        run_query(connection, plain, {}, Slice(start="0"))
    assert run_query(connection, plain, {}).to_arrow().to_pylist() == [{"one": 1}]


def test_a_query_that_fails_is_named(connection: duckdb.DuckDBPyConnection) -> None:
    failing = header("-- description: x\nSELECT error('too bad')\n")
    with pytest.raises(QueryError, match=r"the query failed: .*too bad.* — example"):
        run_query(connection, failing, {})


NAMED = """\
-- description: x
-- column: what VARCHAR [{kind}]  What
SELECT '/a' AS what, $runs AS runs
"""
TOPICS = """\
-- description: x
-- param: from VARCHAR = NULL  Topic
-- param: to VARCHAR = NULL  Topic
SELECT $from AS first, $to AS last, $runs AS runs
"""


@pytest.fixture
def with_topics(connection: duckdb.DuckDBPyConnection) -> duckdb.DuckDBPyConnection:
    """Run 1 has /camera, /scan and two more, run 2 has /lidar."""
    connection.execute(
        "CREATE TABLE publisher (run_id BIGINT, topic_name VARCHAR, is_internal BOOLEAN)"
    )
    connection.execute(
        "CREATE TABLE subscription (run_id BIGINT, topic_name VARCHAR, is_internal BOOLEAN)"
    )
    connection.execute(
        "INSERT INTO publisher VALUES (1, '/camera', false), (1, '/a', false), (1, '/b', false), "
        "(2, '/lidar', false), (1, NULL, false)"
    )
    connection.execute("INSERT INTO subscription VALUES (1, '/scan', false), (1, '/camera', false)")
    connection.execute("CREATE TABLE node AS SELECT 1 AS run_id, '/driver' AS full_name")
    connection.execute("CREATE TABLE process AS SELECT 1 AS run_id, 'main' AS name, 812 AS pid")
    connection.execute(
        "CREATE TABLE service AS SELECT 1 AS run_id, '/reset' AS service_name, false AS is_internal"
    )
    # Of ROS itself: no hint where there are others, although it comes first by name.
    connection.execute("INSERT INTO service VALUES (1, '/Xyz/get_parameters', true)")
    connection.execute(
        "CREATE TABLE callback_label AS"
        " SELECT 1 AS run_id, '[main 812]' AS node, 'Timer(10 ms)' AS label,"
        " false AS is_internal"
    )
    connection.execute("CREATE TABLE host AS SELECT 1 AS run_id, 'robot' AS hostname")
    (label,) = (one for one in objects.load("public") if one.name == "main.node_label")
    connection.execute(objects.create_statement(label))
    return connection


@pytest.mark.parametrize(
    ("run", "given", "first", "last"),
    [
        ("first", {"from": "/camera", "to": "/scan"}, ["/camera"], ["/scan"]),
        (
            "first",
            {"from": "/cam*, /driver", "to": "[main 812]"},
            ["/cam*", "/driver"],
            ["[main 812]"],
        ),
        ("first", {"from": None, "to": "/reset"}, None, ["/reset"]),
        ("first", {"from": None}, None, None),
        ("all", {"from": "/lidar", "to": "/scan"}, ["/lidar"], ["/scan"]),
        # A name that the run has is no list, whatever is in it; a list is taken as it is.
        ("first", {"from": "/a,/b", "to": "/b,/a"}, ["/a,/b"], ["/b", "/a"]),
        ("first", {"from": ["/a,/b", "/a"], "to": " /s\u2028 "}, ["/a,/b", "/a"], [" /s\u2028 "]),
    ],
)
def test_topics_of_the_chosen_runs_will_do(
    with_topics: duckdb.DuckDBPyConnection,
    run: str,
    given: dict[str, Value],
    first: list[str] | None,
    last: list[str] | None,
) -> None:
    with_topics.execute(
        "INSERT INTO publisher VALUES (1, '/a,/b', false), (1, ' /s\u2028 ', false)"
    )
    (row,) = run_query(with_topics, header(TOPICS), given, Slice(run)).to_arrow().to_pylist()
    assert (row["first"], row["last"]) == (first, last)


@pytest.mark.parametrize(
    ("run", "given", "message", "hint"),
    [
        ("first", {"from": "/camra"}, "in the run — /camra", "did you mean /camera"),
        (
            "first",
            {"to": "/scan,xyz"},
            "in the run — xyz",
            "the topics and nodes are /a, /b, /camera and 4 more (msgflow graph --format table)",
        ),
        ("second", {"from": "/scan"}, "in the run — /scan", "the topics and nodes are /lidar"),
        ("all", {"from_": "/none!"}, "in these runs — /none!", "the topics and nodes are"),
    ],
)
def test_topics_that_no_run_has_are_refused(
    with_topics: duckdb.DuckDBPyConnection,
    run: str,
    given: dict[str, Value],
    message: str,
    hint: str,
) -> None:
    with pytest.raises(UsageError) as raised:
        run_query(with_topics, header(TOPICS), given, Slice(run))
    assert raised.value.message == f"there is no such topic or node {message}"
    assert hint in (raised.value.hint or "")


def test_takes_that_no_run_has_are_refused(connection: duckdb.DuckDBPyConnection) -> None:
    """The take of another run is none of this one."""
    connection.execute("CREATE TABLE take (take_id BIGINT, run_id BIGINT)")
    connection.execute("INSERT INTO take VALUES (7, 1), (8, 2)")
    query = header(
        "-- description: x\n-- param: take BIGINT = NULL  Take\nSELECT $take AS id, $runs AS runs\n"
    )
    for run, given in (("first", 7), ("all", 8), ("first", None)):
        (row,) = run_query(connection, query, {"take": given}, Slice(run)).to_arrow().to_pylist()
        assert row["id"] == given
    for run, number, where in (("first", 8, "the run"), ("all", 9, "these runs")):
        with pytest.raises(UsageError) as raised:
            run_query(connection, query, {"take": number}, Slice(run))
        assert raised.value.message == f"there is no such take in {where} — {number}"
        assert "msgflow query flows" in (raised.value.hint or "")


@pytest.mark.parametrize(
    ("kind", "name", "message"),
    [
        ("topic", "/driver", "there is no such topic in the run — /driver"),
        ("node", "/x*", "no node in the run fits — /x*"),
        ("host", "robo", "there is no such host in the run — robo"),
        ("callback", "Timer(9 ms)", "there is no such callback in the run — Timer(9 ms)"),
    ],
)
def test_names_that_no_run_has_are_refused(
    with_topics: duckdb.DuckDBPyConnection, kind: str, name: str, message: str
) -> None:
    with pytest.raises(UsageError) as raised:
        run_query(
            with_topics,
            header(NAMED.format(kind=kind)),
            {},
            Slice("first"),
            selection=make_selection({kind: name}),
        )
    assert raised.value.message == message


def test_a_pattern_may_be_a_name_with_brackets(
    with_topics: duckdb.DuckDBPyConnection,
) -> None:
    """Of a process whose node is not known: as a pattern it would be one of these characters."""
    query = header(NAMED.format(kind="node").replace("'/a'", "'[main 812]'"))
    selection = make_selection({"node": "[main 812]"})
    assert len(run_query(with_topics, query, {}, Slice("first"), selection=selection)) == 1


def test_a_run_without_topics_has_none(with_topics: duckdb.DuckDBPyConnection) -> None:
    with_topics.execute("DELETE FROM publisher")
    with pytest.raises(UsageError) as raised:
        run_query(with_topics, header(TOPICS), {"to": "/lidar"})
    assert raised.value.hint == "msgflow graph --format table"
    with_topics.execute("DELETE FROM run")
    assert len(run_query(with_topics, header(TOPICS), {"to": "/lidar"})) == 1


@pytest.mark.parametrize(
    ("references", "in_vain", "run", "notes"),
    [
        ((None,), False, "first", []),
        ((1, 1, 1), False, "first", []),
        ((1, None, 1), False, "first", ["the run has 2 clocks"]),
        ((1, 1, 3, 3), True, "first", ["the run has 2 clocks"]),
        ((None, None, None), False, "all", ["run first (1) has 3 clocks"]),
        ((None, None), False, "second", []),
    ],
)
def test_clocks_that_differ_are_named(
    connection: duckdb.DuckDBPyConnection,
    references: tuple[int | None, ...],
    in_vain: bool,
    run: str,
    notes: list[str],
) -> None:
    connection.execute(
        "CREATE TABLE clock (clock_id BIGINT, run_id BIGINT, reference_clock_id BIGINT)"
    )
    connection.executemany("INSERT INTO clock VALUES (?, 1, ?)", enumerate(references, start=1))
    connection.execute("INSERT INTO clock VALUES (9, 2, NULL)")
    connection.execute("ALTER TABLE clock ADD COLUMN uncertainty_ns BIGINT")
    connection.execute("CREATE TABLE host (host_id BIGINT, clock_id BIGINT, hostname VARCHAR)")
    connection.execute("CREATE TABLE clock_uncertainty (clock_id BIGINT, uncertainty_ns BIGINT)")
    connection.execute("CREATE SCHEMA IF NOT EXISTS store")
    connection.execute("CREATE TABLE store.run (run_id BIGINT, clock_sync VARCHAR)")
    if in_vain:
        connection.execute("INSERT INTO store.run VALUES (1, 'messages')")
    query = QUERY.replace("-- param", "-- note: clocks\n-- param")
    rest = (
        " that are not synchronised: times between their hosts are not comparable;"
        f" msgflow clocks apply {'FILE' if in_vain else 'messages'}"
    )
    result = run_query(connection, header(query), {}, Slice(run), internal=True)
    assert result.notes == [f"{note}{rest}" for note in notes]
    assert run_query(connection, header(QUERY), {}, Slice(run), internal=True).notes == []
    late = run_query(connection, header(query), {"channel": "/none"}, Slice(run))
    assert late.notes == []


def test_processes_that_record_no_callbacks_are_named(
    connection: duckdb.DuckDBPyConnection,
) -> None:
    connection.execute(
        "INSERT INTO finding BY NAME SELECT * FROM (VALUES "
        "(1, 'process_without_rclcpp', 'b 8 on vm'), (1, 'process_without_rclcpp', 'a 7 on vm'), "
        "(1, 'started_late', 'c 9 on vm'), (2, 'process_without_rclcpp', 'd 1 on vm'), "
        "(3, 'started_late', 'c 9 on vm')) AS t (run_id, name, subject)"
    )
    noted = header(QUERY.replace("-- param", "-- note: callbacks\n-- param"))
    rest = "msgflow query path-breakdown has their times from take to publication"

    def notes(run: str) -> list[str]:
        return list(run_query(connection, noted, {}, Slice(run=run)).notes[-1:])

    assert notes("first") == [
        "2 processes record no callbacks, without rclcpp (as those of rclpy): a 7 on vm, b 8 on vm;"
        f" {rest}"
    ]
    assert notes("second") == [
        f"1 process records no callbacks, without rclcpp (as those of rclpy): d 1 on vm; {rest}"
    ]
    connection.execute("DELETE FROM finding WHERE name <> 'started_late'")
    assert notes("second") == []
    assert not run_query(connection, header(QUERY), {}, Slice(run="first")).notes[1:]


def test_a_layer_that_was_not_traced_is_the_reason_for_no_rows(
    connection: duckdb.DuckDBPyConnection,
) -> None:
    connection.execute(
        "INSERT INTO finding BY NAME SELECT * FROM (VALUES "
        "(1, 'missing_layer', 'requests', 'no request'), (2, 'missing_layer', 'requests', 'none'), "
        "(1, 'missing_layer', 'goals', 'no goal'), (1, 'started_late', 'requests', 'late')) "
        "AS t (run_id, name, layer, detail)"
    )
    connection.execute("CREATE TABLE clock AS SELECT 1 AS run_id")

    def notes(run: str, where: str | None = "start_ns < 0", layer: str = "requests") -> list[str]:
        noted = header(QUERY.replace("-- param", f"-- note: {layer}\n-- param"))
        narrowed = make_selection({"where": where})
        return list(run_query(connection, noted, {}, Slice(run), selection=narrowed).notes)

    assert notes("first") == ["no request"]
    assert notes("all", layer="goals") == ["run first (1): no goal"]
    assert notes("all") == ["run first (1): no request", "run second (2): none"]
    assert "no request" not in notes("first", None)
    connection.execute("DELETE FROM finding WHERE layer = 'requests'")
    assert notes("first") == ["nothing fits --where 'start_ns < 0': try with less"]


@pytest.mark.parametrize(
    ("note", "table", "missing"),
    [
        (
            "kernel",
            "thread_state",
            "the kernel was not traced: msgflow record --kernel, see docs/scheduling.md",
        ),
        (
            "samples",
            "stack_sample",
            "no functions were sampled: msgflow record --profile 99, see docs/functions.md",
        ),
        (
            "usage",
            "host_usage",
            "the system was not sampled: msgflow record does, see docs/record.md",
        ),
    ],
)
def test_an_empty_answer_says_whether_what_it_reads_was_recorded(
    connection: duckdb.DuckDBPyConnection, note: str, table: str, missing: str
) -> None:
    connection.execute(f"INSERT INTO {table} VALUES (2)")
    connection.execute("CREATE TABLE clock AS SELECT 1 AS run_id")
    noted = header(QUERY.replace("-- param", f"-- note: {note}\n-- param"))

    def notes(run: str, channel: str) -> list[str]:
        return run_query(connection, noted, {"channel": channel}, Slice(run=run)).notes

    assert notes("first", "/nowhere") == [missing]
    assert notes("second", "/nowhere") == []
    assert missing not in notes("first", "/a")


@pytest.mark.parametrize(
    ("uncertainty_ns", "bounds", "wrong_by"),
    [
        (1_500_000, (), "known to ±1.500 ms at best and ±1.500 ms at worst"),
        (1_500_000, (2_000_000, 1_400_000), "known to ±1.400 ms at best and ±2.000 ms at worst"),
        (None, (), "off by as much as the file with their offsets is"),
    ],
)
def test_how_far_corrected_clocks_can_be_wrong_is_said(
    connection: duckdb.DuckDBPyConnection,
    uncertainty_ns: int | None,
    bounds: tuple[int, ...],
    wrong_by: str,
) -> None:
    for statement in (
        "CREATE TABLE clock (clock_id BIGINT, run_id BIGINT, reference_clock_id BIGINT, "
        "uncertainty_ns BIGINT)",
        "CREATE TABLE host (host_id BIGINT, clock_id BIGINT, hostname VARCHAR)",
        "CREATE TABLE clock_uncertainty (clock_id BIGINT, uncertainty_ns BIGINT)",
        "CREATE SCHEMA IF NOT EXISTS store",
        "CREATE TABLE store.run (run_id BIGINT, clock_sync VARCHAR)",
        "INSERT INTO host VALUES (1, 1, 'alpha'), (2, 2, 'beta'), (3, 1, 'inside')",
        "INSERT INTO clock VALUES (1, 1, 1, 0)",
    ):
        connection.execute(statement)
    connection.execute("INSERT INTO clock VALUES (2, 1, 1, ?)", [uncertainty_ns])
    for bound in bounds:
        connection.execute("INSERT INTO clock_uncertainty VALUES (2, ?)", [bound])
    query = QUERY.replace("-- param", "-- note: clocks\n-- param")
    result = run_query(connection, header(query), {}, Slice("first"), internal=True)
    assert result.notes == [f"times between alpha, inside and beta are {wrong_by}; msgflow clocks"]


@pytest.mark.parametrize("given", [1, "1", None])
def test_the_minimum_itself_will_do(given: Value) -> None:
    least = header("-- description: x\n-- param: depth BIGINT {1..} = 3  x\nSELECT 1\n")
    assert bind(least, {"depth": given}) == {"depth": None if given is None else 1}
    for less in (0, "-1"):
        with pytest.raises(UsageError, match=f"--depth is at least 1 — {less}") as raised:
            bind(least, {"depth": less})
        assert raised.value.hint == "msgflow query example --depth 1"


@pytest.mark.parametrize(
    ("given", "bound"),
    [
        ({"depth": "3"}, {"from": None, "case": "first", "depth": 3}),
        ({"depth": 3, "from": "/a"}, {"from": "/a", "case": "first", "depth": 3}),
        ({"depth": 3, "from_": "/a"}, {"from": "/a", "case": "first", "depth": 3}),
        ({"depth": None, "case": "last"}, {"from": None, "case": "last", "depth": None}),
    ],
)
def test_binding(given: dict[str, Value], bound: dict[str, Value]) -> None:
    assert bind(header(PARAMS), given) == bound


@pytest.mark.parametrize(
    ("given", "message", "hint"),
    [
        ({}, "example needs a value for a parameter — depth", "--depth BIGINT"),
        ({"deep": 1}, "has no such parameter — deep", "its parameters are from, case, depth"),
        ({"depth": "deep"}, "--depth takes a whole number — deep", "msgflow query example --help"),
        ({"depth": 1, "case": "middle"}, "--case has no such value — middle", "first or last"),
        ({"depth": 1, "case": "firts"}, "--case has no such value — firts", "did you mean first"),
    ],
)
def test_parameters_that_do_not_fit(given: dict[str, Value], message: str, hint: str) -> None:
    with pytest.raises(UsageError) as raised:
        bind(header(PARAMS), given)
    assert message in raised.value.message
    assert hint in (raised.value.hint or "")


STEPS = """\
-- description: An example.
-- param: least VARCHAR = '/a'  Topics from here on
-- column: run_id BIGINT  Run
-- column: topic VARCHAR  Topic
CREATE OR REPLACE TEMP TABLE example_message AS
SELECT run_id, topic FROM message WHERE list_contains($runs, run_id) AND start_ns >= $start_ns;

-- A comment.
CREATE OR REPLACE TEMP TABLE example_topic AS
SELECT DISTINCT run_id, topic FROM example_message WHERE topic >= $least;

SELECT run_id, topic FROM example_topic WHERE topic < '/r' ORDER BY topic
"""


def test_a_query_goes_in_steps(connection: duckdb.DuckDBPyConnection) -> None:
    asked = header(STEPS)
    assert [step.table for step in asked.steps] == ["example_message", "example_topic"]
    assert asked.has_window
    for _ in range(2):  # What was made on the way is gone.
        result = run_query(connection, asked, {"least": "/b"}, Slice("first"))
        assert result.to_arrow()["topic"].to_pylist() == ["/b", "/c"]
    assert not connection.execute("SELECT * FROM duckdb_tables() WHERE temporary").fetchall()


def test_queries_share_their_steps(connection: duckdb.DuckDBPyConnection) -> None:
    asked = header(STEPS)

    def topics(part: Slice) -> list[str]:
        table = run_query(connection, asked, {}, part, steps=steps).to_arrow()
        return table["topic"].to_pylist()

    with Steps(connection) as steps:
        assert topics(Slice("first")) == ["/a", "/b", "/c"]
        connection.execute("DELETE FROM message WHERE topic = '/b'")
        # With the same values the tables stay; with others all are made again.
        assert topics(Slice("first")) == ["/a", "/b", "/c"]
        assert topics(Slice("first", start=150)) == ["/c"]
        assert topics(Slice("first")) == ["/a", "/c"]
    assert not connection.execute("SELECT * FROM duckdb_tables() WHERE temporary").fetchall()


def test_a_step_made_again_leaves_those_before_it(connection: duckdb.DuckDBPyConnection) -> None:
    asked = header(STEPS)

    def topics(least: str) -> list[str]:
        table = run_query(connection, asked, {"least": least}, Slice("first"), steps=steps)
        return table.to_arrow()["topic"].to_pylist()

    with Steps(connection) as steps:
        assert topics("/a") == ["/a", "/b", "/c"]
        connection.execute("DELETE FROM message WHERE topic = '/b'")
        assert topics("/b") == ["/b", "/c"]
        assert topics("/a") == ["/a", "/b", "/c"]


def test_a_step_is_made_of_what_is_known(
    connection: duckdb.DuckDBPyConnection, tmp_path: Path
) -> None:
    directory = tmp_path / "step"
    directory.mkdir()
    (directory / "example_message.sql").write_text(
        "-- description: What is known.\nSELECT 1::BIGINT AS run_id, '/known' AS topic\n"
    )
    with Steps(connection, Statements(directory)) as steps:
        found = run_query(connection, header(STEPS), {}, Slice("first"), steps=steps)
    assert found.to_arrow()["topic"].to_pylist() == ["/known"]


@pytest.mark.parametrize(
    ("condition", "topics"), [("start_ns < 0", []), ("start_ns > 0", ["/a", "/b", "/c"])]
)
def test_a_step_has_no_rows_where_its_sources_have_none(
    connection: duckdb.DuckDBPyConnection, condition: str, topics: list[str]
) -> None:
    step = f"-- when: message WHERE {condition}\n-- columns: run_id INTEGER, topic VARCHAR\n"
    asked = header(STEPS.replace("-- A comment.\n", step))
    result = run_query(connection, asked, {}, Slice("first"))
    assert result.to_arrow()["topic"].to_pylist() == topics


def test_the_queries_of_flows_make_their_tables_alike() -> None:
    """Else they could not share them."""
    names = ("critical-path", "e2e-latency", "flows", "path-breakdown")
    for table in ("path_chain", "path_outcome", "named_path"):
        steps = [step for name in names for step in load_query(name).steps if step.table == table]
        assert len(steps) == len(names)
        assert len({step.sql for step in steps}) == 1
    arrivals = [
        {step.sql for step in load_query(name).steps if step.table == "exact_arrival"}
        for name in ("path-breakdown", "waits-pair")
    ]
    assert arrivals[0] == arrivals[1] != set()


def test_a_step_that_fails_leaves_nothing(connection: duckdb.DuckDBPyConnection) -> None:
    asked = header(STEPS.replace("DISTINCT run_id", "DISTINCT error('no') AS run_id"))
    with pytest.raises(QueryError, match="no"):
        run_query(connection, asked, {}, Slice("first"))
    assert not connection.execute("SELECT * FROM duckdb_tables() WHERE temporary").fetchall()


def test_what_no_recording_has_is_not_looked_up(small_database: Path) -> None:
    asked = header(
        "-- description: An example.\n-- column: found INTEGER  A row\n"
        "SELECT 1 AS found FROM run WHERE $has_calls AND list_contains($runs, run_id) ORDER BY 1\n"
    )
    with duckdb.connect(str(small_database)) as con:
        con.execute("DELETE FROM store.request")
        assert len(run_query(con, asked, {})) == 0
        columns = con.execute("DESCRIBE store.request").fetchall()
        given = [1 if null == "NO" else None for _, _, null, *_ in columns]
        con.execute(f"INSERT INTO store.request VALUES ({', '.join('?' * len(given))})", given)
        assert len(run_query(con, asked, {})) == 1


def test_all_that_a_recording_may_lack_is_known(small_database: Path) -> None:
    with duckdb.connect(str(small_database)) as con:
        assert recorded(con).keys() == RECORDED.keys()
        assert recorded(con, ["has_gaps"]) == {"has_gaps": False}
        con.execute("INSERT INTO store.gap (run_id, trace_id, kind) VALUES (1, 1, 'pause')")
        assert recorded(con, ["has_pauses", "has_gaps"]) == {"has_pauses": True, "has_gaps": True}
        assert recorded(con, []) == {}


@pytest.mark.parametrize(
    ("table", "rows", "facts"),
    [
        ("store.thread_state", [{}], {"has_kernel"}),
        ("store.thread_usage", [{}], {"has_usage"}),
        ("store.request", [{}], {"has_calls"}),
        ("store.flow_call", [{}], {"has_turns"}),
        ("store.link_causal", [{"kind": "direct"}], set()),
        ("store.link_causal", [{"kind": "queue"}], {"has_turns"}),
        ("derive.executor_size", [{"thread_count": 1}], set()),
        ("derive.executor_size", [{"thread_count": 2}], {"has_teams"}),
        ("store.gap", [{"kind": "loss"}], {"has_gaps"}),
        ("store.gap", [{"kind": "pause"}], {"has_gaps", "has_pauses"}),
        ("store.stamp_clock", [{}], {"has_steps"}),
        ("store.publisher", [{"topic_name": "/a", "is_topic_learned": False}], set()),
        ("store.publisher", [{"is_topic_learned": False}], {"has_unnamed"}),
        ("store.publisher", [{"topic_name": "/a", "is_topic_learned": True}], {"has_unnamed"}),
        ("store.subscription", [{"topic_name": "/a", "is_topic_learned": False}], set()),
        ("store.subscription", [{"is_topic_learned": False}], {"has_unnamed"}),
        ("store.subscription", [{"topic_name": "/a", "is_topic_learned": True}], {"has_unnamed"}),
        ("store.clock", [{}], set()),
        ("store.clock", [{}, {}], {"has_clocks"}),
        ("store.callback_instance", [{"end_ns": 1}], set()),
        ("store.callback_instance", [{}], {"has_open_callbacks"}),
        ("store.orphan_take", [{}], {"has_orphans"}),
        ("store.failed_take", [{}], {"has_failed_takes"}),
        ("store.lifecycle_transition", [{}], {"has_states"}),
    ],
)
def test_what_a_recording_has_follows_from_rows(
    table: str, rows: list[dict[str, object]], facts: set[str]
) -> None:
    tables = {name for text in RECORDED.values() for name in re.findall(r"FROM (\S+?)[ )]", text)}
    assert table in tables
    with duckdb.connect() as con:
        con.execute("CREATE SCHEMA store; CREATE SCHEMA derive")
        for name in tables:
            con.execute(
                f"CREATE TABLE {name} (kind VARCHAR, thread_count BIGINT, topic_name VARCHAR, "
                "is_topic_learned BOOLEAN, end_ns BIGINT, continues_id BIGINT)"
            )
        for row in rows:
            values = [
                "kind", "thread_count", "topic_name", "is_topic_learned", "end_ns", "continues_id"
            ]  # fmt: skip
            marks = ", ".join("?" * len(values))
            con.execute(f"INSERT INTO {table} VALUES ({marks})", [*map(row.get, values)])
        assert {name for name, has in recorded(con).items() if has} == facts
