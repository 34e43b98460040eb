"""How quickly the pages come and move: reports in a real browser, and `msgflow ui`.

    python benchmarks/pictures.py [--bars 100000 1000000] [--events 10000000] [--database FILE]

For each number of bars a pipeline is simulated, ingested, served and written as a report; Chromium
opens it without a graphics card, and picks a message. First paint counts from the begin of the
navigation to the first drawing of the timeline; a step is one drawing while zooming or panning.
`ui` serves a database of so many events: new windows are asked for as the page does, each another
one, and the memory of the server is its peak. Times of different machines and days cannot be
compared.
"""

from __future__ import annotations

import argparse
import http.client
import random
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import SplitResult, urlsplit

from playwright.sync_api import sync_playwright

from msgflow.database import open_db
from msgflow.ingest import ingest
from msgflow_sim import simulate

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.browser import ARGUMENTS, find_browser

EVENTS_PER_FACTOR = 66_000
# Callback instances, publications, takes and states of executors.
BARS_PER_EVENT = 0.636
# Each page is opened so often; first paint is the median.
TIMES = 3


def made(directory: Path, events: float) -> Path:
    """Return a database of a pipeline with about so many events."""
    trace = directory / "trace"
    simulate("pipeline", trace, factor=events / EVENTS_PER_FACTOR)
    path = directory / "pictures.duckdb"
    ingest([trace], path)
    shutil.rmtree(trace)
    return path


def look(address: str, database: Path) -> tuple[int, float, list[float]]:
    """Return bars, first paint and the times of steps [ms] of a timeline.

    Nothing may go wrong on the page meanwhile, nothing be fetched from elsewhere, and what lights
    up when a message is picked is what `flow_both` returns.
    """
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_browser(), args=ARGUMENTS)
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        wrong: list[str] = []
        page.on("console", lambda said: wrong.append(said.text) if said.type == "error" else None)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("request", lambda asked: wrong.extend(foreign(asked.url)))
        if "token=" in address:
            page.goto(address)
            page.wait_for_selector("html[data-ready]", timeout=120_000)
            address = address.partition("?")[0]
            page.goto("about:blank")
        # A run of this length would open on a part of itself.
        page.goto(f"{address}#/timeline?from=0&to=1e15")
        page.wait_for_selector("html[data-painted]", timeout=120_000)
        page.wait_for_selector("html[data-ready]", timeout=120_000)
        painted = float(page.locator("html").get_attribute("data-painted") or "nan")
        bars = int(page.evaluate("msgflow.page.held.count"))
        page.evaluate("msgflow.steps.length = 0")
        page.locator("canvas.timeline").focus()
        for key in ("+", "ArrowRight", "+", "ArrowLeft", "-", "+", "+", "ArrowRight", "-", "-") * 3:
            page.keyboard.press(key)
            page.wait_for_timeout(120)
        steps = page.evaluate("msgflow.steps")
        require_flow(page, database)
        browser.close()
    if wrong:
        raise SystemExit("\n".join(wrong))
    return bars, painted, steps


def foreign(address: str) -> list[str]:
    """Return the address where it is not of this machine."""
    parts = urlsplit(address)
    is_own = parts.scheme in ("file", "data", "blob", "about") or parts.hostname == "127.0.0.1"
    return [] if is_own else [address]


def require_flow(page: Any, database: Path) -> None:
    """Pick a message in the middle of the run; stop where another flow than `flow_both` is lit."""
    with open_db(database) as opened:
        connection = opened.connection
        ((number,),) = connection.execute(
            "SELECT quantile_disc(publication_id, 0.5) FROM link_transport"
        ).fetchall()
        wanted = set(
            connection.execute(
                "SELECT kind, id FROM flow_both('publication', ?)", [number]
            ).fetchall()
        )
    page.evaluate(f"location.hash = '#/timeline?flow=publication:{number}'")
    rows = page.locator(".steps tbody tr")
    rows.first.wait_for(timeout=120_000)
    found = rows.evaluate_all("rows => rows.map(row => [row.dataset.kind, +row.dataset.id])")
    if {(kind, number) for kind, number in found} != wanted:
        raise SystemExit(f"another flow is lit than that of publication {number}")


