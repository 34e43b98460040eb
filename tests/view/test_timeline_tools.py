"""The timeline of a real browser: crosses, sums of an area, pins, search, the strip, help."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest
from support.served import Page, Served, shown
from support.thorough import thorough
from typer.testing import CliRunner

from msgflow.cli.app import app
from msgflow.database import open_db

Serve = Callable[[Path], Served]
_LANES = "msgflow.page.renderer.lanes.map(lane => [lane.type, lane.label, Boolean(lane.isBeside)])"


@pytest.fixture
def timeline(dropping: Path, serve: Serve, page: Page) -> Page:
    """The timeline of a system whose queues are too short, all of it in sight."""
    page.open(f"{serve(dropping).address}#/timeline?from=0&to=100000000")
    return page


def test_crosses_are_the_messages_that_were_not_taken(dropping: Path, timeline: Page) -> None:
    with open_db(dropping) as opened:
        wanted = opened.sql(
            "SELECT 8 * d.subscription_id + 1 AS row, d.publication_id AS id,"
            " CASE status WHEN 'dropped' THEN 16 WHEN 'lost' THEN 32 ELSE 0 END AS flags"
            " FROM stat_delivery AS d JOIN publication AS p USING (publication_id)"
            " JOIN run AS r ON r.run_id = d.run_id"
            " WHERE d.status IN ('dropped', 'lost', 'unknown')"
            " AND p.end_ns - r.start_ns < 100000000",
            limit=None,
        ).to_arrow()
    rows = {tuple(row.values()) for row in wanted.to_pylist()}
    found = timeline.page.evaluate("""() => {
        const { table } = msgflow.page.renderer.bars;
        return [...table.kind.keys()].filter(at => table.kind[at] === 12
            && table.start_at[at] < 1e8)
            .map(at => [table.row_key[at], table.id[at], table.flags[at]]);
    }""")
    assert {tuple(row) for row in found} == rows
    assert any(flags == 16 for _, _, flags in rows)


@pytest.mark.thorough
def test_a_cross_leads_to_its_message(timeline: Page) -> None:
    x, y, number = timeline.page.evaluate("""() => {
        const { renderer } = msgflow.page;
        const { table, ranges } = renderer.bars;
        for (const lane of renderer.lanes) {
            const [first, last] = ranges.get(lane.key) ?? [0, 0];
            for (let at = first; at < last; at++) {
                const x = renderer.x(table.start_at[at]);
                if (table.kind[at] === 12 && x > renderer.labelWidth && x < renderer.width
                    && lane.y + lane.height < renderer.tall - 30)
                    return [x, 30 + lane.y - renderer.scroll + lane.height / 2, table.id[at]];
            }
        }
        return null;
    }""")
    canvas = timeline.page.locator("canvas.timeline")
    canvas.hover(position={"x": x, "y": y})
    tooltip = timeline.page.locator(".tooltip")
    assert "message" in tooltip.inner_text()
    box, frame = tooltip.bounding_box(), canvas.bounding_box()
    # It does not cover the row that it speaks of.
    assert box["y"] > frame["y"] + y or box["y"] + box["height"] < frame["y"] + y
    # Nor does it leave the screen.
    room = timeline.page.viewport_size
    assert box["x"] >= 0 <= box["y"]
    assert box["x"] + box["width"] <= room["width"]
    assert box["y"] + box["height"] <= room["height"]
    canvas.click(position={"x": x, "y": y})
    timeline.page.locator(".steps tbody tr").first.wait_for()
    assert f"flow=publication%3A{number}" in timeline.page.url or "flow=" in timeline.page.url


@pytest.mark.thorough
def test_sums_of_an_area_are_those_of_the_command(dropping: Path, timeline: Page) -> None:
    box = timeline.page.locator("canvas.timeline").bounding_box()
    mouse = timeline.page.mouse
    timeline.page.keyboard.down("Shift")
    mouse.move(box["x"] + box["width"] * 0.4, box["y"] + 40)
    mouse.down()
    mouse.move(box["x"] + box["width"] * 0.8, box["y"] + 45, steps=3)
    mouse.up()
    timeline.page.keyboard.up("Shift")
    area = timeline.page.locator(".area")
    area.locator("table").first.wait_for(timeout=60_000)
    commands = area.locator(".command code").all_text_contents()
    assert len(commands) == 2
    for command, column, place in zip(commands, ("total_ns", "callback_ns"), (3, 3), strict=True):
        result = CliRunner().invoke(
            app, [*shlex.split(command)[1:], "--format", "json", "--db", str(dropping)]
        )
        assert result.exit_code == 0, result.stderr
        rows = json.loads(result.stdout)
        table = area.locator("table").nth(commands.index(command))
        cells = table.locator("tbody tr").evaluate_all(
            "(rows, place) => rows.map(row => row.cells[place].textContent)", place
        )
        assert cells == [shown(row[column]) for row in rows]
        assert rows
    timeline.page.keyboard.press("Escape")
    assert area.inner_text() == ""


def test_a_search_keeps_what_exchanges_messages_with_it(timeline: Page) -> None:
    every = timeline.page.evaluate(_LANES)
    timeline.page.get_by_label("show rows with this text").fill("subscription")
    found = timeline.page.evaluate(_LANES)
    labels = {label for kind, label, beside in found if kind == "row" and not beside}
    beside = {label for kind, label, is_beside in found if kind == "row" and is_beside}
    # Publishers of their topics.
    assert labels & beside
    assert len(found) < len(every)


@pytest.mark.thorough
def test_a_pinned_row_is_the_first(timeline: Page) -> None:
    lane = timeline.page.evaluate(
        "(({ y, height, label }) => ({ y, height, label }))("
        "msgflow.page.renderer.lanes.filter(lane => lane.type === 'row')[2])"
    )
    canvas = timeline.page.locator("canvas.timeline")
    canvas.hover(position={"x": 500, "y": 30 + lane["y"] + lane["height"] / 2})
    timeline.page.keyboard.press("b")
    kind, label, _ = timeline.page.evaluate(_LANES)[0]
    assert kind == "row"
    assert label.startswith(f"{lane['label']} · ")
    assert "pin=" in timeline.page.url


@pytest.mark.thorough
def test_the_strip_moves_the_window(timeline: Page) -> None:
    strip = timeline.page.locator("canvas.minimap[data-filled]")
    strip.wait_for(timeout=60_000)
    box = strip.bounding_box()
    strip.click(position={"x": box["width"] / 2, "y": 10})
    view, length = timeline.page.evaluate("[msgflow.page.renderer.view, msgflow.page.length]")
    assert (view["from"] + view["to"]) / 2 == pytest.approx(length / 2, rel=0.02)
    assert view["to"] - view["from"] == pytest.approx(100_000_000, rel=0.01)


def test_help_names_every_key(timeline: Page) -> None:
    timeline.page.keyboard.press("?")
    text = timeline.page.locator("dialog.help").inner_text()
    for key in ("N P", "M, or Shift", "B", "Escape", "?"):
        assert key in text
    timeline.page.keyboard.press("Escape")
    assert not timeline.page.locator("dialog.help").is_visible()


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("symbol", "said"),
    [
        thorough("Talker::on_timer()", "Talker::on_timer"),
        thorough("void (Talker::?)(std::shared_ptr<A_<std::allocator<void> > const>)", None),
        thorough(
            "sub<A_<std::allocator<void> >, f(In)>(rclcpp::Node*)::{lambda(In)#5}",
            "sub::{lambda#5}",
        ),
        ("std::_Bind<void (Node::*(Node*, std::_Placeholder<1>))(int)>", "bound method of Node"),
    ],
)
def test_symbols_are_without_templates(symbol: str, said: str | None, timeline: Page) -> None:
    source = "symbol => import('./symbols.js').then(({ shortSymbol }) => shortSymbol(symbol))"
    assert timeline.page.evaluate(source, symbol) == (said or symbol)


@pytest.mark.thorough
def test_a_graph_is_saved_as_svg_and_png(timeline: Page) -> None:
    timeline.go("#/graph")
    for name, begin in (("SVG", b"<svg"), ("PNG", b"\x89PNG")):
        with timeline.page.expect_download() as saved:
            timeline.page.get_by_role("button", name=f"Save as {name}").click()
        content = Path(saved.value.path()).read_bytes()
        assert content.startswith(begin)
        assert len(content) > 1000
    assert timeline.page.locator(".stroke-missing").count() > 0
    assert "✕" in (timeline.page.locator(".graph .missing-text").first.text_content() or "")
