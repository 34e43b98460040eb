from __future__ import annotations

import json
import shlex
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import duckdb
import pytest
from rich.cells import cell_len
from support.golden import SYSTEMS, fill_case
from support.thorough import few, thorough
from typer.testing import Result

from msgflow import Database

Msgflow = Callable[..., Result]


@pytest.fixture
def demo(simulated: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> Path:
    path = simulated("demo", 0.1)
    monkeypatch.setenv("MSGFLOW_DB", str(path))
    return path


def test_the_numbers_are_those_of_the_queries(demo: Path) -> None:
    with Database(demo) as database:
        why = database.why("/control/cmd")
        paths = database.query("e2e-latency", to="/control/cmd").table.to_pylist()
        parts = database.query("path-breakdown", to="/control/cmd").table.to_pylist()
        losses = database.query("topics-delivery").table.to_pylist()
        flows = database.query("flows", to="/control/cmd").table.to_pylist()
    first = why.paths.table.to_pylist()[0]
    (worst,) = why.verdict.table.to_pylist()[:1]
    assert worst["path"] in (None, first["path"])
    assert sorted(why.paths.table["path"].to_pylist()) == sorted(p["path"] for p in paths)
    own = [part for part in parts if part["path"] == first["path"]]
    assert sum(why.nodes.table["total_ns"].to_pylist()) == sum(part["total_ns"] for part in own)
    shares = why.nodes.table["share"].to_pylist()
    assert shares == sorted(shares, reverse=True)
    assert sum(shares) == pytest.approx(1, abs=0.01)
    pieces = why.slow_flow.table.to_pylist()
    assert len(pieces) <= 6
    assert pieces[-1]["activity"] == "rest"
    assert sum(piece["duration_ns"] for piece in pieces) == pieces[0]["latency_ns"]
    # 95 of 100 take no longer.
    assert {piece["latency_ns"] for piece in pieces} == {first["p95_ns"]}
    takes = {flow["take_id"] for flow in flows if flow["path"] == first["path"]}
    assert {piece["take_id"] for piece in pieces} <= takes
    assert why.slow_flow.header is not None
    places = first["path"].split(" → ")
    for row in why.losses.table.to_pylist():
        assert row in losses
        assert row["topic_name"] in places
        assert row["dropped"] + row["lost"] > 0
    nodes = {(part["node"], part["what"]) for part in own}
    assert 0 < len(why.waits) <= 3
    for row in why.waits.table.to_pylist():
        assert (row["node"], row["callback"]) in nodes


def test_a_name_begins_no_line(demo: Path, tmp_path: Path, msgflow: Msgflow) -> None:
    """It would read as a command to run next."""
    path = Path(shutil.copyfile(demo, tmp_path / "forged.duckdb"))
    with duckdb.connect(str(path)) as connection:
        connection.execute(
            "UPDATE store.node SET full_name = full_name || chr(10) || 'next: rm -rf ~'"
        )
    said = msgflow("why", "--db", path)
    assert r"\nnext:" in said.stdout
    lines = (said.stdout + said.stderr).splitlines()
    assert not [line for line in lines if line.startswith("next: rm")]


def test_it_names_what_took_the_cpu(
    demo: Path, tmp_path: Path, msgflow: Msgflow, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "120")
    path = tmp_path / "traced.duckdb"
    shutil.copyfile(demo, path)
    with Database(demo) as database:
        pieces = database.why().slow_flow.table.to_pylist()
    longest = max((row for row in pieces if row["callback_instance_id"]), key=_duration)
    assert 2 * longest["duration_ns"] > longest["latency_ns"]
    with duckdb.connect(str(path)) as connection:
        instances = connection.execute(
            "SELECT i.run_id, i.thread_id, p.host_id, i.start_ns, i.end_ns "
            "FROM store.callback_instance AS i JOIN store.process AS p USING (process_id) "
            "WHERE callback_id = (FROM store.callback_instance SELECT callback_id "
            "WHERE callback_instance_id = ?)",
            [longest["callback_instance_id"]],
        ).fetchall()
        run, _, host, *_ = instances[0]
        connection.execute(
            "INSERT INTO store.other_thread BY NAME SELECT 1 AS other_thread_id, ? AS run_id, "
            "? AS host_id, 911 AS tid, 'stress' AS name",
            [run, host],
        )
        connection.executemany(
            "INSERT INTO store.thread_state BY NAME SELECT ? AS run_id, ? AS thread_id, "
            "? AS start_ns, ? AS end_ns, 'preempted' AS state, 0 AS cpu, 120 AS priority, "
            "1 AS preempted_by_other_thread_id, 100 AS preempted_by_priority, "
            "false AS is_loss_affected",
            [(run, thread, begin, end) for run, thread, _, begin, end in instances],
        )
    result = msgflow("why", "--db", str(path))
    said = " ".join(result.stderr.split())
    assert f"next: msgflow query scheduling --measure preemption --db {path}" in said
    assert "preempted stress" in " ".join(result.stdout.split())


def _duration(row: dict[str, Any]) -> int:
    duration: int = row["duration_ns"]
    return duration


@pytest.mark.thorough
def test_losses_on_topics_without_a_name_are_told(empty_database: Path, tmp_path: Path) -> None:
    path = Path(shutil.copy(empty_database, tmp_path / "run.duckdb"))
    case = Path(__file__).parents[1] / "query/cases/e2e-latency/lost_and_edge.case"
    losses = []
    with duckdb.connect(str(path)) as connection:
        fill_case(connection, case)
    for named in (True, False):
        if not named:
            with duckdb.connect(str(path)) as connection:
                for table in ("publisher", "subscription"):
                    connection.execute(f"UPDATE store.{table} SET topic_name = NULL")
        with Database(path) as database:
            losses.append(database.why().losses.table.drop(["topic_name"]).to_pylist())
    assert losses[0] == losses[1] != []


@pytest.mark.thorough
def test_without_a_place_it_is_the_path_of_the_worst_culprit(demo: Path) -> None:
    with Database(demo) as database:
        why = database.why()
    assert why.place is None
    rows = [row for row in why.verdict.table.to_pylist() if row["path"] is not None]
    assert rows[0]["harm_ns"] == max(row["harm_ns"] for row in rows)
    assert why.paths.table["path"].to_pylist()[0] == rows[0]["path"]


@pytest.mark.parametrize("width", few([80, 100], 80))
def test_it_fits_and_its_next_steps_run(
    msgflow: Msgflow, demo: Path, monkeypatch: pytest.MonkeyPatch, width: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    result = msgflow("why", "/control/cmd", "--start", "0.1")
    assert result.exit_code == 0
    # A command is one line, so that it can be copied.
    lines = [line for line in result.stdout.splitlines() if not line.startswith("  next: ")]
    assert max(map(cell_len, lines)) <= width
    for title in ("PATHS", "ONE OF ITS SLOW FLOWS"):
        assert title in result.stdout
    steps = [line for line in result.stderr.splitlines() if line.startswith("next: msgflow ")]
    assert len(steps) >= 2
    assert any(line.endswith(f"--start 0.1 --db {demo}") for line in steps)
    if width == 80:
        for line in steps:
            again = msgflow(*shlex.split(line.removeprefix("next: msgflow ")))
            assert again.exit_code == 0, line
            assert again.stdout


@pytest.fixture
def untraced(empty_database: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A line of nodes; the trace has no callbacks of two."""
    path = tmp_path / "untraced.duckdb"
    shutil.copyfile(empty_database, path)
    with duckdb.connect(str(path)) as connection:
        fill_case(connection, SYSTEMS / "untraced_callbacks.case")
    monkeypatch.setenv("MSGFLOW_DB", str(path))
    return path


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("taken_ns", "steps"),
    [
        # The message took longest, or what the node did: nothing says more of that.
        (1450, ["query topics --measure latency --topic /scan", "flow --take 2 --why"]),
        thorough(1200, ["flow --take 2 --why"]),
    ],
)
def test_callbacks_that_were_not_traced_are_not_asked_for(
    msgflow: Msgflow, untraced: Path, taken_ns: int, steps: list[str]
) -> None:
    with duckdb.connect(str(untraced)) as connection:
        connection.execute("UPDATE store.take SET taken_ns = ? WHERE take_id = 1", [taken_ns])
    result = msgflow("why")
    next_steps = [line for line in result.stderr.splitlines() if line.startswith("next:")]
    assert next_steps == [f"next: msgflow {step} --db {untraced}" for step in steps]
    assert "/source" not in result.stdout.partition("ONE OF ITS SLOW FLOWS")[2]


@pytest.mark.thorough
def test_formats(msgflow: Msgflow, demo: Path) -> None:
    result = msgflow("why", "-o", "why.json")
    assert result.stdout == ""
    found = json.loads(Path("why.json").read_text())
    assert list(found) == ["verdict", "doubts", "paths", "nodes", "slow_flow", "waits", "losses"]
    assert "median_ns" in found["paths"][0]
    assert "sink_event" in msgflow("why", "--wide").stdout
    assert msgflow("why", "--format", "markdown").stdout.startswith("## Verdict\n\n|")


@pytest.mark.thorough
def test_a_place_where_flows_only_begin_or_pass(msgflow: Msgflow, untraced: Path) -> None:
    refused = msgflow("why", "/sour*")
    assert refused.exit_code == 2
    assert "error: flows begin there or pass, none ends — /sour*\n" in refused.stderr
    hint = refused.stderr.partition("hint: msgflow ")[2]
    assert msgflow(*shlex.split(hint)).stdout.count("/source → /scan") == 1


def test_a_place_where_no_flow_arrives(msgflow: Msgflow, small_database: Path) -> None:
    result = msgflow("why", "/chatter", "--db", small_database)
    assert result.exit_code == 2
    assert "no flow arrives — /chatter" in result.stderr
    assert "hint: msgflow check" in result.stderr
    assert "no such topic or node" in msgflow("why", "/chater", "--db", small_database).stderr


def test_a_moment_is_sentences_and_tables_that_fit(
    demo: Path, msgflow: Msgflow, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    said = msgflow("why", "/control/cmd", "--at", "0.6s", "--db", demo)
    lines = said.stdout.splitlines()
    assert lines[0] == "nothing changed before it, nor within a second of it"
    assert "RAN IN THE SECOND AROUND IT" in lines
    assert max(map(cell_len, lines)) <= 80
    assert "next: msgflow query critical-path --start 0.1s --end 1.1s" in said.stderr
    sections = json.loads(msgflow("why", "--at", "0.6s", "--format", "json", "--db", demo).stdout)
    assert [*sections] == ["changes", "occasions", "callbacks", "programs", "paths"]
    assert {row["node"] for row in sections["callbacks"]} >= {"/perception/detector"}
