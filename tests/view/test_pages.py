"""Every page in a real browser: its numbers are those of the queries, its pictures lead on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.served import Page, Served, shown
from support.thorough import few, thorough

from msgflow.database import open_db
from msgflow.text.values import format_cell

Read = Callable[[Path], duckdb.DuckDBPyConnection]
Report = Callable[..., str]
Serve = Callable[[Path], Served]
SELDOM = (
    "superseded",
    "no_output",
    "not_connected",
    "unknown",
    "cut_by_recording",
    "loss_affected",
    "ambiguous",
)


def cells(page: Page, table: str) -> list[list[str]]:
    rows = page.page.get_by_role("region", name=table, exact=True).locator("tbody tr")
    rows.first.wait_for()
    found: list[list[str]] = rows.evaluate_all(
        "rows => rows.map(row => [...row.cells].map(cell => cell.textContent))"
    )
    return found


@pytest.mark.parametrize("way", few(["served", "file"], "served"))
def test_paths(way: str, demo: Path, serve: Serve, report: Report, page: Page, read: Read) -> None:
    with open_db(demo) as opened:
        latency = opened.query("e2e-latency").to_arrow().to_pylist()
        parts = opened.query("path-breakdown").to_arrow().to_pylist()
    page.open(serve(demo).address if way == "served" else report(demo))
    page.go("#/paths")
    latency.sort(key=lambda row: -(row["p99_ns"] or 0))
    durations = ("median_ns", "p95_ns", "p99_ns", "max_ns", "min_ns", "mean_ns")
    counts = ("roots", "reached", "dropped", "lost", *SELDOM)
    # Of these, what is 0 on every path is left out.
    counts = tuple(
        name for name in counts if name not in SELDOM or any(row[name] for row in latency)
    )
    reasons = ["reasons"] if any(row["reasons"] for row in latency) else []
    wanted = [
        [
            row["path"],
            # A line over time.
            "",
            *(shown(row[name]) for name in durations),
            *(f"{row[name]:,}" for name in counts),
            *(format_cell(row[name] or "") for name in reasons),
        ]
        for row in latency
    ]
    page.page.locator("th", has_text="over time").first.wait_for()
    assert cells(page, "paths") == wanted
    chosen = latency[0]["path"]
    breakdown = [row for row in parts if row["path"] == chosen]
    columns = ("median_ns", "mean_ns", "p95_ns", "max_ns")
    # The part has the words of the legend there.
    assert [row[2:3] + row[4:8] for row in cells(page, "breakdown")] == [
        [row["node"] or "", *(shown(row[name]) for name in columns)] for row in breakdown
    ]
    assert page.page.locator(".chart canvas").count() == 3
    # The slowest flow, in the timeline.
    page.page.get_by_role("region", name="slowest flows").locator("tbody tr").first.click()
    flow = page.flow()
    ((kind, root),) = (
        read(demo)
        .execute(
            "SELECT root_kind, root_id FROM end_to_end([1], NULL, NULL, 'callback_start',"
            " 'callback_end', -9223372036854775808, 9223372036854775807) AS e"
            " JOIN flow_path([1], NULL, NULL) AS p USING (path_id)"
            " WHERE p.path = ? AND e.is_first ORDER BY latency_ns DESC LIMIT 1",
            [chosen],
        )
        .fetchall()
    )
    assert (kind, root) in flow


@pytest.mark.thorough
def test_a_point_of_the_latency_leads_to_its_flow(demo: Path, report: Report, page: Page) -> None:
    page.open(report(demo))
    page.go("#/paths")
    plot = page.page.locator(".chart .u-over").first
    box = plot.bounding_box()
    assert box is not None
    plot.hover(position={"x": box["width"] / 2, "y": box["height"] / 2})
    plot.click(position={"x": box["width"] / 2, "y": box["height"] / 2})
    page.page.wait_for_url("**/*flow=take*")
    assert page.flow()


@pytest.mark.parametrize(
    ("way", "shown_run", "indirect"),
    [
        ("served", ("demo", 1), 0),
        thorough("served", ("systems", 3), 2),
        thorough("file", ("systems", 3), 2),
    ],
)
def test_graph(
    way: str,
    shown_run: tuple[str, int],
    indirect: int,
    request: pytest.FixtureRequest,
    serve: Serve,
    report: Report,
    page: Page,
) -> None:
    name, run = shown_run
    database: Path = request.getfixturevalue(name)
    with open_db(database) as opened:
        rates = opened.query("topics-rate", run=run).to_arrow().to_pylist()
        latency = opened.query("topics-latency", run=run).to_arrow().to_pylist()
    page.open(serve(database).address if way == "served" else report(database))
    page.go(f"#/graph?run={run}")
    names = page.page.locator(".graph g[role=button]").evaluate_all(
        "all => all.map(one => one.getAttribute('aria-label'))"
    )
    wanted = {row["topic_name"] for row in rates + latency}
    wanted |= {row["publisher"] for row in rates} | {row["subscriber"] for row in latency}
    assert sorted(names) == sorted(
        list(wanted)
        + [
            topic
            for topic in {row["topic_name"] for row in rates + latency}
            if topic in {row["publisher"] for row in rates} | {row["subscriber"] for row in latency}
        ]
    )
    titles = page.page.locator(".graph .edge title").all_text_contents()
    for row in latency:
        if row["median_ns"] is not None:
            said = f"{shown(row['median_ns'])} median, {shown(row['p95_ns'])} p95"
            assert any(said in title for title in titles), row
    assert page.page.locator(".graph .stroke-indirect").count() >= indirect
    assert page.page.locator(".graph .group-box").count() >= 2
    # No line goes through what is written.
    written = page.page.locator(".graph .edge-text, .graph .group-text").count()
    assert page.page.locator(".graph .ground").count() == written > 0
    first = rates[0]["topic_name"]
    page.page.locator(f".graph g[aria-label='{first}']").first.click()
    # The graph stays, beside what goes in and out.
    assert page.page.locator(".graph g[role=button]").count() == len(names)
    side = page.page.locator(".side")
    assert rates[0]["publisher"] in side.inner_text()
    side.get_by_role("button", name="only what is beside it").click()
    assert page.page.locator(".graph g[role=button]").count() < len(names)
    assert f"q={first.replace('/', '%2F')}" in page.page.url


@pytest.mark.thorough
def test_services_in_the_graph(systems: Path, serve: Serve, page: Page) -> None:
    with open_db(systems) as opened:
        services = opened.query("service-latency", run=1).to_arrow().to_pylist()
    page.open(serve(systems).address)
    page.go("#/graph?run=1")
    assert page.page.locator(".graph .service-shape").count() == len(
        {row["service_name"] for row in services}
    )
    text = page.page.locator(".graph").text_content() or ""
    assert all(shown(row["round_trip_median_ns"]) in text for row in services if row["answered"])


@pytest.mark.thorough
def test_actions_in_the_graph(simulated: Callable[..., Path], serve: Serve, page: Page) -> None:
    """In place of their services; their topics are topics."""
    path = simulated("actions", 0.2)
    with open_db(path) as opened:
        actions = opened.query("action-latency").to_arrow().to_pylist()
    page.open(serve(path).address)
    page.go("#/graph")
    assert page.page.locator(".graph .action-shape").count() == 2
    assert page.page.locator(".graph .service-shape").count() == 0
    text = page.page.locator(".graph").text_content() or ""
    titles = page.page.locator(".graph .edge title").all_text_contents()
    for row in actions:
        goals = f"{row['action_name']}: {row['goals']} goals, to the result"
        for verb, node in (("sent to", row["client"]), ("executes", row["server"])):
            assert any(f"{node} {verb} {goals}" in title for title in titles), row
    assert "/dock/_action/feedback" in text
    assert any(shown(row["result_median_ns"]) in text for row in actions)


@pytest.mark.thorough
@pytest.mark.parametrize("way", few(["served", "file"], "served"))
def test_executors(way: str, demo: Path, serve: Serve, report: Report, page: Page) -> None:
    with open_db(demo) as opened:
        usage = opened.query("executor-usage").to_arrow().to_pylist()
        blame = opened.query("waits-pair").to_arrow().to_pylist()
    page.open(serve(demo).address if way == "served" else report(demo))
    # The address of the page that is a section now.
    page.go("#/executors")
    page.page.locator("canvas.strip").first.wait_for()
    assert page.page.locator("canvas.strip").count() == len(usage)
    page.page.locator("[data-section=executors] details.beside summary").first.click()
    durations = (
        "seen_ns",
        "wait_ns",
        "select_ns",
        "take_ns",
        "callback_ns",
        "blocked_ns",
        "unknown_ns",
    )
    assert [row[1:3] + row[6:13] for row in cells(page, "executor threads")] == [
        [row["nodes"], row["process"], *(shown(row[name]) for name in durations)] for row in usage
    ]
    found = {(row[0], row[1], row[2], row[3], row[7]) for row in cells(page, "interference")}
    assert found <= {
        (
            row["node"],
            row["callback"],
            row["meanwhile_node"],
            row["meanwhile_callback"],
            shown(row["overlap_max_ns"]),
        )
        for row in blame
    }
    assert found
    filled = page.page.locator("canvas.strip").first.evaluate(
        """canvas => {
            const { width, height } = canvas;
            const data = canvas.getContext("2d").getImageData(0, 0, width, height).data;
            return new Set(new Uint32Array(data.buffer)).size;
        }"""
    )
    assert filled > 1


def as_compared(rows: list[dict[str, Any]], *verdicts: str) -> list[dict[str, Any]]:
    """In the order of the page, where a subject is written once: what changed most comes first."""
    sizes: dict[str, float] = {}
    for row in rows:
        size = (abs(row["difference_ns"] or 0) or 0.5) if row["verdict"] in verdicts else 0
        sizes[row["subject"]] = max(sizes.get(row["subject"], 0), size)
    ordered = sorted(rows, key=lambda row: -sizes[row["subject"]])
    above = [None, *(row["subject"] for row in ordered)]
    return [
        row | {"subject": "" if row["subject"] == before else row["subject"]}
        for row, before in zip(ordered, above, strict=False)
    ]


@pytest.mark.thorough
def test_compare(systems: Path, serve: Serve, page: Page) -> None:
    with open_db(systems) as opened:
        wanted = opened.compare(2, 3, what="callbacks").result.to_arrow().to_pylist()
    page.open(serve(systems).address)
    page.go("#/compare?run=3&other=2&what=callbacks")
    differs = [
        row
        for row in wanted
        if row["verdict"] in ("B is longer", "B is shorter", "only in A", "only in B")
    ]
    table = page.page.get_by_role("region", name="comparison")
    table.wait_for(timeout=60_000)
    page.page.get_by_label("only what differs").uncheck()
    rows = cells(page, "comparison")
    assert [row[:5] + row[8:9] for row in rows] == [
        [
            row["subject"],
            row["statistic"] or "",
            shown(row["a_ns"]),
            shown(row["b_ns"]),
            shown(row["difference_ns"]),
            row["verdict"],
        ]
        for row in as_compared(wanted, "B is longer", "B is shorter", "only in A", "only in B")
    ][: len(rows)]
    subjects = {row["subject"] for row in wanted}
    said = page.page.locator("main").inner_text()
    assert f"{len({row['subject'] for row in differs})} callback" in said
    assert f"of {len(subjects)} differ" in said


@pytest.mark.thorough
def test_compare_shows_what_was_measured_before_intervals(
    systems: Path, serve: Serve, page: Page
) -> None:
    """What takes long comes later: the page shows the rest meanwhile, and says so."""
    with open_db(systems) as opened:
        wanted = opened.compare(2, 3, what="callbacks").result.to_arrow().to_pylist()
    page.open(serve(systems).address)
    held: list[Any] = []
    page.page.route(
        "**/api/compare*",
        lambda route: route.continue_() if "quick=1" in route.request.url else held.append(route),
    )
    page.page.evaluate("location.hash = '#/compare?run=3&other=2&what=callbacks'")
    rows = cells(page, "measured")
    assert [row[:5] for row in rows] == [
        [
            row["subject"],
            row["statistic"],
            shown(row["a_ns"]),
            shown(row["b_ns"]),
            shown(row["difference_ns"]),
        ]
        for row in as_compared(wanted, "only in A", "only in B")
    ][: len(rows)]
    said = page.page.locator("main").inner_text()
    assert f"{len({row['subject'] for row in wanted})} callbacks measured" in said
    assert "confidence intervals" in said
    (route,) = held
    route.continue_()
    page.page.get_by_role("region", name="comparison", exact=True).wait_for(timeout=60_000)


@pytest.mark.thorough
def test_compare_overlays_a_path(systems: Path, report: Report, page: Page) -> None:
    page.open(report(systems, run=3, compare=2, through="/BehaviorPlanner"))
    page.go("#/compare")
    page.page.locator(".chart canvas").wait_for(timeout=180_000)
    labels = page.page.locator(".u-legend").inner_text()
    assert "A: autoware_two_threads" in labels
    assert "B: autoware" in labels


@pytest.fixture
def runs(small_database: Path) -> Path:
    """Three runs of one node each: that of the first is another than that of the others."""
    with duckdb.connect(str(small_database)) as connection:
        connection.execute("UPDATE store.node SET full_name = '/listener' WHERE run_id = 1")
        for table, own in (
            ("run", "'evening' AS name"),
            ("trace", "3 AS trace_id"),
            ("node", "3 AS node_id"),
        ):
            connection.execute(
                f"INSERT INTO store.{table} BY NAME SELECT * REPLACE (3 AS run_id, {own}) "
                f"FROM store.{table} WHERE run_id = 2"
            )
    return small_database


def test_compare_opens_on_the_run_before_and_the_selector_follows(
    runs: Path, serve: Serve, page: Page
) -> None:
    page.open(serve(runs).address)
    choice, other = page.page.get_by_label("run", exact=True), "run to compare with"
    assert choice.input_value() == "3"
    # The comparison itself does not come.
    page.page.route("**/api/compare*", lambda route: None)
    page.page.evaluate("location.hash = '#/compare?run=2&x=1'")
    # Run 1 is of another system.
    page.page.get_by_text("No earlier run is of the same system").wait_for()
    page.page.get_by_label(other).select_option("1")
    page.page.wait_for_url("**other=1*")
    assert choice.input_value() == "2"
    page.page.evaluate("location.hash = '#/compare?run=3'")
    page.page.wait_for_url("**other=2*")
    assert page.page.get_by_label(other).input_value() == "2"
    page.page.evaluate("history.go(-1)")
    page.page.wait_for_url("**run=2*")
    assert choice.input_value() == "2"


def test_compare_needs_two(demo: Path, serve: Serve, page: Page) -> None:
    page.open(serve(demo).address)
    page.go("#/compare")
    assert "only one run" in page.page.locator("main").inner_text()
