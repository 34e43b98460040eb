"""What recordings and machines may hold against the pages: each says so, nothing breaks."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.golden import SYSTEMS, fill_case
from support.hostile import HOSTILE, renamed
from support.served import Page, Served
from support.thorough import few, thorough

from msgflow.cli.options import bytes_of
from msgflow.database import open_db
from msgflow.errors import UsageError
from msgflow.run.window import Window
from msgflow.view import report as report_module
from msgflow.view.pages import Pages

PAGES = (
    "overview",
    "paths",
    "timeline",
    "graph",
    "nodes",
    "topics",
    "compare",
)


@pytest.fixture(autouse=True)
def _no_critical_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """They take the most time of a report, and nothing here depends on how many it has."""
    monkeypatch.setattr(report_module, "MOST_CRITICAL", 0)


def visit(page: Page, address: str, run: int | None = None) -> None:
    """See every page, with a picked flow where there is one."""
    page.open(address)
    for name in PAGES:
        # Only the two of one system can be compared.
        asked = "run=3&other=2&what=callbacks" if name == "compare" else f"run={run}"
        page.go(f"#/{name}?{'' if run is None else asked}")
        page.page.wait_for_timeout(100)
        assert page.page.locator("main .failed").all_inner_texts() == [], name
        assert page.page.evaluate("typeof hacked") == "undefined"
        for made in ("img", "script", "iframe", "a[href^=http]", "a[href^=javascript]"):
            assert page.page.locator(f"main {made}").count() == 0


@contextmanager
def shown_as(way: str, path: Path, page: Page, **options: Any) -> Iterator[str]:
    """Give the address of a database that is served, or of a report of it."""
    if way == "file":
        target = path.with_suffix(".html")
        with open_db(path) as opened:
            opened.report(target, **options)
        yield target.as_uri()
        return
    server = Served(path)
    try:
        yield server.address
    finally:
        page.page.goto("about:blank")
        server.close()


@pytest.fixture
def calling(fresh_database: Path) -> Path:
    """A timer, topics and services that call each other, of which all is soon shown."""
    with duckdb.connect(str(fresh_database)) as connection:
        fill_case(connection, SYSTEMS / "nested_services.case")
        connection.execute("UPDATE store.run SET start_ns = 1000, end_ns = 2000")
    return fresh_database


@pytest.mark.parametrize(
    ("way", "shown"),
    [
        ("file", "calling"),
        thorough("file", "demo"),
        thorough("file", "systems"),
        thorough("served", "systems"),
    ],
)
def test_names_are_only_ever_text(
    way: str,
    shown: str,
    request: pytest.FixtureRequest,
    tmp_path: Path,
    page: Page,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(report_module, "MOST_CRITICAL", 1)
    path = renamed(request.getfixturevalue(shown), tmp_path / "hostile.duckdb", HOSTILE)
    ((number,),) = _first_publication(path)
    with shown_as(way, path, page, **({"run": 1} if way == "file" else {})) as address:
        visit(page, address, None if way == "file" else 1)
        page.go(f"#/timeline?run=1&flow=publication:{number}")
        assert page.flow()
        page.page.locator("canvas.timeline").hover(position={"x": 400, "y": 120})
        assert page.page.evaluate("typeof hacked") == "undefined"
        page.go("#/topics?run=1")
        page.page.get_by_role("region", name="topics", exact=True).locator(".pick").first.click()
        page.page.get_by_role("region", name="Publishers").wait_for()
        page.page.get_by_label("find a node, topic").fill("i")
        page.page.locator(".found a").first.wait_for()
        assert page.page.evaluate("typeof hacked") == "undefined"


def _first_publication(path: Path) -> list[tuple[int]]:
    with duckdb.connect(str(path), read_only=True) as connection:
        return connection.execute(
            "SELECT min(publication_id) FROM link_transport WHERE run_id = 1"
        ).fetchall()


@pytest.mark.thorough
def test_names_in_the_address_are_only_ever_text(
    demo: Path, report: Callable[..., str], page: Page
) -> None:
    page.open(report(demo))
    image = "%3Cimg%20src%3Dx%20onerror%3Dhacked%3D1%3E"
    drawing = "%22%3E%3Csvg%20onload%3Dhacked%3D1%3E"
    for text in (image, drawing):
        for place in (
            f"timeline?q={text}",
            f"timeline?flow={text}",
            f"timeline?from={text}&to=1&hide={text}",
            f"graph?q={text}",
            f"paths?path={text}",
            f"nodes?q={text}&callback={text}&call={text}&section={text}",
            f"topics?topic={text}&start={text}",
            f"losses?topic={text}&internal={text}",
            f"compare?other={text}&what={text}",
        ):
            page.go(f"#/{place}")
            assert page.page.evaluate("typeof hacked") == "undefined"
    page.page.evaluate("location.hash = '#/%3Cscript%3E'")
    page.page.wait_for_url("**#/overview*")


@pytest.mark.thorough
def test_a_database_without_a_run(empty_database: Path, tmp_path: Path, page: Page) -> None:
    path = tmp_path / "none.duckdb"
    shutil.copyfile(empty_database, path)
    with open_db(path) as opened, pytest.raises(UsageError, match="holds no run"):
        opened.report(tmp_path / "report.html")
    server = Served(path)
    try:
        page.open(server.address)
        assert "holds no run yet" in page.page.locator("main").inner_text()
    finally:
        page.page.goto("about:blank")
        server.close()


@pytest.mark.parametrize("way", few(["served", "file"], "served"))
def test_an_empty_run(way: str, empty_database: Path, tmp_path: Path, page: Page) -> None:
    path = tmp_path / "empty.duckdb"
    shutil.copyfile(empty_database, path)
    with duckdb.connect(str(path)) as connection:
        connection.execute(
            "INSERT INTO store.run (run_id, name, created_at, msgflow_version, derivation_hash)"
            " VALUES (1, 'nothing', now()::TIMESTAMP, '0', '')"
        )
    with shown_as(way, path, page) as address:
        page.open(address)
        for name in PAGES:
            page.go(f"#/{name}?x=1")
            assert "has no events" in page.page.locator("main").inner_text()


@pytest.mark.thorough
@pytest.mark.parametrize("way", few(["served", "file"], "file"))
def test_a_run_without_links(way: str, demo: Path, tmp_path: Path, page: Page) -> None:
    path = tmp_path / "unlinked.duckdb"
    shutil.copyfile(demo, path)
    with duckdb.connect(str(path)) as connection:
        links = ("link_transport", "link_causal", "link_request", "link_response")
        for table in (*links, "flow_call", "flow_root", "flow_hop"):
            connection.execute(f"DELETE FROM store.{table}")
        ((number,),) = connection.execute("SELECT min(take_id) FROM store.take").fetchall()
    with shown_as(way, path, page) as address:
        visit(page, address)
        page.go("#/paths")
        assert "There are no paths" in page.page.locator("main").inner_text()
        page.go("#/timeline?x=1")
        assert page.page.evaluate("msgflow.page.renderer.bars.table.rows") > 900
        page.go(f"#/timeline?flow=take:{number}")
        assert ("take", number) in page.flow()


@pytest.mark.thorough
@pytest.mark.parametrize("way", few(["served", "file"], "served"))
def test_long_names_a_long_gap_and_five_hundred_nodes(
    way: str, demo: Path, tmp_path: Path, page: Page
) -> None:
    path = renamed(demo, tmp_path / "much.duckdb", ("/" + 10_000 * "x",))
    later = 1_200_000_000_000
    with duckdb.connect(str(path)) as connection:
        ((start, end),) = connection.execute("SELECT start_ns, end_ns FROM store.run").fetchall()
        middle = (start + end) // 2
        for table, columns in (("publication", ("start_ns", "end_ns")), ("take", ("taken_ns",))):
            for column in columns:
                connection.execute(
                    f"UPDATE store.{table} SET {column} = {column} + {later}"
                    f" WHERE {column} > {middle}"
                )
        connection.execute(f"UPDATE store.run SET end_ns = end_ns + {later}")
        connection.execute(
            "INSERT INTO store.gap SELECT 1, min(trace_id), NULL, 'pause',"
            f" {middle}, {middle + later}, NULL FROM store.trace"
        )
        connection.execute(
            "INSERT INTO store.node BY NAME SELECT 10000 + i AS node_id, 1 AS run_id,"
            " 1 AS process_id, 'n' || i AS name, '/' AS namespace, '/n' || i AS full_name,"
            " false AS is_inferred"
            " FROM range(500) AS r (i)"
        )
        connection.execute(
            "INSERT INTO store.publisher BY NAME SELECT 10000 + i AS publisher_id, 1 AS run_id,"
            " 1 AS process_id, 10000 + i AS node_id, '/t' || i AS topic_name, false AS is_internal,"
            " false AS is_inferred FROM range(500) AS r (i)"
        )
        connection.execute(
            "INSERT INTO store.publication BY NAME SELECT 1000000 + i AS publication_id,"
            " 1 AS run_id, 1 AS trace_id, 10000 + i // 2 AS publisher_id, 1 AS process_id,"
            " 1 AS thread_id,"
            " r.start_ns + i * 1000 AS start_ns, r.start_ns + i * 1000 + 10 AS end_ns"
            " FROM store.run AS r, range(1000) AS s (i)"
        )
    with shown_as(way, path, page) as address:
        visit(page, address)
        assert page.page.evaluate("document.documentElement.scrollWidth") <= 1280
        page.go("#/timeline?from=0")
        gaps = page.page.evaluate("msgflow.page.renderer.gaps")
        assert [gap["length"] for gap in gaps] == [later]
        page.go("#/graph")
        assert "those with the most messages" in page.page.locator(".status").inner_text()
        page.page.get_by_placeholder("node or topic").fill("/n499")
        page.page.get_by_placeholder("node or topic").press("Enter")
        assert "/n499" in (page.page.locator(".graph").text_content() or "")
        page.go("#/timeline?q=/t499")
        labels = page.page.evaluate("msgflow.page.renderer.lanes.map(lane => lane.label)")
        assert "/t499" in labels


@pytest.mark.thorough
def test_a_page_of_a_replaced_database_says_so(
    demo: Path, systems: Path, tmp_path: Path, page: Page
) -> None:
    path = tmp_path / "run.duckdb"
    shutil.copyfile(demo, path)
    with shown_as("served", path, page) as address:
        page.open(address)
        other = tmp_path / "other.duckdb"
        shutil.copyfile(systems, other)
        other.replace(path)
        page.go("#/paths")
        said = page.page.locator("main").inner_text()
        assert "the database was changed while the page was open" in said
        page.page.get_by_role("button", name="reload the page").click()
        page.page.get_by_role("region", name="paths", exact=True).wait_for(timeout=60_000)
        assert "/BehaviorPlanner" in page.page.locator("main").inner_text()
    # What the browser itself says of an answer that is an error.
    assert all("409" in error for error in page.errors)
    page.errors.clear()


@pytest.mark.thorough
def test_a_browser_without_what_the_page_needs(
    demo: Path, report: Callable[..., str], page: Page
) -> None:
    page.page.add_init_script("delete window.DecompressionStream")
    page.page.goto(report(demo))
    page.page.locator(".failed").wait_for()
    assert "this browser lacks DecompressionStream" in page.page.locator("main").inner_text()


@pytest.mark.parametrize("text", ["", "0", "-1MB", "2 TB", "lots", "1e9", "20GB"])
def test_sizes_that_make_no_sense(text: str) -> None:
    with pytest.raises(UsageError, match="cannot read the size"):
        bytes_of(text, "--max-size 20MB", 1e9)


def test_sizes() -> None:
    assert bytes_of("20MB", "") == 20_000_000
    assert bytes_of("1.5 kB", "") == 1_500
    assert bytes_of("77", "") == 77


def said_bytes(raised: pytest.ExceptionInfo[UsageError]) -> int:
    """The first number of bytes in the text of an error."""
    found = re.search(r"([\d,]+) bytes", str(raised.value))
    assert found is not None
    return int(found[1].replace(",", ""))


@pytest.fixture
def _asked_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports of one database and window have the same answers: they are asked for once."""
    known: dict[str, bytes] = {}

    class RememberingPages(Pages):
        def __init__(self, window: Window) -> None:
            super().__init__(window)
            self.shown = window

        def answer(self, connection: Any, name: str, params: dict[str, Any]) -> bytes:
            key = f"{self.shown} {name} {sorted(params.items())}"
            if key not in known:
                known[key] = super().answer(connection, name, params)
            return known[key]

    monkeypatch.setattr(report_module, "Pages", RememberingPages)


