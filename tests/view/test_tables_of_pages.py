"""Nodes and Topics, with their sections: their numbers are those that commands print."""

from __future__ import annotations

import csv
import io
import json
import re
import shlex
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.served import Page, Served, shown
from support.tables import decoded
from support.thorough import few, thorough
from typer.testing import CliRunner

from msgflow.cli.app import app
from msgflow.database import open_db
from msgflow.text.values import format_cell
from msgflow.view.pages import Pages

Read = Callable[[Path], duckdb.DuckDBPyConnection]
Report = Callable[..., str]
Serve = Callable[[Path], Served]
SECOND = 1_000_000_000
REAL = ["real_overload", "real_py_mixed", "real_services", "real_lifecycle", "real_reference"]
SHOWN = (
    "callbacks",
    "waits",
    "topics-summary",
    "topics-rate",
    "topics-delivery",
    "topics-latency",
    "timers",
    "service-latency",
    "action-latency",
    "info-nodes",
)
WINDOWS: tuple[dict[str, str], ...] = (
    {},
    {"start": "500000000"},
    {"start": "400000001", "end": "2100000000"},
)


def printed(database: Path, command: str) -> list[dict[str, Any]]:
    """Return the rows that a command prints."""
    program, *words = shlex.split(command)
    assert program == "msgflow"
    done = CliRunner().invoke(app, [*words, "--db", str(database), "--format", "json"])
    assert done.exit_code == 0, done.output
    rows: list[dict[str, Any]] = json.loads(done.stdout)
    return rows


