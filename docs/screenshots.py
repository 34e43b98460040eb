"""Takes pictures of reports of simulated systems, for the README.

    python docs/screenshots.py [DIRECTORY]

It takes Chromium, and writes PNG files of 1280 x 800 pixels into docs/images or the directory.
A test takes them anew and looks whether something is on them.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

from msgflow.clocks import apply_clocks, read_clock_sync
from msgflow.database import open_db
from msgflow.ingest import ingest
from msgflow.sim import simulate

IMAGES = Path(__file__).parent / "images"
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]
# Picture, simulated system, its length, page, topic of the message on it, and light or dark.
PICTURES = (
    ("timeline", "autoware", 0.2, "timeline?flow=publication:{}", "/FrontLidarDriver", "light"),
    ("graph", "demo", 0.3, "graph", "/camera/image", "dark"),
)


def taken(target: Path) -> list[Path]:
    """Simulate the systems, look at the report of each, keep what was seen; return the files."""
    target.mkdir(parents=True, exist_ok=True)
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    files = []
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=ARGUMENTS)
        for picture, system, factor, place, topic, scheme in PICTURES:
            directory = Path(name) / system
            simulate(system, directory / "trace", factor=factor)
            database = directory / f"{system}.duckdb"
            ingest([directory / "trace"], database)
            apply_clocks(database, read_clock_sync("messages"), run=None)
            page_file = directory / "report.html"
            with open_db(database) as opened:
                opened.report(page_file)
                message = opened.flow(topic, at="0.5s").start.id
            context = browser.new_context(
                viewport={"width": 1280, "height": 800}, color_scheme=scheme
            )
            page = context.new_page()
            page.goto(f"{page_file.as_uri()}#/{place.format(message)}")
            page.wait_for_selector("html[data-ready]", timeout=120_000)
            page.wait_for_timeout(1_000)
            files.append(target / f"{picture}.png")
            page.screenshot(path=files[-1])
            context.close()
        browser.close()
    return files


if __name__ == "__main__":
    taken(Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES)
