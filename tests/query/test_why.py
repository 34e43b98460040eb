"""`Database.why` on systems of golden cases."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.golden import fill_case

import msgflow
from msgflow.db.finding import commands_after
from msgflow.errors import NoFlowError
from msgflow.sql.statement import Statements, internal_sql

SECOND = 1_000_000_000
CASES = Path(__file__).parent / "cases"
PATHS = {path.relative_to(CASES).as_posix(): path for path in CASES.glob("*/*.case")}


# Findings about a node on the path, about others, a topic, a process, and all of the run.
FOUND = """
INSERT INTO store.finding
    (run_id, name, process_id, node_id, publishing_node_id, topic_name, layer, subject, count,
     detail)
VALUES
    (1, 'ambiguous_link', NULL, 2, NULL, NULL, NULL, NULL, 1, 'several'),
    (1, 'ambiguous_cause', NULL, 3, NULL, NULL, NULL, '/b', 1, 'of /b'),
    (1, 'message_without_stamp', NULL, NULL, NULL, '/u', NULL, '/t', 1, 'on /t'),
    (1, 'missing_layer', NULL, NULL, NULL, NULL, 'requests', NULL, 9, 'no request'),
    (1, 'missing_layer', NULL, NULL, NULL, NULL, 'goals', 'requests', 9, 'no goal'),
    (1, 'never_taken', NULL, 2, 1, '/u', NULL, 'one → other', 9, 'none');
INSERT INTO store.node (node_id, run_id, process_id, full_name, is_inferred)
VALUES (3, 1, 1, '/c', false)
"""
# The kernel was traced.
THREAD_STATE = """
INSERT INTO store.thread_state (run_id, thread_id, start_ns, end_ns, state)
VALUES (1, 1, 0, 1, 'running')
"""
# By the statement that has sentences.
OTHER_WORDS = {
    "verdict": "SELECT * REPLACE ('not known' AS headline, ['so it is'] AS evidence) FROM ({})",
    "doubt": "SELECT * REPLACE ('not known' AS sentence) FROM ({})",
}
# What they are made of is no sentence.
SENTENCES = {"verdict": ("headline", "evidence"), "doubts": ("subject", "sentence")}


def why(database: Path, case: Path) -> msgflow.Explanation | None:
    with duckdb.connect(str(database)) as connection:
        fill_case(connection, case)
    with msgflow.open_db(database) as db, suppress(NoFlowError):
        return db.why(run=1)
    return None


def test_a_path_may_pass_services(fresh_database: Path) -> None:
    found = why(fresh_database, CASES / "critical-path" / "services.case")
    assert found is not None
    path = found.paths.table["path"][0].as_py()
    assert " → (/" in path
    assert set(found.slow_flow.table["path"].to_pylist()) <= {path, None}
    assert found.slow_flow.table["duration_ns"].to_pylist()


def test_a_blank_name_of_a_topic_stops_no_answer(fresh_database: Path) -> None:
    case = CASES / "critical-path" / "services.case"
    with duckdb.connect(str(fresh_database)) as connection:
        fill_case(connection, case)
        connection.execute("UPDATE store.publisher SET topic_name = ' '")
        connection.execute("UPDATE store.subscription SET topic_name = ' '")
    with msgflow.open_db(fresh_database) as db:
        found = db.why(run=1)
    (path,) = set(found.paths.table["path"].to_pylist())
    assert set(found.slow_flow.table["path"].to_pylist()) <= {path, None}
    assert found.slow_flow.table["duration_ns"].to_pylist()


@pytest.mark.thorough
@pytest.mark.parametrize("name", PATHS)
def test_every_system_is_explained_or_has_no_flow(name: str, fresh_database: Path) -> None:
    found = why(fresh_database, PATHS[name])
    if found is not None:
        assert None not in found.verdict.table["headline"].to_pylist()


def slow_at_first(database: Path, case: Path, period_ns: int, *, is_traced: bool = False) -> None:
    """Three of the first four of twenty flows take 0.3 periods, the others a hundredth."""
    moments = [(n, n * period_ns, 300 if n in (1, 2, 4) else 10) for n in range(1, 21)]
    tables = {
        "node": ["node_id,full_name", "1,/a", "2,/b"],
        "publisher": ["publisher_id,node_id,topic_name", "1,1,/t"],
        "subscription": ["subscription_id,node_id,topic_name", "1,2,/t"],
        "publication": [
            "publication_id,publisher_id,start_ns",
            *(f"{n},1,{at}" for n, at, _ in moments),
        ],
        "take": [
            "take_id,subscription_id,taken_ns",
            *(f"{n},1,{at + latency * period_ns // 1000}" for n, at, latency in moments),
        ],
        "link_transport": [
            "publication_id,take_id,publisher_id,subscription_id,method",
            *(f"{n},{n},1,1,exact" for n, *_ in moments),
        ],
    }
    if is_traced:
        tables |= {
            "callback": ["callback_id,kind,node_id,subscription_id", "1,subscription,2,1"],
            "callback_instance": [
                "callback_instance_id,callback_id,take_id,start_ns,end_ns",
                *(
                    f"{n},1,{n},{at + latency * period_ns // 1000},{at + period_ns // 2}"
                    for n, at, latency in moments
                ),
            ],
        }
    case.write_text(
        "".join(f"== {name}\n" + "\n".join(rows) + "\n" for name, rows in tables.items())
    )
    with duckdb.connect(str(database)) as connection:
        fill_case(connection, case)


def facts(database: Path) -> dict[str, Any]:
    """What an explanation says besides its sentences, and what follows from findings."""
    with msgflow.open_db(database) as db:
        why, findings = db.why(run=1, start="0s"), db.findings(run=1, detail=True)
        unanswered = db.query("service-latency", run=1).notes
    return {
        **{
            name: part.table.drop_columns(list(SENTENCES.get(name, ()))).to_pylist()
            for name, part in why.sections.items()
        },
        "steps": why.steps,
        "notes": why.notes,
        "unanswered": unanswered,
        "next": commands_after(findings),
        "found": [(each.name, each.count) for each in findings],
    }


def test_other_words_change_no_answer(
    fresh_database: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither those of findings nor those about culprits."""
    case = tmp_path / "slow_at_first.case"
    slow_at_first(fresh_database, case, 5 * SECOND, is_traced=True)
    with duckdb.connect(str(fresh_database)) as connection:
        connection.execute(FOUND)
    said = facts(fresh_database)
    found = [(row["kind"], row["node"], row["callback"]) for row in said["verdict"]]
    assert found == [
        ("never_matched", "/b", None),
        ("callback", "/b", "Subscription(/t)"),
        ("waits", "/b", "Subscription(/t)"),
    ]
    assert [row["lacks"] for row in said["verdict"]] == [None, "cpu", "samples"]
    assert any("msgflow record shows which callbacks compute" in note for note in said["notes"])
    assert [row["next"] for row in said["verdict"]] == [
        "check", "query callbacks --each --slowest 5 --node /b",
        "query waits --by instance --slowest 5 --node /b",
    ]  # fmt: skip
    assert said["doubts"] == [
        {"name": "ambiguous_link", "places": 1},
        {"name": "missing_layer", "places": 2},
    ]
    assert said["unanswered"] == ["no request"]
    assert said["next"] == [("why",)]
    text = Statements.text

    def reworded(statements: Statements, name: str) -> str:
        return OTHER_WORDS.get(name, "{}").format(text(statements, name))

    monkeypatch.setattr(Statements, "text", reworded)
    with duckdb.connect(str(fresh_database)) as connection:
        connection.execute("UPDATE store.finding SET subject = '/b', detail = '3 messages on /t '")
    assert facts(fresh_database) == said | {"unanswered": ["3 messages on /t "]}


