"""The page of a lake: what it shows is what the lake says, and labels are only ever text."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hostile import HOSTILE
from lakes import copied
from served import Page, shown
from typer.testing import CliRunner

from msgflow import Database
from msgflow.cli.app import app
from msgflow.errors import UsageError
from msgflow.fleet.lake import Lake
from msgflow.fleet.lake_page import lake_page, write_lake_page
from msgflow.fleet.lake_query import fleet_query
from msgflow.fleet.part import write_part
from msgflow.view.server import serving_application, single_application

_DAY = 86_400 * 10**9
_SLOW = 9


@pytest.fixture(scope="module")
def lake(simulated: Callable[..., Path], tmp_path_factory: pytest.TempPathFactory) -> Lake:
    """Runs of ten days, one of them three times as slow, with labels and names that are hostile."""
    folder = tmp_path_factory.mktemp("lake")
    database = simulated("pipeline", 0.01)
    lake = Lake.open(folder / "lake", create=True)
    with Database(database) as opened:
        part = write_part(opened.connection, database, lake.store, folder)
    rows = [
        {
            **copied(lake, part, f"{number:020x}", slower=3 if number == _SLOW else 1),
            "database_part": part["part"],
            "name": HOSTILE[number % len(HOSTILE)],
            "source": HOSTILE[number % len(HOSTILE)],
            "start_ns": part["start_ns"] + number * _DAY,
            "labels": {
                "software_version": "1.0" if number < 5 else "1.1",
                "robot": HOSTILE[number % len(HOSTILE)],
                HOSTILE[0]: HOSTILE[1],
            },
        }
        for number in range(10)
    ]
    lake.commit(rows)
    for text in HOSTILE:
        lake.write_failure(
            {"source": text, "labels": {"robot": text}, "reason": "broken", "error": text,
             "stage": text, "hint": text, "tries": 1},
        )  # fmt: skip
    return lake


@pytest.fixture(scope="module")
def address(lake: Lake, tmp_path_factory: pytest.TempPathFactory) -> str:
    target = tmp_path_factory.mktemp("page") / "lake.html"
    done = CliRunner().invoke(app, ["report", "--lake", lake.store.url, "-o", str(target)])
    assert done.exit_code == 0, done.stderr
    assert "10 runs of" in done.stderr
    return target.as_uri()


def test_the_page_says_what_the_lake_says(lake: Lake, address: str, page: Page) -> None:
    page.open(address)
    assert page.page.locator("nav .tabs a").all_text_contents() == ["Lake"]
    facts = page.page.locator("main .facts").inner_text().split()
    assert facts[facts.index("runs") + 1] == "10"
    assert facts[-1] == str(len(HOSTILE))
    for group in ("software_version", "robot"):
        page.page.get_by_label("label", exact=True).select_option(group)
        found = fleet_query(lake, "e2e-latency", group_by=[group]).table.to_pylist()
        assert len({row["path"] for row in found}) == 1
        table = page.page.get_by_role("region", name="by label")
        table.locator(f"text={shown(found[0]['median_ns'])}").first.wait_for()
        rows = table.locator("tbody tr")
        assert rows.count() == len(found)
        for row in found:
            cells = rows.filter(has_text=shown(row["max_ns"])).first
            assert cells.count() == 1
    # A run for every point, and the slow one stands out.
    assert page.page.locator(".charts canvas").count() == 2
    page.page.locator("summary", has_text="as a table").first.click()
    over_time = page.page.get_by_role("region", name="runs over time")
    assert over_time.locator("tbody tr").count() == 10
    outliers = page.page.get_by_role("region", name="runs that stand out").locator("tbody tr")
    assert outliers.count() == 1
    assert "200 %" in outliers.first.inner_text()
    flows = page.page.get_by_role("region", name="slowest flows").locator("tbody tr")
    assert flows.count() == 10
    assert f"msgflow fleet open {_SLOW:020x} --lake" in flows.first.inner_text()
    assert page.page.get_by_role("region", name="failures").locator("tbody tr").count() == len(
        HOSTILE
    )


@pytest.mark.thorough
def test_a_click_on_a_point_names_its_run(address: str, page: Page) -> None:
    page.open(address)
    over = page.page.locator(".charts .u-over").first
    over.wait_for()
    box = over.bounding_box()
    assert box is not None
    over.click(position={"x": box["width"] - 2, "y": 5})
    said = page.page.locator("main .status", has_text="msgflow fleet open")
    said.wait_for()
    assert f"{_SLOW:020x}" in said.inner_text()


def test_labels_are_only_ever_text(address: str, page: Page) -> None:
    page.open(address)
    page.page.get_by_label("label", exact=True).select_option("robot")
    page.page.locator(".legend", has_text=HOSTILE[0]).wait_for()
    page.page.locator("summary", has_text="10 runs").click()
    assert page.page.evaluate("typeof hacked") == "undefined"
    assert page.page.locator("main img, main script, main style").count() == 0
    for width, height in ((1280, 800), (390, 844)):
        page.page.set_viewport_size({"width": width, "height": height})
        # The page is drawn anew only after that.
        page.page.wait_for_function(
            "width => document.documentElement.scrollWidth === width", arg=width
        )


@pytest.mark.thorough
def test_the_server_shows_the_page_anew(lake: Lake, page: Page) -> None:
    made: list[str] = []

    def make() -> str:
        made.append(lake_page(lake, where="software_version = '1.1'").content)
        return made[-1]

    with serving_application("lake", 0, lambda token: single_application(make, token)) as (
        address,
        _,
    ):
        page.open(address)
        assert "5 of 10 runs" in page.page.locator(".said").inner_text()
        page.open(address)
        assert len(made) == 2


@pytest.mark.thorough
def test_what_does_not_go_with_a_lake(lake: Lake, tmp_path: Path) -> None:
    target = tmp_path / "x.html"
    for arguments, words in (
        (["report", "--lake", lake.store.url, "--run", "1"], "is of all its runs"),
        (["report", "--where", "true"], "--where chooses runs of a lake"),
        (["ui", "--where", "true"], "--where chooses runs of a lake"),
        (["report", "--lake", lake.store.url, "--where", "x = 1"], "such a label — x"),
        (["ui", "--lake", lake.store.url, "--where", "x = 1"], "such a label — x"),
    ):
        done = CliRunner().invoke(
            app, [*arguments, *(["-o", str(target)] * ("ui" not in arguments))]
        )
        assert done.exit_code == 2
        assert words in done.stderr
    done = CliRunner().invoke(app, ["ui", "--lake", str(tmp_path)])
    assert done.exit_code == 4
    with pytest.raises(UsageError, match="more than 1,000"):
        write_lake_page(lake, target, max_size=1_000)
    assert not target.exists()
