"""Pages of a recording that is watched: they move on with it, until somebody looks closer."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from support.served import Page, colors

from msgflow.cli.sql_process import WarmSql
from msgflow.clocks.clocks_file import read_clock_sync
from msgflow.view.server import serving
from msgflow.watch.follow import watch_finished
from msgflow.watch.watcher import Watcher
from msgflow.watch.window_database import WindowDatabase
from msgflow.watch.window_report import WindowReport

SECOND = 1_000_000_000
Followed = tuple[str, Iterator[WindowReport]]


@pytest.fixture
def followed(shared_traces: Path, tmp_path: Path) -> Iterator[Followed]:
    """The address of pages, and the windows that they show."""
    database = WindowDatabase(tmp_path / "window.duckdb", clock_sync="none")
    watcher = Watcher(
        window_ns=2 * SECOND,
        step_ns=2 * SECOND,
        late_ns=2 * SECOND,
        links=None,
        clocks=read_clock_sync("none"),
        note=print,
        database=database,
    )
    with (
        closing(WarmSql(database.path, memory_limit=None, seconds=30)) as sql,
        serving(database.path, sql, port=0, following=database, place="msgflow watch") as (
            address,
            _,
        ),
    ):
        yield address, watch_finished(shared_traces / "real_rotate", watcher)


def shown_window(page: Page) -> str:
    return str(page.page.locator(".run-name").inner_text())


def wait_for_another(page: Page, before: str) -> None:
    page.page.wait_for_function(
        "before => document.querySelector('.run-name').textContent !== before"
        " && !document.querySelector('.next')",
        arg=before,
        timeout=60_000,
    )


@pytest.mark.thorough
def test_pages_move_on_until_somebody_looks_closer(page: Page, followed: Followed) -> None:
    address, windows = followed
    page.open(address)
    body = page.page.locator("main")
    assert "The first window comes" in body.inner_text()

    next(windows)
    wait_for_another(page, "no run")
    first = shown_window(page)
    assert "/filtered" in body.inner_text()
    page.go("#/timeline")

    next(windows)
    wait_for_another(page, first)
    second = shown_window(page)
    assert colors(page) > 5
    follow = page.page.get_by_role("button", name="follow")
    assert follow.get_attribute("aria-pressed") == "true"

    page.page.locator("canvas.timeline").click(position={"x": 5, "y": 5})
    assert follow.get_attribute("aria-pressed") == "false"
    next(windows)
    page.page.wait_for_timeout(3_000)
    assert shown_window(page) == second
    page.go("#/topics")
    assert "/scan" in body.inner_text()

    follow.click()
    wait_for_another(page, second)


@pytest.mark.thorough
def test_a_page_that_is_left_while_the_next_one_comes_hears_no_keys(
    page: Page, followed: Followed
) -> None:
    """Those of the timeline are letters, which somebody may type elsewhere."""
    address, windows = followed
    page.open(f"{address}#/timeline")
    next(windows)
    wait_for_another(page, "no run")
    # The next one does not come.
    page.page.route("**/api/segments*", lambda route: None)
    next(windows)
    page.page.wait_for_selector(".next", state="attached", timeout=60_000)
    page.go("#/sql")
    editor = page.page.locator(".cm-content")
    editor.click()
    page.page.keyboard.type("sandwiches")
    assert "sandwiches" in editor.inner_text()


@pytest.mark.thorough
def test_a_window_is_written_only_if_somebody_asks(followed: Followed, tmp_path: Path) -> None:
    _, windows = followed
    for _ in windows:
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["window.duckdb"]
