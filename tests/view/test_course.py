"""When a run changed, in a real browser: lines with their changes, marks, counters."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.served import Page, Served

from msgflow.database import open_db
from msgflow.query.course import read_course
from msgflow.run.slice import Slice

Serve = Callable[[Path], Served]
SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def changing(simulated: Callable[..., Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A source that pauses once; a node becomes active, and a program takes half of a CPU."""
    path = tmp_path_factory.mktemp("changing") / "changing.duckdb"
    shutil.copyfile(simulated("stall", 1), path)
    with duckdb.connect(str(path)) as connection:
        connection.execute(
            "INSERT INTO store.lifecycle_transition"
            " SELECT n.run_id, min(n.node_id), r.start_ns + 500000000, 'inactive', 'active'"
            " FROM store.node AS n JOIN store.run AS r USING (run_id) GROUP BY ALL"
        )
        connection.execute(
            "INSERT INTO store.program_usage BY NAME"
            " SELECT r.run_id, h.host_id, r.start_ns, r.start_ns + 1000000000 AS end_ns,"
            " unnest([1, p.pid]) AS pid, unnest([NULL, p.process_id]) AS process_id,"
            " unnest(['cc1', p.name]) AS name, 500000000 AS cpu_ns"
            " FROM store.run AS r JOIN store.host AS h USING (run_id)"
            " JOIN store.process AS p USING (host_id)"
            " QUALIFY row_number() OVER (ORDER BY process_id) = 1"
        )
    return path


def changes(path: Path) -> list[dict[str, Any]]:
    with open_db(path) as opened:
        (begin,) = opened.connection.execute("SELECT start_ns FROM run").fetchone() or (0,)
        rows = opened.query("changes").to_arrow().to_pylist()
    return [row | {"at": row["at_ns"] - begin} for row in rows]


@pytest.mark.parametrize("way", ["served", "file"])
def test_changes_are_marked_and_lead_to_the_timeline(
    way: str, changing: Path, serve: Serve, report: Callable[..., str], page: Page
) -> None:
    known = changes(changing)
    assert {row["what"] for row in known} == {"timer", "topic", "take"}
    page.open(serve(changing).address if way == "served" else report(changing))
    # The first page says it, and draws it.
    section = page.page.locator("section", has_text="When it changed")
    section.locator(".chart canvas").wait_for()
    said = section.locator("p a").all_text_contents()
    assert len(said) == min(len(known), 3)
    assert said[0].startswith(f"at {known[0]['at'] / SECOND:.1f} s")
    assert ": 1 pause of " in said[0]
    # The lines of a topic: one change on one of them.
    page.go("#/topics")
    page.page.locator(".spark").first.wait_for()
    lines = page.page.locator("table tr", has=page.page.locator(".spark-change"))
    topic = next(row["subject"] for row in known if row["what"] == "topic")
    assert lines.count() == 1
    assert topic in lines.first.inner_text()
    lines.first.click()
    table = page.page.get_by_role("region", name="what changed")
    table.wait_for()
    assert table.locator("tbody tr").count() == 1
    with page.anew():
        table.locator("tbody tr").click()
    assert page.page.url.partition("#")[2].startswith("/timeline")
    view = page.page.evaluate("msgflow.page.renderer.view")
    at = next(row["at"] for row in known if row["what"] == "topic")
    assert view["from"] < at < view["to"] < view["from"] + SECOND + 1


def test_lines_of_paths_and_callbacks_are_windows_of_their_values(
    changing: Path, serve: Serve, page: Page
) -> None:
    with open_db(changing) as opened:
        run = Slice().one_run(opened.connection, "a test")
        course = read_course(opened.connection, run, Slice())
    lines = {(row["what"], row["subject"]): row for row in course.lines.to_pylist()}
    page.open(f"{serve(changing).address}#/paths")
    page.page.locator(".spark").first.wait_for()
    drawn = page.page.locator(".spark-line").all()
    numbers = [len((line.get_attribute("points") or "").split()) for line in drawn]
    wanted = [len(row["times"]) for (what, _), row in lines.items() if what == "latency"]
    assert sorted(numbers) == sorted(wanted)
    page.go("#/nodes")
    page.page.locator(".spark").first.wait_for()
    subjects = {subject for what, subject in lines if what in ("duration", "timer")}
    assert page.page.locator(".spark").count() == len(subjects)


