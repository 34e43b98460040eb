"""The graph of nodes and topics in each of its formats. Its rows have golden cases."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import duckdb
import pytest
from support.golden import fill_case

from msgflow import Database, UsageError
from msgflow.export.graph import GraphFormat, graph_format

CASES = Path(__file__).resolve().parents[1] / "query" / "cases" / "path-breakdown"
GRAPHS = CASES.with_name("graph")
# Each would be more than text where a name is not made inert.
HOSTILE = [
    '</text></svg><script>document.title = "owned"</script>',
    '" onload="document.title = 1" x="',
    'a"]; click v0 "javascript:alert(1)"; x["b',
    'x", URL="javascript:alert(1)", label="\\N\\G',
    "line\nend\n  v9 --> v0\r\n}\tdigraph { a -> b",
    "\x1b]0;owned\x07\x00\u202e`#quot;&lt;%%{init: {}}%%",
    "]]><![CDATA[ <!-- -->",
    "/" + "long" * 2_500,
]
DOT_TEXT = r'"(?:[^"\\\n]|\\["\\n])*"'
DOT_LINE = re.compile(
    rf"digraph msgflow \{{|  rankdir=LR;|  (?:node|edge) \[fontname=sans, fontsize=\d+\];"
    rf"|  subgraph cluster_\d+ \{{|    label={DOT_TEXT}; fontname=sans; fontsize=9; style=rounded;"
    rf"| +v\d+ \[label={DOT_TEXT}, shape=\w+(?:, style=rounded)?\];"
    rf"|  v\d+ -> v\d+ \[(?:label={DOT_TEXT}, )?tooltip={DOT_TEXT}"
    r'(?:, style=\w+, color="#\w+"|, arrowhead=empty, color=gray40)?\];|  \}|\}'
)
MERMAID_TEXT = r'"(?:[A-Za-z0-9 /_.,:\-·%()→+*]|#\d+;|<br/>)*"'
MERMAID_LINE = re.compile(
    rf"flowchart LR|  subgraph g\d+\[{MERMAID_TEXT}\]|  end"
    rf"|  v\d+(?:\[{MERMAID_TEXT}\]|\(\[{MERMAID_TEXT}\]\)|\{{\{{{MERMAID_TEXT}\}}\}})"
    rf"|  v\d+ (?:-->|==>|-\.->)(?:\|{MERMAID_TEXT}\|)? v\d+"
)


def database_of(case: str, empty_database: Path, directory: Path, cases: Path = CASES) -> Database:
    path = directory / f"{case}.duckdb"
    shutil.copyfile(empty_database, path)
    with duckdb.connect(str(path)) as connection:
        fill_case(connection, cases / f"{case}.case")
    return Database(path)


@pytest.fixture
def hostile(empty_database: Path, tmp_path: Path) -> Iterator[Database]:
    """Nodes, topics, process and executor with names that nobody should have."""
    with database_of("every_part", empty_database, tmp_path) as database:
        with duckdb.connect(str(database.path)) as connection:
            for table, column in (
                ("node", "full_name"),
                ("publisher", "topic_name"),
                ("subscription", "topic_name"),
            ):
                connection.execute(
                    f"UPDATE store.{table} SET {column} = "
                    f"$names[1 + ({table}_id - 1) % len($names)] || '{table[0]}'",
                    {"names": HOSTILE},
                )
            connection.execute("UPDATE store.publisher SET topic_name = $n", {"n": HOSTILE[7]})
            connection.execute("UPDATE store.process SET name = $n", {"n": HOSTILE[5]})
            connection.execute("UPDATE store.host SET hostname = $n", {"n": HOSTILE[0]})
        yield database


def test_the_formats_hold_the_same_graph(empty_database: Path, tmp_path: Path) -> None:
    with database_of("every_part", empty_database, tmp_path) as database:
        graph = database.graph()
    content = json.loads(graph.to_json())
    names = {vertex["id"]: vertex["name"] for vertex in content["vertices"]}
    edges = {
        (names[edge["source"]], names[edge["target"]], edge["kind"], edge["indirect"])
        for edge in content["edges"]
    }
    assert edges == {
        ("/source", "/a", "publish", None),
        ("/a", "/fusion", "receive", None),
        ("/fusion", "/c", "publish", "periodic_async"),
        ("/c", "/sink", "receive", None),
    }
    latencies = {edge["median_ns"] for edge in content["edges"]}
    assert latencies == {None, 276, -5}
    assert {vertex["executor"] for vertex in content["vertices"]} == {None, 1, 2, 3}
    assert graph.to_dot().count("subgraph cluster_") == graph.to_mermaid().count("subgraph g") == 3
    for text in (graph.to_dot(), graph.to_mermaid()):
        assert len(re.findall(r"^  v\d+ .*>", text, re.MULTILINE)) == 4
        assert all(name in text for name in names.values())
        assert "276 ns · 276 ns" in text
    assert "style=dashed" in graph.to_dot()
    assert graph.to_mermaid().count("-.->") == 1
    assert str(graph) == "graph of run case: 3 nodes, 2 topics, 0 services, 0 actions"


def test_services_are_drawn_differently(empty_database: Path, tmp_path: Path) -> None:
    with database_of("services", empty_database, tmp_path) as database:
        graph = database.graph()
    assert graph.to_dot().count("shape=hexagon") == 2
    assert graph.to_dot().count("arrowhead=empty") == 4
    assert graph.to_mermaid().count("{{") == 2
    assert graph.to_mermaid().count(" ==> ") == 4


@pytest.mark.thorough
def test_actions_are_drawn_differently(empty_database: Path, tmp_path: Path) -> None:
    with database_of("actions", empty_database, tmp_path, GRAPHS) as database:
        graph = database.graph()
    assert [vertex.name for vertex in graph.vertices.values() if vertex.kind == "action"] == [
        "/dock"
    ]
    ends = {edge.kind: (edge.source, edge.target) for edge in graph.edges}
    action, sender, server = (
        graph.vertices[key].id
        for key in (("action", "/dock"), ("node", "/asking"), ("node", "/acting"))
    )
    assert (ends["send"], ends["execute"]) == ((sender, action), (action, server))
    assert graph.to_dot().count("shape=octagon") == 1
    assert graph.to_dot().count("arrowhead=empty") == 2
    assert graph.to_mermaid().count("[[") == 1
    assert graph.to_mermaid().count(" ==>") == 2
    assert str(graph).endswith("2 topics, 0 services, 1 actions")


@pytest.mark.thorough
def test_loops_and_nothing_at_all_are_drawn(empty_database: Path, tmp_path: Path) -> None:
    with database_of("every_part", empty_database, tmp_path) as database:
        with duckdb.connect(str(database.path)) as connection:
            connection.execute("UPDATE store.subscription SET topic_name = '/c'")
        graph = database.graph()
        assert {("/c", "receive"), ("/c", "publish")} <= {
            (row["name"], row["kind"]) for row in graph.rows if row["node"] == "/fusion"
        }
        for text, line in ((graph.to_dot(), DOT_LINE), (graph.to_mermaid(), MERMAID_LINE)):
            assert all(line.fullmatch(each) for each in text.splitlines())
        nothing = database.graph(start=10**15)
        assert not nothing.rows
        assert all(DOT_LINE.fullmatch(line) for line in nothing.to_dot().splitlines())
        assert nothing.to_mermaid() == "flowchart LR"


def test_hostile_names_are_inert_in_dot(hostile: Database) -> None:
    text = hostile.graph().to_dot()
    assert all(DOT_LINE.fullmatch(line) for line in text.splitlines())
    assert not re.search(r"\\[^\"\\n]", re.sub(r"\\\\", "", text))
    program = shutil.which("dot")
    if program:
        subprocess.run([program, "-Tsvg"], input=text.encode(), check=True, capture_output=True)


@pytest.mark.thorough
def test_hostile_names_are_inert_in_mermaid(hostile: Database) -> None:
    text = hostile.graph().to_mermaid()
    assert all(MERMAID_LINE.fullmatch(line) for line in text.splitlines())


@pytest.mark.thorough
def test_a_notebook_draws_it(hostile: Database) -> None:
    graph = hostile.graph()
    assert graph._repr_mimebundle_() == {
        "text/plain": repr(graph),
        "text/vnd.mermaid": graph.to_mermaid(),
    }
    assert graph.to_mermaid().startswith("flowchart LR\n")
    assert re.fullmatch(
        r"<graph of run \w+: 3 nodes, \d topics, 0 services, 0 actions>", repr(graph)
    )


def test_the_suffix_chooses_the_format() -> None:
    assert graph_format(None) is GraphFormat.DOT
    assert graph_format(Path("a.GV")) is GraphFormat.DOT
    assert graph_format(Path("a.mmd")) is GraphFormat.MERMAID
    assert graph_format(Path("a.json")) is GraphFormat.JSON
    for name in ("a.svg", "a.png"):
        with pytest.raises(UsageError, match=name) as raised:
            graph_format(Path(name))
        assert "msgflow graph | dot -Tsvg" in str(raised.value.hint)


def test_a_graph_is_of_one_run(empty_database: Path) -> None:
    with Database(empty_database) as database, pytest.raises(UsageError, match="no run yet"):
        database.graph()
