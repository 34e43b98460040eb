"""What a newcomer asks first of real recordings, and must not be misled by."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.thorough import few, thorough
from typer.testing import Result

from msgflow.query.catalogue import load_queries
from msgflow.sql.header import Header

Msgflow = Callable[..., Result]
Rows = list[dict[str, Any]]


@pytest.fixture
def ask(
    real: Callable[[str], Path], msgflow: Msgflow, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., Result]:
    """Runs a command on a recording in a terminal of so many columns."""

    def run(name: str, *words: str, columns: int = 80) -> Result:
        monkeypatch.setenv("COLUMNS", str(columns))
        monkeypatch.setenv("MSGFLOW_DB", str(real(name)))
        result = msgflow(*words)
        assert result.exit_code == 0, result.output
        return result

    return run


def section(text: str, title: str) -> str:
    """Return a section of `why`."""
    return text.partition(f"{title}\n")[2].partition("\n\n")[0]


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(["real_py_mixed", "real_overload"], "real_overload"))
def test_the_way_of_a_message_is_the_work_of_no_node(ask: Msgflow, name: str) -> None:
    """All commands say so of the time in which the reader was not busy."""
    # With the warm-up, as the queries.
    found = json.loads(ask(name, "why", "--start", "0s", "--format", "json").stdout)
    parts = json.loads(ask(name, "query", "path-breakdown", "--format", "json").stdout)
    words = ("query", "critical-path", "--slowest", "5", "--detail", "full", "--format", "json")
    pieces: Rows = json.loads(ask(name, *words).stdout)
    rows = [(row["part"], row["node"]) for row in found["nodes"] + parts]
    rows += [(row["activity"], row["node"]) for row in found["slow_flow"] + pieces]
    on_the_way = Counter(node for part, node in rows if part == "network_or_idle")
    assert set(on_the_way) == {"between nodes"}, on_the_way
    assert all(part == "network_or_idle" for part, node in rows if node == "between nodes")
    by_node = {row["node"]: row["total_ns"] for row in found["nodes"]}
    path = found["paths"][0]["path"]
    assert by_node["between nodes"] == sum(
        row["total_ns"] for row in parts if row["path"] == path and row["part"] == "network_or_idle"
    )


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("name", "columns"),
    few(
        product(("real_py_mixed", "real_overload", "real_reference", "real_container"), (80, 100)),
        ("real_overload", 80),
    ),
)
def test_why_keeps_its_columns(ask: Msgflow, name: str, columns: int) -> None:
    shown = ask(name, "why", columns=columns).stdout
    title = "ONE OF ITS SLOW FLOWS (95 OF 100 TAKE NO LONGER)"
    titles = section(shown, title).splitlines()[1].split()
    # Only rows that stand for several pieces say of how many.
    assert titles in (
        ["duration", "share", "activity", "node", "what"],
        ["duration", "share", "pieces", "activity", "node", "what"],
    )
    assert "── 1 ──" not in shown
    if name == "real_overload":
        paths = section(shown, "PATHS")
        assert paths.splitlines()[0].split() == [
            "path",
            "roots",
            "reached",
            "median",
            "p95",
            "max",
            "reasons",
        ]
        assert "overwritten 438" in paths


def paths_of(text: str) -> dict[int, str]:
    """Return the paths below a table by their numbers, without those that are shortened."""
    lines = re.sub(r"\n {6,}", " ", text).splitlines()
    found = (re.fullmatch(r"path (\d+) +(.*)", line) for line in lines)
    return {int(match[1]): match[2] for match in found if match and "(as " not in match[2]}


@pytest.mark.thorough
@pytest.mark.parametrize(
    "others",
    [
        [("why",), ("query", "e2e-latency", "--sort", "max_ns:desc", "--limit", "4")],
        thorough(
            [
                ("query", "e2e-latency"),
                ("query", "path-breakdown"),
                ("query", "e2e-latency", "--where", "max_ns > 40e6"),
                ("query", "e2e-latency", "--from", "/camera,/imu"),
                ("query", "flows", "--slowest", "30"),
            ]
        ),
    ],
)
def test_a_path_has_one_number(ask: Msgflow, others: list[tuple[str, ...]]) -> None:
    rows = json.loads(ask("real_reference", "query", "e2e-latency", "--format", "json").stdout)
    every = dict(enumerate(sorted(row["path"] for row in rows), start=1))
    for words in others:
        found = paths_of(ask("real_reference", *words).stdout)
        assert found, words
        assert {number: every.get(number) for number in found} == found, words
    # What ends in the midst of a path has a number that no path has.
    found = paths_of(ask("real_reference", "query", "e2e-latency", "--to", "/safety").stdout)
    assert any(number not in every for number in found)
    assert all(every.get(number, text) == text for number, text in found.items())


@pytest.mark.thorough
def test_why_says_that_messages_end_at_a_node(ask: Msgflow) -> None:
    for words in (("why",), ("why", "/boxes"), ("why", "/object_fusion")):
        said = " ".join(ask("real_reference", *words).stderr.split())
        assert "note: 49 messages on /boxes end at /object_fusion, which publishes" in said
        assert "next: msgflow suggest links --db" in said
    said = ask("real_reference", "why", "--run", "real_reference").stderr
    assert "next: msgflow suggest links --run real_reference --db" in said
    said = ask("real_reference", "why", "/vehicle").stderr
    assert "suggest links" not in said


@pytest.mark.thorough
def test_why_asks_for_nothing_without_a_name(ask: Msgflow) -> None:
    said = ask("real_late", "why").stderr.splitlines()
    steps = [line.partition(" --db ")[0] for line in said if line.startswith("next: ")]
    assert steps[0] == "next: msgflow suggest links"
    for step in steps:
        ask("real_late", *step.split()[2:])


QUERIES = [header for header in load_queries() if header.brief]
# Of paths, things, pairs and counts.
SHOWN = ("callbacks", "clocks-pair", "e2e-latency", "info", "links", "service-latency", "topics")


@pytest.mark.parametrize("header", QUERIES, ids=lambda header: header.name)
def test_the_column_that_rows_are_sorted_by_never_yields(header: Header) -> None:
    """That of the query; what nothing explains looks like a mistake."""
    last = re.sub(r"--.*", "", header.body).rpartition("ORDER BY")[2]
    columns = (part.strip() for part in last.split(","))
    first = next((part for part in columns if not part.endswith("run_id")), "")
    if found := re.fullmatch(r"(?:\w+\.)*(\w+) DESC( NULLS LAST)?", first):
        assert found[1] in (*header.brief[:5], header.slowest), first
    else:
        assert "DESC" not in first


@pytest.mark.parametrize(
    "header",
    few(QUERIES, *(header for header in QUERIES if header.name in SHOWN)),
    ids=lambda header: header.name,
)
def test_the_column_that_a_user_sorts_by_is_shown(header: Header, ask: Msgflow) -> None:
    asked = {"graph": "graph --format table", "info": "info --section runs"}
    words = asked.get(header.name, header.command.removeprefix("msgflow ")).split()
    lines = ask("real_overload", *words, "--format", "jsonl").stdout.splitlines()
    rows = list(map(json.loads, lines))
    durations = [column.name for column in header.columns if column.unit == "ns"]
    # What is 0 or empty throughout is said to be.
    known = [name for name in durations if any(row[name] for row in rows)]
    for name in known[-1:]:
        shown = ask("real_overload", *words, "--sort", f"{name}:desc").stdout
        assert name.removesuffix("_ns") in re.split(r"[ \n]+", shown), shown[:300]


@pytest.mark.thorough
def test_rows_of_zero_are_counted_not_shown(ask: Msgflow) -> None:
    result = ask("real_reference", "query", "path-breakdown", columns=100)
    rows = json.loads(ask("real_reference", "query", "path-breakdown", "--format", "json").stdout)
    zero = [row for row in rows if row["total_ns"] == 0]
    assert all(row["max_ns"] == 0 for row in zero)
    assert f"not shown: {len(zero)} rows of 0, " in result.stderr
    lines = [line for line in result.stdout.splitlines() if re.match(r" +\d+ +\d+ ", line)]
    assert len(lines) == len(rows) - len(zero)


@pytest.mark.parametrize(
    ("name", "steps"),
    [
        ("real_reference", ["suggest links", "why"]),
        ("real_overload", ["why"]),
        ("real_py_mixed", ["query path-breakdown", "why"]),
    ],
)
def test_check_says_what_to_do_next(ask: Msgflow, name: str, steps: list[str]) -> None:
    said = ask(name, "check").stderr.splitlines()
    found = [line.partition(" --db ")[0] for line in said if line.startswith("next: ")]
    assert found == [f"next: msgflow {step}" for step in steps]


@pytest.mark.parametrize(
    "name", few(["real_overload", "real_reference", "real_tiny"], "real_overload")
)
def test_messages_are_all_that_were_published(real: Callable[[str], Path], name: str) -> None:
    with duckdb.connect(str(real(name)), read_only=True) as connection:
        ((messages, publications, takes, rows),) = connection.execute(
            "SELECT count(DISTINCT m.publication_id), (SELECT count(*) FROM publication), "
            "count(DISTINCT m.take_id), count(*) FROM message AS m"
        ).fetchall()
        ((unnamed,),) = connection.execute(
            "SELECT count(*) FROM message JOIN publication USING (publication_id) "
            "WHERE topic_name IS NULL AND rmw_ns > 0 AND rcl_ns IS NULL AND NOT is_internal"
        ).fetchall()
        ((all_takes, untaken),) = connection.execute(
            "SELECT (SELECT count(*) FROM take), count(*) FROM publication "
            "WHERE publication_id NOT IN (SELECT publication_id FROM link_transport)"
        ).fetchall()
    assert messages == publications
    assert takes == all_takes
    assert rows == takes + untaken
    assert untaken > 0
    # The middleware speaks, too: its messages are not those of a node.
    assert unnamed == 0


@pytest.mark.thorough
def test_an_export_says_where_to_start(ask: Msgflow) -> None:
    said = " ".join(ask("real_tiny", "export", "csv", "-o", "csv").stderr.split())
    assert "note: start with callback_run, message: they have the names inside" in said
    empty = [path for path in Path("csv").iterdir() if path.read_text().count("\n") == 1]
    assert f"; {len(empty)} views without rows" in said
    assert "note:" not in ask("real_tiny", "export", "csv", "node", "-o", "one").stderr


@pytest.mark.parametrize(
    ("words", "step"),
    [
        thorough(("targets",), "suggest targets -o targets.yaml"),
        (("targets", "-o", "good.yaml"), "verify good.yaml"),
        thorough(("paths",), "suggest paths -o paths.yaml"),
        (("links",), "suggest links --apply"),
    ],
)
def test_suggestions_say_how_to_keep_them(ask: Msgflow, words: tuple[str, ...], step: str) -> None:
    said = ask("real_reference", "suggest", *words).stderr
    assert f"next: msgflow {step} --db" in said
