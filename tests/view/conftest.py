"""Databases to look at, and a browser to look with where there is one."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from hashlib import sha256
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import duckdb
import pytest
from support import thorough
from support.browser import ARGUMENTS, find_browser
from support.ingested import made_once
from support.served import Page, Served

from msgflow.database import open_db
from msgflow.db.connection import connect
from msgflow.ingest import ingest
from msgflow.view import report as view_report
from msgflow.view import summary as view_summary
from msgflow_sim import simulate


@pytest.fixture(autouse=True)
def _one_flow_taken_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of each summary: every other one is a query more, that shows the same of another path."""
    if thorough.is_quick:
        monkeypatch.setattr(view_summary, "MOST_PATHS", 1)


@pytest.fixture(scope="session")
def demo(simulated: Callable[..., Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot on two hosts, three seconds of it, with clocks brought together."""

    def make(path: Path) -> None:
        shutil.copyfile(simulated("demo", 0.3), path)
        open_db(path).apply_clocks("messages")

    return made_once(tmp_path_factory, "demo", make)


@pytest.fixture(scope="session")
def dropping(simulated: Callable[..., Path]) -> Path:
    """A system whose queues are too short."""
    return simulated("overload", 0.2)


@pytest.fixture(scope="session")
def systems(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three runs: Autoware twice, with indirect links and another executor, and services."""

    def make(path: Path) -> None:
        for name in ("services", "autoware_two_threads", "autoware"):
            simulate(name, path.parent / name, factor=0.1)
            ingest([path.parent / name], path)

    return made_once(tmp_path_factory, "systems", make)


@pytest.fixture(scope="session")
def recorded(real: Callable[[str], Path]) -> Path:
    """The recording that Trace Compass is tested with."""
    return real("tracecompass-ros2")


@pytest.fixture(scope="session")
def read() -> Iterator[Callable[[Path], duckdb.DuckDBPyConnection]]:
    """Opens databases for reading, each once."""
    known: dict[Path, duckdb.DuckDBPyConnection] = {}

    def connected(path: Path) -> duckdb.DuckDBPyConnection:
        if path not in known:
            known[path] = connect(path, read_only=True)
        return known[path].cursor()

    yield connected
    for connection in known.values():
        connection.close()


@pytest.fixture(scope="session")
def report(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., str]:
    """Writes a report of a database, once for the same options; returns its address."""

    def written(database: Path, **options: Any) -> str:
        def make(path: Path) -> None:
            # Critical paths take the most time; of the slowest flow is enough.
            with pytest.MonkeyPatch.context() as patch, open_db(database) as opened:
                patch.setattr(view_report, "MOST_CRITICAL", 1)
                opened.report(path.with_suffix(".html"), **options)

        key = sha256(f"{database} {options}".encode()).hexdigest()[:16]
        return made_once(tmp_path_factory, f"report_{key}", make).with_suffix(".html").as_uri()

    return written


@pytest.fixture(scope="session")
def serve(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[Path], Served]]:
    """Serves databases, each once: copies, as one process opens a file with one memory limit."""
    directory = tmp_path_factory.mktemp("served")
    known: dict[Path, Served] = {}

    def served(path: Path) -> Served:
        if path not in known:
            copy = directory / path.name
            shutil.copyfile(path, copy)
            known[path] = Served(copy)
        return known[path]

    yield served
    for server in known.values():
        server.close()


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """A real browser; without one these tests are skipped."""
    program = find_browser()
    if program is None:
        pytest.skip("no Chromium here: apt install chromium")
    playwright = pytest.importorskip("playwright.sync_api")
    os.environ.setdefault("PLAYWRIGHT_SKIP_BROWSER_DOWNLOAD", "1")
    with playwright.sync_playwright() as running_playwright:
        browser = running_playwright.chromium.launch(executable_path=program, args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture
def page(chromium: Any) -> Iterator[Page]:
    """A new page; at its end there were no errors, and nothing was fetched from elsewhere."""
    context = chromium.new_context(viewport={"width": 1280, "height": 800})
    result = Page(context.new_page())

    def asked(request: Any) -> None:
        parts = urlsplit(request.url)
        if parts.scheme not in ("file", "data", "blob") and parts.hostname != "127.0.0.1":
            result.foreign.append(request.url)

    def said(message: Any) -> None:
        if message.type == "error":
            result.errors.append(message.text)

    result.page.on("console", said)
    result.page.on("pageerror", lambda error: result.errors.append(str(error)))
    result.page.on("request", asked)
    yield result
    context.close()
    assert not result.errors
    assert not result.foreign