@contextmanager
def serving(database: Path) -> Iterator[tuple[str, int]]:
    """Serve a database; give the address and the process."""
    command = [sys.executable, "-m", "msgflow", "ui", "--no-browser", "--port", "0"]
    process = subprocess.Popen([*command, "--db", str(database)], stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    try:
        yield process.stderr.readline().strip(), process.pid
    finally:
        process.terminate()
        process.wait()


def served(database: Path, windows: int = 30) -> tuple[list[float], list[float], int]:
    """Return seconds of new windows, of their arrows, and the peak memory of the server [bytes]."""
    with serving(database) as (address, pid):
        return asked(database, urlsplit(address), pid, windows)


def asked(
    database: Path, address: SplitResult, pid: int, windows: int
) -> tuple[list[float], list[float], int]:
    """See `served`."""
    token = address.query.removeprefix("token=")
    with open_db(database) as opened:
        (run,) = opened.sql("SELECT start_ns, end_ns FROM run").to_arrow().to_pylist()
    length = run["end_ns"] - run["start_ns"]

    def ask(name: str, begin: int, width: int) -> float:
        before = time.monotonic()
        connection = http.client.HTTPConnection("127.0.0.1", address.port)
        place = f"/api/{name}?run=1&start={begin}&end={begin + width}"
        connection.request("GET", place, headers={"Cookie": f"msgflow_{address.port}={token}"})
        answer = connection.getresponse()
        answer.read()
        assert answer.status == 200
        connection.close()
        return time.monotonic() - before

    ask("row", 0, 0)
    first = ask("segments", 0, length + 1)
    print(f"first window, the whole run, which counts it once: {first:.2f} s", flush=True)
    chance = random.Random(0)
    bars, arrows = [], []
    for number in range(windows):
        width = max(int(length / 10 ** (number % 6)), 1_000)
        begin = chance.randrange(max(length - width, 1))
        bars.append(ask("segments", begin, width))
        if width < length / 50:
            arrows.append(ask("links", begin, width))
    status = Path(f"/proc/{pid}/status").read_text()
    peak = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM"))
    return bars, arrows, peak * 1024


def main() -> None:
    """Simulate, look, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bars", type=int, nargs="*", default=[100_000, 1_000_000])
    parser.add_argument("--events", type=int, default=10_000_000)
    parser.add_argument("--database", type=Path, help="serve this one instead of a simulated one")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        for number in arguments.bars:
            place = directory / str(number)
            place.mkdir()
            database = made(place, number / BARS_PER_EVENT)
            with open_db(database) as opened:
                report = opened.report(place / "report.html", max_size=500_000_000)
            with serving(database) as (address, _):
                for name, page in (("report", report.path.as_uri()), ("ui", address)):
                    seen = [look(page, database) for _ in range(TIMES)]
                    steps = [step for _, _, several in seen for step in several]
                    paint = statistics.median(painted for _, painted, _ in seen)
                    print(
                        f"{name} of {seen[0][0]:,} bars"
                        + (f", {report.size / 1e6:.1f} MB" if name == "report" else "")
                        + f": first paint {paint:.0f} ms,"
                        f" steps median {statistics.median(steps):.0f} ms,"
                        f" longest {max(steps):.0f} ms",
                        flush=True,
                    )
        database = arguments.database or made(directory, arguments.events)
        bars_seconds, arrows, peak = served(database)
        print(
            f"ui: new window median {1e3 * statistics.median(bars_seconds):.0f} ms, longest"
            f" {1e3 * max(bars_seconds):.0f} ms; arrows median"
            f" {1e3 * statistics.median(arrows):.0f} ms; server {peak / 1e6:.0f} MB"
        )
        before = time.monotonic()
        with open_db(database) as opened:
            report = opened.report(directory / "large.html")
        print(f"report: {report.size / 1e6:.1f} MB in {time.monotonic() - before:.0f} s")
        for note in report.notes:
            print(f"  {note}")


if __name__ == "__main__":
    main()
