"""The summary: on the first page, and as Markdown."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pyarrow as pa
import pytest
from support.hostile import HOSTILE, renamed
from support.served import Page, Served, shown
from support.thorough import few
from typer.testing import CliRunner

from msgflow.cli.app import app
from msgflow.database import open_db
from msgflow.errors import UsageError
from msgflow.query.course import read_course
from msgflow.result.query_result import QueryResult
from msgflow.text.json_value import json_value
from msgflow.view.page_query import Question
from msgflow.view.pages import SUMMARY, Pages
from msgflow.view.summary import Section, query_section

Report = Callable[..., str]
Serve = Callable[[Path], Served]
_TARGETS = "targets:\n  - topic: '*'\n    loss: < 1 %\n  - topic: /nowhere\n    rate: 1 Hz ± 5 %\n"


def section(database: Path, part: str) -> Section:
    """Return a section of the summary of the only run."""
    pages = Pages()
    with open_db(database) as opened:
        found = pages.summary(Question(opened.connection, {}), part)
    pages.close()
    return found


def printed(command: str, database: Path) -> list[dict[str, object]]:
    """Return the rows that a command of the summary prints."""
    words = shlex.split(command)
    assert words[0] == "msgflow"
    result = CliRunner().invoke(app, [*words[1:], "--format", "json", "--db", str(database)])
    assert result.exit_code == 0, result.stderr
    rows: list[dict[str, object]] = json.loads(result.stdout)
    return rows


@pytest.mark.parametrize("part", few(SUMMARY, "paths", "drops", "threads"))
def test_its_numbers_are_those_of_the_command_beside_them(part: str, dropping: Path) -> None:
    found = section(dropping, part)
    rows = [row for command in found.commands for row in printed(command, dropping)]
    if part == "why":
        # The command has the verdict before the sections that it stands on.
        rows = printed(*found.commands, dropping)["verdict"]  # type: ignore[call-overload]
    own = found.result.table.to_pylist()
    if part == "why":
        # Words behind `msgflow` there; beside a table commands are whole.
        run = found.commands[0].removeprefix("msgflow why")
        for row in rows:
            row["next"] = row["next"] and f"msgflow {row['next']}{run}"
    if part == "blame":
        # Each command is of one flow, and ranks it first.
        assert [row.pop("rank") for row in own] == sorted(
            place
            for place, command in enumerate(found.commands, 1)
            for _ in printed(command, dropping)
        )
        assert {row.pop("rank") for row in rows} == {1}
    assert rows == json_value(own)
    assert rows


@pytest.mark.thorough
def test_flows_of_the_summary_are_the_slowest(dropping: Path) -> None:
    rows = section(dropping, "blame").result.table.to_pylist()
    with open_db(dropping) as opened:
        flows = opened.query("flows").to_arrow().to_pylist()
    slowest = max(flow["latency_ns"] for flow in flows if flow["latency_ns"] is not None)
    assert rows[0]["latency_ns"] == slowest
    for rank in {row["rank"] for row in rows}:
        of_flow = [row for row in rows if row["rank"] == rank]
        assert sum(row["duration_ns"] for row in of_flow) == of_flow[0]["latency_ns"]
    takes = [row["take_id"] for row in rows if row["path"] is not None]
    assert len(takes) == len(set(takes))


def test_a_window_is_in_the_command(dropping: Path) -> None:
    with open_db(dropping) as opened:
        asked = Question(opened.connection, {"start": 0, "end": 100_000_000})
        found = query_section(asked, "threads")
    (command,) = found.commands
    assert "--start 0s --end 0.1s" in command
    assert printed(command, dropping) == found.result.table.to_pylist()


def test_markdown_has_verdicts_findings_paths_and_drops(dropping: Path, tmp_path: Path) -> None:
    targets = tmp_path / "targets.yaml"
    targets.write_text(_TARGETS, encoding="utf-8")
    output = tmp_path / "summary.md"
    result = CliRunner().invoke(
        app,
        ["report", "-o", str(output), "--targets", str(targets), "--db", str(dropping)],
    )
    assert result.exit_code == 0, result.stderr
    assert "browser" not in result.stderr
    text = output.read_text(encoding="utf-8")
    with open_db(dropping) as opened:
        verification = opened.verify(targets)
        lost = opened.query("topics-delivery", where="dropped > 0").to_arrow().to_pylist()
        findings = opened.findings()
    assert f"{verification.count('failed')} failed, 1 not measured" in text
    assert verification.count("failed") > 0
    assert f"msgflow verify {targets} --run {verification.run.name}" in text
    assert bool(findings) == (f"msgflow check --run {verification.run.name}" in text)
    assert text.index("## Requirements") < text.index("## Findings") < text.index("## Slowest")
    for row in lost:
        assert f"| `{row['topic_name']}` | `{row['subscriber']}` | {row['published']:,}" in (
            text.replace(f"{row['published']}", f"{row['published']:,}")
        )
    for finding in findings:
        assert finding.title in text
    assert "the run has no such topic — /nowhere" in text


@pytest.fixture
def explained(monkeypatch: pytest.MonkeyPatch) -> None:
    """`why` finds four culprits, and something that the recording cannot tell."""
    nexts = ("query timers --node /a", "check", None, None)
    rows = [
        {
            "kind": "sleeps",
            "headline": f"/{name}: on_scan sleeps 160 ms",
            "evidence": [f"data are late by {name}", f"{name} waits for it"],
            "next": following,
        }
        for name, following in zip("abcd", nexts, strict=True)
    ]
    found = SimpleNamespace(
        verdict=QueryResult(pa.Table.from_pylist(rows)),
        doubts=QueryResult(pa.table({"sentence": ["/a: its clock jumps"]})),
    )

    def explain(*asked: Any) -> SimpleNamespace:
        return SimpleNamespace(course=read_course(*asked), **vars(found))

    monkeypatch.setattr("msgflow.view.pages.explain", explain)


@pytest.mark.usefixtures("explained")
def test_markdown_has_a_headline_for_each_culprit(dropping: Path, tmp_path: Path) -> None:
    """Three of them; findings are of whole runs."""
    output = tmp_path / "summary.md"
    with open_db(dropping) as opened:
        opened.report(output, start="0.1s")
    expected = """
