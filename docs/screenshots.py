"""Takes pictures of recordings, real and simulated, for the README and the documents beside it.

    python docs/screenshots.py [DIRECTORY [PICTURE …]]

It takes Chromium, and writes PNG files, 1280 pixels wide, into docs/images or the directory.
A test takes them anew and looks whether something is on them.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import sync_playwright

from msgflow.database import Database, open_db
from msgflow.ingest import ingest
from msgflow_sim import simulate

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.browser import ARGUMENTS, find_browser

IMAGES = Path(__file__).parent / "images"
EXAMPLES = Path(__file__).parents[1] / "examples"
EXECUTORS_ALONE = "hide=kind:timer,kind:subscription,kind:service,kind:client,kind:publisher"
# The callback of a map in rviz, some seconds after the begin.
_MAP = """
SELECT i.callback_instance_id
FROM callback_instance AS i
JOIN take AS t USING (take_id)
JOIN subscription AS s USING (subscription_id)
WHERE s.topic_name = '/mapGraph' AND t.taken_ns > (SELECT start_ns + 3000000000 FROM run)
ORDER BY t.taken_ns
LIMIT 1
"""


@dataclass(frozen=True)
class Picture:
    """What is on a picture.

    Attributes:
        name: of the file, without its suffix.
        system: simulated; one of examples/ where `factor` is 0.
        factor: of its length.
        place: page of the report; the file of a flow alone where it is empty. {from} and {to} are
            the ends of the flow in nanoseconds since the begin of the run.
        flow: topic of the message that is followed from the middle of the run on, or SQL for a
            callback instance; 'slowest' for the slowest flow.
        height: of the picture.
        scheme: 'light' or 'dark'.
    """

    name: str
    system: str
    factor: float
    place: str
    flow: str = ""
    height: int = 800
    scheme: str = "light"


PICTURES = (
    Picture("timeline", "rtabmap", 0.3, "", _MAP, 800, "light"),
    Picture("graph", "demo", 0.3, "graph", "", 800, "dark"),
    Picture("autoware_flow", "autoware", 0.2, "", "/FrontLidarDriver", 1580),
    Picture(
        "autoware_executors",
        "autoware",
        0.2,
        f"timeline?from={{from}}&to={{to}}&{EXECUTORS_ALONE}",
        "/FrontLidarDriver",
        740,
    ),
    Picture("rtabmap_messages", "rtabmap", 0.3, "timeline?from={from}&to={to}", _MAP, 1000),
    Picture("real_overview", "pipeline", 0, "overview", "", 760),
    Picture("real_slowest", "pipeline", 0, "timeline?from={from}&to={to}", "slowest", 620, "dark"),
    Picture("topics", "overload", 1, "topics", "", 560),
    Picture("rtabmap_flow", "rtabmap", 0.3, "", _MAP, 860, "dark"),
)


def database(directory: Path, picture: Picture) -> Path:
    """Return the database of a simulated system, with clocks brought together; made once."""
    path = directory / f"{picture.system}.duckdb"
    if not path.exists() and not picture.factor:
        ingest([EXAMPLES / f"{picture.system}.tar.xz"], path, name=picture.system)
    elif not path.exists():
        simulate(picture.system, directory / picture.system, factor=picture.factor)
        ingest([directory / picture.system], path, name=picture.system)
        open_db(path).apply_clocks("messages")
    return path


def written(opened: Database, picture: Picture, target: Path) -> str:
    """Write the file that the picture is of; return the address of what is on it."""
    begin = end = 0
    if picture.flow:
        if picture.flow == "slowest":
            (row,) = opened.query("flows", slowest=1).to_arrow().to_pylist()
            flow = opened.flow(take_id=row["take_id"], direction="backward")
        elif picture.flow.startswith("/"):
            flow = opened.flow(picture.flow, at="0.5s")
        else:
            number = opened.sql(picture.flow).to_arrow()[0][0].as_py()
            flow = opened.flow(callback_instance_id=number)
        if not picture.place:
            opened.flow_page(flow, target)
            return target.as_uri()
        ends = [node["end_ns"] for node in flow.nodes.values() if node["end_ns"] is not None]
        starts = [node["start_ns"] for node in flow.nodes.values() if node["start_ns"] is not None]
        margin = (max(ends) - min(starts)) // 12
        begin = min(starts) - (flow.run.start_ns or 0) - margin
        end = max(ends) - (flow.run.start_ns or 0) + margin
    opened.report(target)
    return f"{target.as_uri()}#/{picture.place.format(**{'from': begin, 'to': end})}"


def taken(target: Path, names: list[str]) -> list[Path]:
    """Simulate the systems, look at the pages of each, keep what was seen; return the files."""
    target.mkdir(parents=True, exist_ok=True)
    files = []
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        directory = Path(name)
        browser = playwright.chromium.launch(executable_path=find_browser(), args=ARGUMENTS)
        for picture in PICTURES:
            if names and picture.name not in names:
                continue
            with open_db(database(directory, picture)) as opened:
                address = written(opened, picture, directory / f"{picture.name}.html")
            context = browser.new_context(
                viewport={"width": 1280, "height": picture.height}, color_scheme=picture.scheme
            )
            page = context.new_page()
            page.goto(address)
            page.wait_for_selector("html[data-ready]", timeout=120_000)
            page.wait_for_timeout(1_000)
            files.append(target / f"{picture.name}.png")
            page.screenshot(path=files[-1])
            context.close()
        browser.close()
    return files


if __name__ == "__main__":
    taken(Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES, sys.argv[2:])
