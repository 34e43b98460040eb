"""How quickly the pages come and move: reports in a real browser, and `msgflow ui`.

    python benchmarks/pictures.py [--bars 100000 1000000] [--events 10000000] [--database FILE]

For each number of bars a pipeline is simulated, ingested and written as a report; Chromium opens it
without a graphics card. First paint counts from the begin of the navigation to the first drawing of
the timeline; a step is one drawing while zooming or panning. `ui` serves a database of so many
events: new windows are asked for as the page does, each another one, and the memory of the server
is its peak. Times of different machines and days cannot be compared.
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
from pathlib import Path
from urllib.parse import urlsplit

from playwright.sync_api import sync_playwright

from msgflow.database import open_db
from msgflow.ingest import ingest
from msgflow.sim import simulate

EVENTS_PER_FACTOR = 66_000
# Callback instances, publications, takes and states of executors.
BARS_PER_EVENT = 0.636
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]


def made(directory: Path, events: float) -> Path:
    """Return a database of a pipeline with about so many events."""
    trace = directory / "trace"
    simulate("pipeline", trace, factor=events / EVENTS_PER_FACTOR)
    path = directory / "pictures.duckdb"
    ingest([trace], path)
    shutil.rmtree(trace)
    return path


def look(report: Path) -> tuple[int, float, list[float]]:
    """Return bars, first paint and the times of steps [ms] of a report."""
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=ARGUMENTS)
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.goto(f"{report.as_uri()}#/timeline")
        page.wait_for_selector("html[data-painted]", timeout=120_000)
        page.wait_for_selector("html[data-ready]", timeout=120_000)
        painted = float(page.locator("html").get_attribute("data-painted") or "nan")
        bars = int(page.evaluate("msgflow.page.renderer.bars.table.rows"))
        page.evaluate("msgflow.steps.length = 0")
        page.locator("canvas.timeline").focus()
        for key in ("+", "ArrowRight", "+", "ArrowLeft", "-", "+", "+", "ArrowRight", "-", "-") * 3:
            page.keyboard.press(key)
            page.wait_for_timeout(120)
        steps = page.evaluate("msgflow.steps")
        browser.close()
    return bars, painted, steps


def served(database: Path, windows: int = 30) -> tuple[list[float], list[float], int]:
    """Return seconds of new windows, of their arrows, and the peak memory of the server [bytes]."""
    command = [sys.executable, "-m", "msgflow", "ui", "--no-browser", "--port", "0"]
    process = subprocess.Popen([*command, "--db", str(database)], stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    address = urlsplit(process.stderr.readline().strip())
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
    print(f"first window, the whole run, which counts it once: {first:.2f} s")
    chance = random.Random(0)
    bars, arrows = [], []
    for number in range(windows):
        width = max(int(length / 10 ** (number % 6)), 1_000)
        begin = chance.randrange(max(length - width, 1))
        bars.append(ask("segments", begin, width))
        if width < length / 50:
            arrows.append(ask("links", begin, width))
    status = Path(f"/proc/{process.pid}/status").read_text()
    peak = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM"))
    process.terminate()
    process.wait()
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
            bars, painted, steps = look(report.path)
            print(
                f"report of {bars:,} bars: {report.size / 1e6:.1f} MB,"
                f" first paint {painted:.0f} ms,"
                f" steps median {statistics.median(steps):.0f} ms, longest {max(steps):.0f} ms"
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