def test_tables_on_the_way_have_the_columns_that_their_headers_declare(
    fresh_database: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An empty one is made from these."""
    seen: dict[str, list[tuple[str, str]]] = {}
    keep = Statements.keep

    def kept(
        statements: Statements,
        connection: duckdb.DuckDBPyConnection,
        name: str,
        values: dict[str, Any],
    ) -> None:
        keep(statements, connection, name, values)
        table = connection.table(name)
        seen[name] = list(zip(table.columns, map(str, table.types), strict=True))

    monkeypatch.setattr(Statements, "keep", kept)
    with duckdb.connect(str(fresh_database)) as connection:
        fill_case(connection, CASES / "critical-path" / "services.case")
        connection.execute(THREAD_STATE)
    with msgflow.open_db(fresh_database) as db:
        db.why(run=1)
    declared = {
        name: [(column.name, column.type) for column in header.columns]
        for name in seen
        if (header := internal_sql().header(name)).columns
    }
    assert {"noticed", "harm", "callback_call", "callback_wake", "cpu_user"} <= declared.keys()
    assert {name: seen[name] for name in declared} == declared


def test_a_warm_up_behind_the_end_of_what_is_asked_for_stays(
    fresh_database: Path, tmp_path: Path
) -> None:
    """It ends with half a second."""
    slow_at_first(fresh_database, tmp_path / "slow_at_first.case", SECOND // 50)
    with msgflow.open_db(fresh_database) as db:
        assert [db.why(run=1, end=end).start for end in ("0.45s", "0.5s")] == [None, None]


def test_a_warm_up_stays_out_and_is_said(fresh_database: Path, tmp_path: Path) -> None:
    slow_at_first(fresh_database, tmp_path / "slow_at_first.case", SECOND)
    with msgflow.open_db(fresh_database) as db:
        warm, whole = db.why(run=1), db.why(run=1, start="0s")
    said = "without the first 4.5 s, a warm-up"
    assert [why.start for why in (warm, whole)] == ["4.5s", "0s"]
    assert [why.paths.table["max_ns"][0].as_py() for why in (warm, whole)] == [
        SECOND // 100,
        3 * SECOND // 10,
    ]
    assert [any(said in note for note in why.notes) for why in (warm, whole)] == [True, False]
    assert all("--start" in step for step in warm.steps if step[0] == "query")