@pytest.mark.thorough
@pytest.mark.usefixtures("_asked_once")
def test_a_report_says_what_it_left_out(demo: Path, tmp_path: Path, page: Page) -> None:
    target = tmp_path / "report.html"
    with open_db(demo) as opened:
        whole = opened.report(target)
        assert not whole.notes
        with pytest.raises(UsageError, match="the pages alone take") as alone:
            opened.report(target, max_size=100_000)
        # The pages fit, the timeline in bins beside them does not.
        with pytest.raises(UsageError, match="the report takes") as binned:
            opened.report(target, max_size=said_bytes(alone) + 1_000)
        limit = said_bytes(binned) + 10_000
        small = opened.report(target, max_size=limit)
        assert small.size <= limit < whole.size
        (note,) = small.notes
        assert f"does not fit into {limit:,} bytes" in note
        page.open(target.as_uri())
        assert note in page.page.locator(".said").inner_text()
        page.go("#/timeline")
        assert "counted in bins" in page.page.locator(".status").inner_text()
        count = page.page.evaluate("msgflow.page.held.count")
        table = "msgflow.page.renderer.bars.table"
        assert page.page.evaluate(f"[...{table}.count].reduce((a, b) => a + b)") == count
        stretches = page.page.evaluate("msgflow.source.head.stretches")
        middle = stretches[0]
        page.go(f"#/timeline?from={middle['start']}&to={middle['end']}")
        assert page.page.evaluate("msgflow.page.held.bin ?? null") is None
        cut = opened.report(target, start="1s", end="2s", through="/camera/image")
        assert len(cut.notes) == 2
        page.page.goto("about:blank")
        page.open(f"{target.as_uri()}#/timeline")
        first = page.page.evaluate("Math.min(...msgflow.page.renderer.bars.table.start_at)")
        assert first > 900_000_000
        with pytest.raises(UsageError, match="no path has this text"):
            opened.report(target, through="/nothing")
        with pytest.raises(UsageError, match="nothing was recorded"):
            opened.report(target, start="20s")
