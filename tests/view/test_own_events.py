"""Events of the user's own tracepoints on the timeline, in a real browser."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import duckdb
import pytest
from support.ingested import made_once
from support.served import Page, Served
from support.thorough import few

from msgflow.database import open_db
from msgflow.ingest import ingest
from msgflow_sim import simulate

Read = Callable[[Path], duckdb.DuckDBPyConnection]
# An event in a callback instance whose flow goes on.
AN_EVENT = """
SELECT u.callback_instance_id, u.at_ns - r.start_ns, l.publication_id
FROM user_event AS u
JOIN link_causal AS l USING (callback_instance_id)
CROSS JOIN run AS r
WHERE l.kind = 'direct'
ORDER BY u.user_event_id
LIMIT 1 OFFSET 50
"""
LANES = """
() => msgflow.page.renderer.lanes.filter(lane => lane.kind === "event").map(lane => lane.label)
"""
PLACE = """
at => {
    const { renderer } = msgflow.page;
    for (const lane of renderer.lanes) {
        const range = lane.kind === "event" ? renderer.bars.ranges.get(lane.key) : null;
        for (let row = range?.[0]; row < range?.[1]; row++)
            if (renderer.bars.table.start_at[row] === at)
                return [renderer.x(at), 30 + lane.y - renderer.scroll + lane.height / 2];
    }
    return null;
}
"""


@pytest.fixture(scope="session")
def own_events(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot with tracepoints of its own."""

    def make(path: Path) -> None:
        simulate("own_events", path.parent / "own_events", factor=0.1)
        ingest([path.parent / "own_events"], path, events=["my_pkg:*"])

    return made_once(tmp_path_factory, "own_events", make)


@pytest.mark.thorough
@pytest.mark.parametrize("way", few(["served", "file"], "served"))
def test_each_name_has_a_row_and_a_click_follows_the_callback(
    way: str,
    own_events: Path,
    read: Read,
    serve: Callable[[Path], Served],
    report: Callable[..., str],
    page: Page,
) -> None:
    ((instance, at, _),) = read(own_events).execute(AN_EVENT).fetchall()
    page.open(serve(own_events).address if way == "served" else report(own_events))
    page.go(f"#/timeline?from={at - 20_000}&to={at + 20_000}")
    lanes = page.page.evaluate(LANES)
    # Of the three nodes with such events in callbacks, and of two processes outside of all.
    assert lanes == ["my_pkg:frame_done"] * 5
    x, y = page.page.evaluate(PLACE, at)
    page.page.mouse.move(0, 0)
    page.page.locator("canvas.timeline").hover(position={"x": x, "y": y})
    assert f"event in callback instance {instance}" in page.page.locator(".tooltip").inner_text()
    page.page.locator("canvas.timeline").click(position={"x": x, "y": y})
    row = page.page.locator(f".steps tr[data-kind=callback_instance][data-id='{instance}']")
    row.wait_for()
    assert "my_pkg:frame_done at +" in row.inner_text()
    # Among the rows of the flow are those of its events, and not of others.
    assert 0 < len(page.page.evaluate(LANES)) < 5


@pytest.mark.thorough
def test_a_page_of_one_flow_has_its_events(
    own_events: Path, read: Read, tmp_path: Path, page: Page
) -> None:
    ((instance, _, publication),) = read(own_events).execute(AN_EVENT).fetchall()
    with open_db(own_events) as opened:
        flow = opened.flow(publication_id=publication)
        opened.flow_page(flow, tmp_path / "flow.html")
    assert "my_pkg:frame_done" in str(flow)
    page.open((tmp_path / "flow.html").as_uri())
    row = page.page.locator(f".steps tr[data-kind=callback_instance][data-id='{instance}']")
    row.wait_for()
    assert "my_pkg:frame_done at +" in row.inner_text()
    shown = page.page.evaluate(
        "() => [...msgflow.page.renderer.bars.table.kind].filter(kind => kind === 8).length"
    )
    instances = [node["id"] for node in flow.nodes.values() if node["kind"] == "callback_instance"]
    marks = ", ".join(map(str, instances))
    ((count,),) = (
        read(own_events)
        .execute(f"SELECT count(*) FROM user_event WHERE callback_instance_id IN ({marks})")
        .fetchall()
    )
    assert shown == count > 0