def numbers(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return what rows have, counts of words as a page writes them."""
    return [
        {
            name: format_cell(list(value.items())) if isinstance(value, dict) else value
            for name, value in row.items()
            if value is not None
        }
        for row in rows
    ]


def cells(page: Page, table: str) -> list[dict[str, str]]:
    """Return the rows of a table, each cell under what the page calls its column."""
    rows = page.page.get_by_role("region", name=table, exact=True).locator("tbody tr")
    rows.first.wait_for()
    found: list[dict[str, str]] = rows.evaluate_all(
        "rows => rows.map(row => Object.fromEntries([...row.cells].map(cell =>"
        " [cell.dataset.title, cell.textContent])))"
    )
    return found


@pytest.mark.parametrize("name", few(REAL, "real_overload"))
def test_what_a_page_shows_is_what_its_command_prints(
    name: str, real: Callable[[str], Path], read: Read
) -> None:
    database = real(name)
    connection = read(database)
    pages = Pages()
    for place, query in enumerate(SHOWN):
        window, more = WINDOWS[place % 3], [{}, {"internal": "1"}][place % 2]
        answer = pages.answer(connection, "query", {"name": query, **window, **more})
        page = decoded(answer)
        command = page.meta["command"]
        assert ("--internal" in command) == bool(more)
        if query != "info-nodes":
            assert ("--start" in command) == ("start" in window)
            assert ("--end" in command) == ("end" in window)
        assert numbers(page.rows) == numbers(printed(database, command)), command
    pages.close()


def test_a_window_is_written_with_all_its_digits(demo: Path, read: Read) -> None:
    pages = Pages()
    asked = {"name": "topics-rate", "start": "400000001", "end": "2000000000"}
    command = decoded(pages.answer(read(demo), "query", asked)).meta["command"]
    assert command.endswith("--start 0.400000001s --end 2s")
    pages.close()


@pytest.mark.thorough
def test_a_topic_at_a_glance_is_what_its_only_publisher_and_subscription_say(
    demo: Path, systems: Path
) -> None:
    """The numbers of a topic are those of the queries that take it apart."""
    seen = 0
    for path in (demo, systems):
        with open_db(path) as opened:
            for start, end in ((None, None), ("0.3", "1.2")):
                summary, rate, delivery, latency = (
                    opened.query(f"topics-{what}", start=start, end=end).to_arrow().to_pylist()
                    for what in ("summary", "rate", "delivery", "latency")
                )
                for row in summary:
                    own = [
                        [one for one in rows if one["topic_name"] == row["topic_name"]]
                        for rows in (rate, delivery, latency)
                    ]
                    if [len(one) for one in own] != [1, 1, 1]:
                        continue
                    seen += 1
                    (published,), (sent,), (received,) = own
                    for name in ("rate_hz", "period_median_ns", "period_deviation_ns"):
                        assert row[name] == published[name]
                    for name in ("delivered", "dropped", "lost", "unknown", "reasons"):
                        assert row[name] == sent[name]
                    for name in ("median_ns", "p95_ns", "max_ns"):
                        assert row[f"latency_{name}"] == received[name]
    assert seen >= 4


def test_losses_are_the_messages_that_unmatched_lists(demo: Path, read: Read) -> None:
    pages = Pages()
    for window in WINDOWS:
        loss = decoded(pages.answer(read(demo), "loss", {**window, "internal": "1"}))
        points = decoded(pages.answer(read(demo), "loss_point", dict(window)))
        listed = printed(demo, loss.meta["command"])
        wanted = Counter((row["topic_name"], row["status"], row["reason"]) for row in listed)
        for rows in (loss.rows, points.rows):
            found: Counter[tuple[str, str, str]] = Counter()
            for row in rows:
                found[row["topic"], row["status"], row["reason"]] += row["count"]
            assert found == wanted
    pages.close()


def test_flows_of_a_path_are_those_of_the_window(demo: Path, read: Read) -> None:
    pages = Pages()
    window = {"start": str(SECOND // 2), "end": str(2 * SECOND)}
    latency = decoded(pages.answer(read(demo), "query", {"name": "e2e-latency", **window})).rows
    paths = decoded(pages.answer(read(demo), "path", {})).rows
    assert any(row["reached"] for row in latency)
    for row in latency:
        (number,) = [path["path_id"] for path in paths if path["path"] == row["path"]]
        bins = decoded(pages.answer(read(demo), "path_histogram", {"path": number, **window}))
        assert sum(one["count"] for one in bins.rows) == row["reached"]
        slowest = decoded(pages.answer(read(demo), "path_slowest", {"path": number, **window}))
        assert [one["latency"] for one in slowest.rows[:1]] == [row["max_ns"]] * bool(bins.rows)
    pages.close()


@pytest.mark.parametrize("way", few(["served", "file"], "served"))
def test_topics(way: str, demo: Path, serve: Serve, report: Report, page: Page, read: Read) -> None:
    with open_db(demo) as opened:
        topics = opened.query("topics-summary").to_arrow().to_pylist()
        latency = opened.query("topics-latency").to_arrow().to_pylist()
    page.open(serve(demo).address if way == "served" else report(demo))
    page.go("#/topics")
    topics.sort(key=lambda row: -row["publication_count"])
    found = cells(page, "topics")
    assert [row["topic"] for row in found] == [row["topic_name"] for row in topics]
    for row, wanted in zip(found, topics, strict=True):
        assert row["jitter"] == shown(wanted["period_deviation_ns"])
        assert row["latency max"] == shown(wanted["latency_max_ns"])
        assert row["dropped"] == f"{wanted['dropped']:,}"
        assert row["publishers"] == f"{wanted['publisher_count']:,}"
        assert row["subscriptions"] == f"{wanted['subscription_count']:,}"
        assert row["reasons"] == format_cell(wanted["reasons"] or "")
    slow = max(topics, key=lambda row: row["latency_max_ns"] or 0)
    name = slow["topic_name"]
    page.page.get_by_role("region", name="topics", exact=True).get_by_role(
        "button", name=name, exact=True
    ).click()
    taken = cells(page, "Latency from publication to take")
    assert [row["max"] for row in taken] == [
        shown(row["max_ns"]) for row in latency if row["topic_name"] == name
    ]
    longest = page.page.locator(".panel a.longest")
    assert shown(slow["latency_max_ns"]) in (longest.text_content() or "")
    longest.click()
    ((take,),) = (
        read(demo)
        .execute(
            "SELECT take_id FROM link_transport JOIN take AS t USING (take_id)"
            " JOIN subscription AS s ON t.subscription_id = s.subscription_id"
            " WHERE topic_name = ? ORDER BY latency_ns DESC NULLS LAST, take_id LIMIT 1",
            [name],
        )
        .fetchall()
    )
    assert ("take", take) in page.flow()


@pytest.mark.thorough
@pytest.mark.parametrize("way", few(["served", "file"], "served"))
def test_nodes(way: str, demo: Path, serve: Serve, report: Report, page: Page) -> None:
    with open_db(demo) as opened:
        callbacks = opened.query("callbacks").to_arrow().to_pylist()
        waits = {row["callback_id"]: row for row in opened.query("waits").to_arrow().to_pylist()}
        longest = opened.query("callbacks-each", slowest=1).to_arrow().to_pylist()
    page.open(serve(demo).address if way == "served" else report(demo))
    page.go("#/nodes")
    page.page.get_by_text("query waits").first.wait_for()
    callbacks.sort(key=lambda row: -(row["max_ns"] or 0))
    found = cells(page, "callbacks")
    assert len(found) == len(callbacks)
    for row, wanted in zip(found, callbacks, strict=True):
        assert (row["node"], row["callback"]) == (wanted["node"], wanted["callback"])
        assert row["count"] == f"{wanted['count']:,}"
        assert [row["median"], row["p95"], row["max"]] == [
            shown(wanted[name]) for name in ("median_ns", "p95_ns", "max_ns")
        ]
        assert row["wait max"] == shown(waits[wanted["callback_id"]]["wait_max_ns"])
    page.page.get_by_role("region", name="callbacks", exact=True).locator("tbody tr").first.click()
    page.page.locator(".panel a.longest").click()
    assert ("callback_instance", longest[0]["callback_instance_id"]) in page.flow()


@pytest.mark.thorough
def test_processes_without_callbacks_are_named(
    real: Callable[[str], Path], serve: Serve, page: Page
) -> None:
    """In the words of the command line without its hint; their nodes are said to have none."""
    database = real("real_py_mixed")
    with open_db(database) as opened:
        (note,) = (one for one in opened.query("callbacks").notes if "rclpy" in one)
    page.open(serve(database).address)
    page.go("#/nodes")
    said, hint = note.split("; ")
    assert said in page.page.locator("main").inner_text()
    assert hint not in page.page.locator("main").inner_text()
    page.page.get_by_text("No callback of /filter_image was recorded.").wait_for()


@pytest.mark.thorough
def test_timers_services_and_losses(systems: Path, demo: Path, serve: Serve, page: Page) -> None:
    with open_db(systems) as opened:
        services = opened.query("service-latency", run=1).to_arrow().to_pylist()
        timers = opened.query("timers", run=3).to_arrow().to_pylist()
    page.open(serve(systems).address)
    page.go("#/timers?run=3")
    assert sorted(row["lateness max"] for row in cells(page, "timers")) == sorted(
        shown(row["lateness_max_ns"]) for row in timers
    )
    page.go("#/services?run=1")
    services.sort(key=lambda row: -(row["round_trip_max_ns"] or 0))
    found = cells(page, "services")
    assert [row["round trip max"] for row in found] == [
        shown(row["round_trip_max_ns"]) for row in services
    ]
    page.page.get_by_role("region", name="services", exact=True).locator("tbody tr").first.click()
    longest = page.page.locator(".panel a.longest")
    assert shown(services[0]["round_trip_max_ns"]) in (longest.text_content() or "")
    longest.click()
    assert any(kind == "request" for kind, _ in page.flow())
    page.open(serve(demo).address)
    page.go("#/losses")
    lost = decoded(Pages().answer(open_connection(demo), "loss", {})).rows
    ours = [row for row in lost if not row["is_internal"]]
    assert [row["count"] for row in cells(page, "losses")] == [f"{row['count']:,}" for row in ours]


def open_connection(path: Path) -> duckdb.DuckDBPyConnection:
    return duckdb.connect(str(path), read_only=True)


def test_the_bar_holds_a_window_on_all_pages(
    demo: Path, serve: Serve, page: Page, read: Read
) -> None:
    with open_db(demo) as opened:
        topics = opened.query("topics-summary", start="0.5", end="1.25").to_arrow().to_pylist()
    page.open(serve(demo).address)
    page.go("#/topics")
    page.page.get_by_label("from [s]").fill("500 ms")
    page.page.get_by_label("from [s]").press("Enter")
    page.page.wait_for_url("**start=500000000*")
    page.page.get_by_label("to [s]").fill("1.25")
    page.page.get_by_label("to [s]").press("Enter")
    page.page.get_by_text("--start 0.5s --end 1.25s").wait_for()
    topics.sort(key=lambda row: -row["publication_count"])
    assert [row["messages published"] for row in cells(page, "topics")] == [
        f"{row['publication_count']:,}" for row in topics
    ]
    page.page.get_by_role("link", name="Nodes").click()
    page.page.get_by_text("query callbacks").get_by_text("--start 0.5s --end 1.25s").wait_for()
    page.page.get_by_role("link", name="Timeline").click()
    page.page.wait_for_function(
        "() => { const view = msgflow.page?.renderer?.view;"
        " return view?.from === 500e6 && view.to === 1250e6; }"
    )
    # A drag over the curve chooses another one, a click none.
    box = page.page.locator("canvas.rate").bounding_box()
    assert box is not None
    middle = box["y"] + box["height"] / 2
    page.page.mouse.move(box["x"] + box["width"] / 4, middle)
    page.page.mouse.down()
    page.page.mouse.move(box["x"] + box["width"] / 2, middle, steps=4)
    page.page.mouse.up()
    ((length,),) = read(demo).execute("SELECT end_ns - start_ns FROM run").fetchall()
    page.page.wait_for_function("() => !location.hash.includes('start=500000000')")
    start, end = (
        int(page.page.evaluate(f"new URLSearchParams(location.hash.split('?')[1]).get('{name}')"))
        for name in ("start", "end")
    )
    assert abs(start - length / 4) < length / 50
    assert abs(end - length / 2) < length / 50
    page.page.locator("canvas.rate").click()
    page.page.wait_for_function("() => !location.hash.includes('start=')")


@pytest.mark.thorough
def test_a_page_that_is_ready_late_keeps_what_is_typed(
    demo: Path, serve: Serve, page: Page
) -> None:
    page.open(serve(demo).address)
    page.go("#/topics?start=500000000")
    end = page.page.get_by_label("to [s]")
    end.fill("1.25")
    page.page.evaluate("msgflow.bar.update()")
    assert end.input_value() == "1.25"
    assert page.page.get_by_label("from [s]").input_value() == "0.5"
    end.press("Enter")
    page.page.wait_for_url("**end=1250000000*")


def test_the_bar_finds_names_and_moments(demo: Path, serve: Serve, page: Page) -> None:
    page.open(serve(demo).address)
    search = page.page.get_by_label("find a node, topic")
    search.fill("1.5 s")
    search.press("Enter")
    page.page.wait_for_url("**/#/timeline?*")
    first, last = (
        int(page.page.evaluate(f"new URLSearchParams(location.hash.split('?')[1]).get('{name}')"))
        for name in ("from", "to")
    )
    assert first < 1.5 * SECOND < last
    with open_db(demo) as opened:
        topic = opened.query("topics-summary").to_arrow().to_pylist()[0]["topic_name"]
    search.fill(topic)
    page.page.locator(".found").get_by_role("link", name=f"topic {topic}", exact=True).click()
    page.page.wait_for_url("**/#/topics?*")
    page.page.get_by_role("heading", name=topic, exact=True).wait_for()
    search.fill("no such name")
    page.page.get_by_text("nothing has this in its name").wait_for()


@pytest.mark.thorough
def test_the_warm_up_that_is_skipped_is_that_of_compare(
    real: Callable[[str], Path], serve: Serve, page: Page
) -> None:
    database = real("real_py_mixed")
    with open_db(database) as opened:
        notes = opened.compare(1, 1).result.notes
    (seconds,) = re.findall(r"--skip-first (\S+) leaves", " ".join(notes))
    page.open(serve(database).address)
    page.go("#/losses")
    page.page.get_by_role("button", name="skip warm-up").click()
    skipped = round(float(seconds) * SECOND)
    page.page.wait_for_url(f"**start={skipped}*", timeout=60_000)
    page.page.get_by_text(f"--start {skipped / SECOND:g}s").first.wait_for()


@pytest.mark.thorough
def test_rows_of_ros_itself_are_shown_where_the_bar_says_so(
    demo: Path, serve: Serve, page: Page
) -> None:
    page.open(serve(demo).address)
    page.go("#/topics")
    assert "/rosout" not in [row["topic"] for row in cells(page, "topics")]
    hidden = page.page.locator(".notes").get_by_text("hidden").first.inner_text()
    assert "“what ROS does for itself” shows them" in hidden
    with page.anew():
        page.page.locator(".bar").get_by_label("what ROS does for itself").check()
    assert page.page.get_by_text("--internal").count()
    assert "/rosout" in [row["topic"] for row in cells(page, "topics")]


@pytest.mark.thorough
@pytest.mark.parametrize("place", few(["topics?topic=", "paths"], "paths"))
def test_charts_are_downloaded(place: str, demo: Path, serve: Serve, page: Page) -> None:
    with open_db(demo) as opened:
        topic = opened.query("topics-summary").to_arrow().to_pylist()[0]["topic_name"]
    page.open(serve(demo).address)
    page.go(f"#/{place}{topic}" if place.endswith("=") else f"#/{place}")
    frame = page.page.locator(".chart-frame").first
    frame.get_by_role("button", name="as CSV").wait_for()
    with page.page.expect_download() as download:
        frame.get_by_role("button", name="as CSV").click()
    lines = list(csv.reader(io.StringIO(Path(download.value.path()).read_text())))
    assert lines[0][0].endswith("[ns since begin of run]")
    assert all(len(line) == len(lines[0]) for line in lines)
    assert all(float(line[0]) >= 0 for line in lines[1:])
    with page.page.expect_download() as download:
        frame.get_by_role("button", name="as PNG").click()
    assert Path(download.value.path()).read_bytes().startswith(b"\x89PNG")


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("place", "titles"),
    [
        ("timeline", ["begin_ns", "what", "row", "node", "duration_ns", "identity"]),
        thorough("graph", ["from", "to", "kind", "indirect", "count", "median_ns"]),
    ],
)
def test_the_timeline_and_the_graph_are_downloaded(
    place: str, titles: list[str], demo: Path, serve: Serve, page: Page
) -> None:
    page.open(serve(demo).address)
    page.go(f"#/{place}")
    tools = page.page.locator("main .tools").first
    tools.get_by_role("button", name="as CSV").wait_for()
    if place == "timeline":
        page.page.get_by_text("the window as a table").click()
        page.page.locator("main table tbody tr").first.wait_for()
    else:
        page.page.locator("svg .vertex").first.wait_for()
    with page.page.expect_download() as download:
        tools.get_by_role("button", name="as CSV").click()
    lines = list(csv.reader(io.StringIO(Path(download.value.path()).read_text())))
    assert lines[0] == titles
    assert len(lines) > 10
    assert all(len(line) == len(titles) and line[0] and line[2] for line in lines)
    with page.page.expect_download() as download:
        tools.get_by_role("button", name="as PNG").click()
    assert Path(download.value.path()).read_bytes().startswith(b"\x89PNG")


def test_names_are_no_formulas_of_a_spreadsheet(demo: Path, serve: Serve, page: Page) -> None:
    page.open(serve(demo).address)
    text = page.page.evaluate(
        """async () => (await import("./download.js")).csvText(
            [["=name", ["+1", 'a"b', null]], ["number", [-1.5, NaN, 2]]])"""
    )
    assert text == '"\'=name","number"\n"\'+1",-1.5\n"a""b",\n,2\n'
