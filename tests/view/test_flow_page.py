"""One flow, and the graph, as files of their own: in a real browser, also with hostile names."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import duckdb
import pytest
from support.hostile import HOSTILE, renamed
from support.served import Page, a_publication, colors, flow_of
from support.thorough import few

from msgflow.database import open_db

Read = Callable[[Path], duckdb.DuckDBPyConnection]


@pytest.mark.parametrize("direction", few(["both", "forward", "backward"], "both"))
def test_the_file_has_exactly_the_flow(
    direction: str, demo: Path, read: Read, tmp_path: Path, page: Page
) -> None:
    connection = read(demo)
    number = a_publication(connection, 1)
    target = tmp_path / "flow.html"
    with open_db(demo) as opened:
        flow = opened.flow(publication_id=number, direction=direction)
        assert opened.flow_page(flow, target) == target.stat().st_size < 600_000
    page.open(target.as_uri())
    wanted = set(
        connection.execute(
            f"SELECT kind, id FROM flow_{direction}('publication', ?)", [number]
        ).fetchall()
    )
    assert len(wanted) > 1
    assert page.flow() == wanted
    assert f"flow=publication%3A{number}" in page.page.url
    assert page.page.locator("nav .tabs a").all_text_contents() == ["Timeline"]
    assert colors(page) > 8
    # Arrows are there also where nothing is picked: those of the flow alone.
    page.page.keyboard.press("Escape")
    arrows = page.page.evaluate("msgflow.page.renderer.links.rows")
    assert 0 < arrows <= len(wanted)


@pytest.mark.thorough
@pytest.mark.parametrize("depth", few([0, 1], 1))
def test_the_file_ends_where_depth_does(
    depth: int, systems: Path, read: Read, tmp_path: Path, page: Page
) -> None:
    number = a_publication(read(systems), 3)
    target = tmp_path / "flow.html"
    with open_db(systems) as opened:
        flow = opened.flow(publication_id=number, depth=depth, internal=True)
        opened.flow_page(flow, target)
    page.open(target.as_uri())
    assert page.flow() == set(flow.nodes)
    assert f"--depth {depth}" in page.page.locator(".said").inner_text()
    assert depth < len(flow.nodes) < len(flow_of(read(systems), "publication", number))


@pytest.mark.thorough
@pytest.mark.parametrize("direction", few(["forward", "backward", "both"], "backward"))
def test_the_limit_is_of_the_direction(
    direction: str, systems: Path, read: Read, tmp_path: Path, page: Page
) -> None:
    """And what it leaves out is said."""
    number = a_publication(read(systems), 3)
    target = tmp_path / "flow.html"
    with open_db(systems) as opened:
        flow = opened.flow(publication_id=number, direction=direction, limit=3)
        opened.flow_page(flow, target)
        ((count,),) = opened.connection.execute(
            f"SELECT count(*) FROM flow_{direction}('publication', ?)", [number]
        ).fetchall()
    page.open(target.as_uri())
    assert len(page.flow()) == 3 < count
    assert f"3 of {count} vertices" in page.page.locator(".said").inner_text()


@pytest.mark.thorough
def test_hostile_names_are_inert(systems: Path, tmp_path: Path, page: Page) -> None:
    path = renamed(systems, tmp_path / "hostile.duckdb", HOSTILE)
    target = tmp_path / "flow.html"
    with open_db(path) as opened:
        ((number,),) = opened.connection.execute(
            "SELECT min(publication_id) FROM publication WHERE run_id = 3"
        ).fetchall()
        opened.flow_page(opened.flow(publication_id=number), target)
    page.open(target.as_uri())
    assert page.flow()
    assert page.page.evaluate("typeof hacked") == "undefined"