- **`/a: on_scan sleeps 160 ms`**
  - `data are late by a`
  - `a waits for it`
  - next: `msgflow query timers --node /a --start 0.1s --run trace`
- **`/b: on_scan sleeps 160 ms`**
  - `data are late by b`
  - `b waits for it`
  - next: `msgflow check --run trace`
- **`/c: on_scan sleeps 160 ms`**
  - `data are late by c`
  - `c waits for it`
- and 1 more

note: `/a: its clock jumps`

```
msgflow why --start 0.1s --run trace
```
"""
    assert expected in output.read_text(encoding="utf-8")


@pytest.mark.usefixtures("explained")
def test_the_first_page_has_a_block_for_each_culprit(
    dropping: Path, page: Page, tmp_path: Path
) -> None:
    output = tmp_path / "report.html"
    with open_db(dropping) as opened:
        opened.report(output)
    page.open(output.as_uri())
    why = page.page.locator("section", has_text="What makes data late")
    blocks = why.locator(".culprit")
    assert [blocks.nth(at).locator("p").all_inner_texts() for at in range(3)] == [
        [
            "/a: on_scan sleeps 160 ms",
            "data are late by a",
            "a waits for it",
            "next: msgflow query timers --node /a --run trace",
        ],
        [
            "/b: on_scan sleeps 160 ms",
            "data are late by b",
            "b waits for it",
            "next: msgflow check --run trace",
        ],
        ["/c: on_scan sleeps 160 ms", "data are late by c", "c waits for it"],
    ]
    assert not blocks.nth(3).is_visible()
    why.get_by_text("1 more").click()
    assert blocks.nth(3).is_visible()
    assert why.locator(".notes").inner_text() == "/a: its clock jumps"


@pytest.mark.thorough
def test_threads_are_named_by_their_nodes(dropping: Path, tmp_path: Path) -> None:
    """Each process of rclpy is python3."""
    output = tmp_path / "summary.md"
    with open_db(dropping) as opened:
        opened.report(output)
        busiest = opened.query("executor-usage", sort=["callback_share:desc"]).to_arrow()
    lines = output.read_text("utf-8").splitlines()
    assert any(f"`{busiest['nodes'][0]}` | {busiest['tid'][0]}" in line for line in lines)


@pytest.mark.thorough
def test_markdown_of_some_paths_is_about_these(dropping: Path, tmp_path: Path) -> None:
    output = tmp_path / "summary.md"
    with open_db(dropping) as opened:
        paths = opened.query("e2e-latency", where="pairs > 0").to_arrow()["path"].to_pylist()
        text = paths[0].split(" → ")[1]
        report = opened.report(output, through=text)
        assert f"Its slowest paths are those with {text} (--through)." in report.notes
        # What `why` says is of the run.
        slowest = output.read_text("utf-8").partition("## Slowest paths")[2]
        rows = [line for line in slowest.splitlines() if " → " in line]
        assert rows
        assert all(text in row for row in rows)
        with pytest.raises(UsageError, match="no path has this text"):
            opened.report(output, through="/nowhere")


def test_names_in_markdown_are_only_ever_text(dropping: Path, tmp_path: Path) -> None:
    path = renamed(dropping, tmp_path / "hostile.duckdb", HOSTILE)
    output = tmp_path / "summary.md"
    with open_db(path) as opened:
        opened.report(output, run=1)
    is_code = False
    for line in output.read_text(encoding="utf-8").split("\n"):
        if line.startswith("```"):
            is_code = not is_code
        elif not is_code:
            # Nothing that a name could be stands outside of code.
            outside = "".join(line.split("`")[::2])
            assert "<" not in outside
            assert "](" not in outside


def test_another_suffix_is_no_report(dropping: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(
        app, ["report", "-o", str(tmp_path / "summary.txt"), "--db", str(dropping)]
    )
    assert result.exit_code == UsageError.exit_code
    assert ".html or .md" in result.stderr


@pytest.mark.thorough
def test_the_command_of_verdicts_names_the_file_of_paths(dropping: Path, tmp_path: Path) -> None:
    targets, paths, summary = (tmp_path / name for name in ("t.yaml", "p.yaml", "summary.md"))
    targets.write_text(_TARGETS, encoding="utf-8")
    paths.write_text("paths: []", encoding="utf-8")
    words = ["report", "-o", summary, "--targets", targets, "--db", dropping]
    for more, is_named in ((["--paths", paths], True), ([], False)):
        result = CliRunner().invoke(app, [str(word) for word in [*words, *more]])
        assert result.exit_code == 0, result.stderr
        text = summary.read_text(encoding="utf-8")
        assert f"msgflow verify {targets}" in text
        assert (f"--paths {paths}" in text) == is_named


@pytest.mark.thorough
def test_the_first_page_of_a_report_has_it(
    dropping: Path, report: Report, page: Page, tmp_path_factory: pytest.TempPathFactory
) -> None:
    targets = tmp_path_factory.mktemp("targets") / "targets.yaml"
    targets.write_text(_TARGETS, encoding="utf-8")
    page.open(report(dropping, targets=targets))
    text = page.page.locator("main").inner_text()
    assert "1 not measured" in text
    blame = section(dropping, "blame").result.table.to_pylist()
    page.page.locator(".blame-nodes").first.wait_for(timeout=60_000)
    nodes = page.page.locator(".blame-nodes .numbers").all_inner_texts()
    shares = [row["duration_ns"] / row["latency_ns"] for row in blame]
    assert [each.split(" · ") for each in nodes] == [
        [shown(row["duration_ns"]), "< 0.1 %" if 0 < share < 0.0005 else f"{100 * share:.1f} %"]
        for row, share in zip(blame, shares, strict=True)
    ]
    drops = page.page.get_by_role("region", name="What was dropped or lost, and why")
    assert drops.locator("tbody tr").count() == len(section(dropping, "drops").result)
    # What makes data late comes first, and each finding is a line.
    assert [page.page.locator("h2").all_inner_texts()[at] for at in (0, 3)] == [
        "What makes data late, or lets them get lost",
        "What is wrong with the recording",
    ]
    assert page.page.locator(".finding[open]").count() == 0
    # There is no tab that would show nothing.
    tabs = page.page.locator(".tabs a").all_inner_texts()
    assert "Timeline" in tabs
    assert "Compare" not in tabs


def test_the_server_is_asked_for_what_stands_below_when_somebody_looks(
    dropping: Path, serve: Serve, page: Page
) -> None:
    asked: list[str] = []
    page.page.on("request", lambda request: asked.append(request.url))
    page.page.set_viewport_size({"width": 1280, "height": 300})
    page.open(serve(dropping).address)
    page.page.get_by_text("msgflow why").wait_for(timeout=60_000)
    assert not any("part=blame" in url for url in asked)
    page.page.get_by_role("heading", name="Where the time").scroll_into_view_if_needed()
    page.page.locator(".blame-nodes").first.wait_for(timeout=60_000)
