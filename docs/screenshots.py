"""Takes pictures of reports of simulated systems, for the README and docs/pictures.md.

    python docs/screenshots.py [DIRECTORY]

It takes Chromium, and writes PNG files of 1280 x 800 pixels into docs/images or the directory.
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
LONGEST = """
SELECT take_id FROM end_to_end(
    [1], NULL, NULL, 'callback_start', 'callback_end', -9223372036854775808, 9223372036854775807
) JOIN flow_path([1], NULL, NULL) USING (path_id)
WHERE is_first AND take_id IS NOT NULL
ORDER BY len(topics) DESC, latency_ns DESC
LIMIT 1
"""


def main() -> None:
    """Simulate the demo robot, look at its report, keep what was seen."""
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES
    target.mkdir(parents=True, exist_ok=True)
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        simulate("demo", directory / "demo")
        database = directory / "demo.duckdb"
        ingest([directory / "demo"], database)
        apply_clocks(database, read_clock_sync("messages"), run=None)
        with open_db(database) as opened:
            opened.report(directory / "demo.html")
            (row,) = opened.sql(LONGEST).to_arrow().to_pylist()
        address = (directory / "demo.html").as_uri()
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=program, args=ARGUMENTS)
            for picture, place, scheme in (
                ("timeline", f"timeline?flow=take:{row['take_id']}", "light"),
                ("paths", "paths", "light"),
                ("graph", "graph", "dark"),
            ):
                context = browser.new_context(
                    viewport={"width": 1280, "height": 800}, color_scheme=scheme
                )
                page = context.new_page()
                page.goto(f"{address}#/{place}")
                page.wait_for_selector("html[data-ready]", timeout=60_000)
                page.wait_for_timeout(500)
                page.screenshot(path=target / f"{picture}.png")
                context.close()
            browser.close()


if __name__ == "__main__":
    main()