def test_what_happened_is_marked_on_every_axis_of_time(
    changing: Path, serve: Serve, page: Page
) -> None:
    page.open(f"{serve(changing).address}#/timeline")
    marks = page.page.evaluate("msgflow.page.renderer.marks")
    assert [(mark["at"], mark["color"]) for mark in marks if "active" in mark["text"]] == [
        (SECOND // 2, "active")
    ]
    assert any("cc1 used 0.5 CPUs" in mark["text"] for mark in marks)
    assert page.page.evaluate("msgflow.page.minimap.marks") == marks
    page.page.wait_for_function("() => msgflow.bar.marks.length > 0")
    assert page.page.evaluate("msgflow.bar.marks") == marks
    # Pointing at it says what it is.
    page.page.evaluate("msgflow.page.setView(0, 1e9)")
    x = page.page.evaluate("msgflow.page.renderer.x(5e8)")
    page.page.locator("canvas.timeline").hover(position={"x": x, "y": 20})
    assert "became active" in page.page.locator(".tooltip").inner_text()


def counters(page: Page) -> dict[str, list[float]]:
    """Return the values of the counters that have a row, by the label of it."""
    found: dict[str, list[float]] = page.page.evaluate("""() => {
        const { lanes, counters } = msgflow.page.renderer;
        return Object.fromEntries(lanes.filter(lane => lane.isCounter)
            .map(lane => [lane.label, counters.get(lane.key)?.values ?? []]));
    }""")
    return found


def test_counters_have_rows(changing: Path, demo: Path, serve: Serve, page: Page) -> None:
    page.open(f"{serve(changing).address}#/timeline?from=0&to=1000000000")
    page.page.wait_for_function("() => msgflow.page.renderer.counters.size > 0")
    shown = counters(page)
    assert shown["CPU use ≤ 0.5 CPUs"][0] == 0.5
    assert shown["cc1 ≤ 0.5 CPUs"][0] == 0.5
    assert not any(label.startswith("rate") for label in shown)
    page.page.locator(".menu summary").click()
    page.page.get_by_label("rates").check()
    page.page.wait_for_function(
        "() => msgflow.page.renderer.lanes.some(lane => lane.kind === 'rate'"
        " && msgflow.page.renderer.counters.has(lane.key))"
    )
    rates = {label: values for label, values in counters(page).items() if "rate" in label}
    assert any(values[:1] == pytest.approx([100], rel=0.05) for values in rates.values())
    assert "show=rate" in page.page.url
    # Where several messages wait, their number has a row.
    page.open(f"{serve(demo).address}#/timeline")
    page.page.wait_for_function("() => msgflow.page.renderer.counters.size > 0")
    with open_db(demo) as opened:
        ((longest,),) = opened.connection.execute(
            "SELECT max(value) FROM counter([1], 0, 9223372036854775807)"
            " JOIN subscription ON object_id = subscription_id"
            " WHERE kind = 'queue' AND NOT is_internal"
        ).fetchall()
    assert longest > 1
    assert f"queue ≤ {longest:.3g} messages" in counters(page)


def test_markdown_has_the_picture(changing: Path, tmp_path: Path) -> None:
    with open_db(changing) as opened:
        opened.report(tmp_path / "summary.md")
    text = (tmp_path / "summary.md").read_text(encoding="utf-8")
    part = text.partition("## When it changed")[2].partition("##")[0]
    assert "1 pause of" in part
    assert "█" in part
    assert "▲" in part
    assert "msgflow query changes --run" in part
