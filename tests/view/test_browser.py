"""The pages in a real browser: served, and from a file."""

from __future__ import annotations

import base64
import itertools
import shlex
from collections.abc import Callable
from pathlib import Path

import duckdb
import pytest
from support.served import Page, Served, a_publication, colors, flow_of, shown
from support.thorough import few, thorough

from msgflow.database import open_db

Read = Callable[[Path], duckdb.DuckDBPyConnection]
Report = Callable[..., str]
Serve = Callable[[Path], Served]


def picked(kind: str, number: int) -> str:
    """Return how the row of a picked thing is found."""
    return f".steps tr[data-kind={kind}][data-id='{number}'][aria-selected=true]"


def pick_on_canvas(page: Page, kind: int) -> tuple[str, int]:
    """Click in the middle of the first bar of a kind that is in sight; return what was picked."""
    x, y, name, number = page.page.evaluate(
        """kind => {
            const { renderer } = msgflow.page;
            const { table, ranges } = renderer.bars;
            for (const lane of renderer.lanes) {
                const range = ranges.get(lane.key);
                if (!range || lane.y + lane.height > renderer.tall - 40) continue;
                for (let at = range[0]; at < range[1]; at++) {
                    const middle = table.start_at[at] + table.length[at] / 2;
                    const { from, to } = renderer.view;
                    if (table.kind[at] !== kind || middle < from || middle > to) continue;
                    return [renderer.x(middle), 30 + lane.y - renderer.scroll + lane.height / 2,
                        ["callback_instance", "publication", "take"][kind], table.id[at]];
                }
            }
            return null;
        }""",
        kind,
    )
    page.page.locator("canvas.timeline").click(position={"x": x, "y": y})
    return name, number


@pytest.mark.parametrize(
    ("way", "shown", "run"),
    [("served", "demo", 1), thorough("served", "systems", 3), thorough("file", "systems", 3)],
)
def test_picking_lights_up_exactly_the_flow(
    way: str,
    shown: str,
    run: int,
    request: pytest.FixtureRequest,
    read: Read,
    serve: Serve,
    report: Report,
    page: Page,
) -> None:
    database: Path = request.getfixturevalue(shown)
    connection = read(database)
    number = a_publication(connection, run)
    if way == "served":
        page.open(serve(database).address)
    else:
        page.open(report(database))
    page.go(f"#/timeline?run={run}&flow=publication:{number}")
    wanted = flow_of(connection, "publication", number)
    assert len(wanted) > 10
    assert page.flow() == wanted
    assert colors(page) > 10
    # The address leads back to it.
    address = page.page.url
    assert f"flow=publication%3A{number}" in address
    page.page.keyboard.press("Escape")
    page.page.locator(".side").wait_for(state="hidden")
    assert "flow=" not in page.page.url


def marked(page: Page) -> set[tuple[str, int]]:
    """Return what is marked as critical in the picked flow, once that is known."""
    page.page.locator(".steps-critical tbody tr").first.wait_for(state="attached", timeout=180_000)
    rows = page.page.locator(".steps tr.is-critical")
    found = rows.evaluate_all("rows => rows.map(row => [row.dataset.kind, row.dataset.id])")
    return {(kind, int(number)) for kind, number in found}


def require_critical_path_of_the_query(page: Page, database: Path, run: int) -> None:
    """Compare what the page marks and lists with what the command that it names gives."""
    shown_path = marked(page)
    lit = page.flow()
    words = shlex.split(page.page.locator(".side .command code").text_content() or "")
    assert words[:3] == ["msgflow", "flow", "--take"]
    assert (words[4:6], words[7:]) == (["--why", "--from"], ["--detail", "full"])
    with open_db(database) as opened:
        result = opened.flow_why(take_id=int(words[3]), from_=words[6], detail="full")
        pieces = result.to_arrow().to_pylist()
    assert [each.run_id for each in result.runs] == [run]
    assert len(pieces) > 2
    named = {
        (kind, row[f"{kind}_id"]) for row in pieces for kind in ("callback_instance", "publication")
    }
    assert {one for one in shown_path if one[0] != "take"} == named & lit
    assert ("take", pieces[0]["take_id"]) in shown_path
    cells = page.page.locator(".steps-critical tbody tr").evaluate_all(
        "rows => rows.map(row => [row.cells[0].textContent, row.cells[2].textContent])"
    )
    assert cells == [[f"+{shown(row['at_ns'])}", shown(row["duration_ns"])] for row in pieces]
    drawn = page.page.evaluate("""() => {
        const { lanes, flow } = msgflow.page.renderer;
        return [lanes[0].type, flow.pieces.rows, flow.edges.filter(edge => edge.critical).length];
    }""")
    assert drawn[:2] == ["critical", len(pieces)]
    assert drawn[2] >= 2


@pytest.mark.parametrize(
    ("run", "kind", "which"),
    [
        thorough(
            3,
            "publication",
            "SELECT min(publication_id) FROM publication JOIN publisher USING (publisher_id)"
            " WHERE publication.run_id = 3 AND topic_name = '/FrontLidarDriver'",
        ),
        thorough(
            3,
            "take",
            "SELECT quantile_disc(take_id, 0.5) FROM take JOIN subscription USING"
            " (subscription_id) WHERE take.run_id = 3 AND topic_name = '/VehicleInterface'",
        ),
        thorough(
            3,
            "callback_instance",
            "SELECT min(callback_instance_id) FROM link_causal"
            " WHERE run_id = 3 AND kind = 'periodic_async'",
        ),
        thorough(
            2,
            "publication",
            "SELECT quantile_disc(publication_id, 0.5) FROM publication JOIN"
            " publisher USING (publisher_id) WHERE publication.run_id = 2"
            " AND topic_name = '/RayGroundFilter'",
        ),
        thorough(
            1,
            "request",
            "SELECT quantile_disc(l.request_id, 0.5) FROM link_request AS l"
            " JOIN callback_instance AS i USING (callback_instance_id)"
            " JOIN link_causal AS c USING (callback_instance_id) WHERE l.run_id = 1",
        ),
    ],
)
def test_the_critical_path_of_any_vertex_is_that_of_the_query(
    run: int, kind: str, which: str, systems: Path, read: Read, serve: Serve, page: Page
) -> None:
    ((number,),) = read(systems).execute(which).fetchall()
    page.open(serve(systems).address)
    page.go(f"#/timeline?run={run}&flow={kind}:{number}")
    require_critical_path_of_the_query(page, systems, run)


def test_the_critical_path_is_that_of_the_query(
    demo: Path, read: Read, serve: Serve, page: Page
) -> None:
    number = a_publication(read(demo), 1)
    page.open(serve(demo).address)
    page.go(f"#/timeline?run=1&flow=publication:{number}")
    require_critical_path_of_the_query(page, demo, 1)


@pytest.mark.thorough
def test_a_report_has_the_critical_path_of_its_slowest_flows(
    demo: Path, read: Read, report: Report, page: Page
) -> None:
    page.open(report(demo))
    page.go("#/timeline")
    page.page.get_by_label("go to the slowest flow of a path").focus()
    slowest = page.page.get_by_label("go to the slowest flow of a path").locator("option")
    slowest.nth(1).wait_for(state="attached")
    values = slowest.evaluate_all("all => all.slice(1).map(one => [one.value, one.textContent])")
    latest = max(range(len(values)), key=lambda at: in_ns(values[at][1]))
    page.page.get_by_label("go to the slowest flow of a path").select_option(index=latest + 1)
    page.page.locator(f".steps tr[data-id='{values[latest][0].split(':')[1]}']").wait_for()
    require_critical_path_of_the_query(page, demo, 1)
    # Of others it says where to find it.
    number = a_publication(read(demo), 1)
    page.go(f"#/timeline?flow=publication:{number}")
    page.flow()
    assert "msgflow flow --why" in page.page.locator(".side").inner_text()
    assert page.page.locator(".steps tr.is-critical").count() == 0


def in_ns(text: str) -> float:
    value, unit = text.split()[:2]
    return float(value.replace(",", "")) * {"s": 1e9, "ms": 1e6, "µs": 1e3, "ns": 1}[unit]


@pytest.mark.thorough
@pytest.mark.parametrize("way", few(["served", "file"], "served"))
def test_clicking_a_bar_picks_it(
    way: str, recorded: Path, read: Read, serve: Serve, report: Report, page: Page
) -> None:
    page.open(serve(recorded).address if way == "served" else report(recorded))
    ((begin, end),) = (
        read(recorded)
        .execute(
            "SELECT quantile_disc(b.start_ns, 0.5) - r.start_ns AS begin, begin + 3000000"
            " FROM publication AS b JOIN link_transport USING (publication_id)"
            " CROSS JOIN run AS r GROUP BY r.start_ns"
        )
        .fetchall()
    )
    page.go(f"#/timeline?from={begin}&to={end}")
    for kind in (1, 0):
        name, number = pick_on_canvas(page, kind)
        page.page.locator(picked(name, number)).wait_for()
        assert page.flow() == flow_of(read(recorded), name, number)
        page.page.keyboard.press("Escape")
        page.page.locator(".side").wait_for(state="hidden")


def test_keys_and_boxes_move_and_hide(demo: Path, report: Report, page: Page) -> None:
    page.open(report(demo))
    page.go("#/timeline")
    page.page.keyboard.press("f")

    def view() -> tuple[float, float]:
        found = page.page.evaluate(
            "[msgflow.page.renderer.view.from, msgflow.page.renderer.view.to]"
        )
        return found[0], found[1]

    begin, end = view()
    page.page.locator("canvas.timeline").focus()
    page.page.keyboard.press("+")
    assert view()[1] - view()[0] == pytest.approx((end - begin) / 2)
    before = view()
    page.page.keyboard.press("ArrowRight")
    assert view()[0] > before[0]
    page.page.keyboard.press("f")
    assert view() == (begin, end)
    # To the nanosecond, and no further: three seconds halved 32 times are less than one.
    for _ in range(35):
        page.page.keyboard.press("+")
    assert 10 <= view()[1] - view()[0] <= 100
    page.page.keyboard.press("f")
    rows = "lanes.filter(lane => lane.type === 'row')"
    lanes = f"msgflow.page.renderer.{rows}.map(lane => lane.label)"
    every = page.page.evaluate(lanes)
    assert "/rosout" not in every
    page.page.get_by_label("show rows with this text").fill("/camera/image")
    found = "lanes.filter(lane => lane.type === 'row' && !lane.isBeside)"
    chosen = page.page.evaluate(f"msgflow.page.renderer.{found}.map(lane => lane.label)")
    assert set(chosen) == {"/camera/image"}
    page.page.get_by_label("show rows with this text").fill("")
    page.page.locator(".menu summary").click()
    page.page.get_by_label("what ROS does for itself").check()
    assert "/rosout" in page.page.evaluate(lanes)
    page.page.get_by_label("publishers").uncheck()
    assert "/rosout" not in page.page.evaluate(lanes)
    page.page.wait_for_url("**kind%3Apublisher*")
    assert "internal=1" in page.page.url
    picked = page.page.evaluate("msgflow.page.rows.row_key.length")
    assert picked > len(every)


def test_next_and_previous_of_a_row(demo: Path, read: Read, report: Report, page: Page) -> None:
    order = [
        number
        for (number,) in read(demo)
        .execute(
            "SELECT publication_id FROM publication JOIN publisher USING (publisher_id)"
            " WHERE topic_name = '/camera/image' ORDER BY start_ns"
        )
        .fetchall()
    ]
    page.open(report(demo))
    page.go(f"#/timeline?flow=publication:{order[5]}")
    for key, number in (("n", order[6]), ("p", order[5]), ("p", order[4])):
        page.page.keyboard.press(key)
        page.page.locator(picked("publication", number)).wait_for()


def test_numbers_of_the_overview_are_those_of_the_queries(
    demo: Path, serve: Serve, report: Report, page: Page
) -> None:
    with open_db(demo) as opened:
        latency = opened.query("e2e-latency").to_arrow().to_pylist()
    for address in (serve(demo).address, report(demo)):
        page.page.goto("about:blank")
        page.open(address)
        text = page.page.locator("main").inner_text()
        paths = page.page.locator(".slow .path-text").evaluate_all("all => all.map(p => p.title)")
        for row in latency:
            assert row["path"] in paths
            if row["p99_ns"] is not None:
                assert (
                    f"{row['p99_ns'] / 1e6:.3f}".rstrip("0").rstrip(".") in text
                    or row["p99_ns"] < 1e6
                )
        # Notes leave out what is typed on a command line.
        notes = page.page.locator(".notes").all_inner_texts()
        assert any("are known to" in note for note in notes)
        assert not any("msgflow " in note or "--" in note for note in notes)


def test_a_histogram_has_bins_without_flows_too(
    demo: Path, read: Read, report: Report, page: Page
) -> None:
    """Between the shortest and the longest latency, and one where the last one ends."""
    page.open(f"{report(demo)}#/paths")
    page.page.get_by_text("What the latency consists of").wait_for()
    bins = page.page.evaluate("msgflow.page.bins")
    path = page.page.locator("h2.path-title").text_content()
    with open_db(demo) as opened:
        rows = opened.query("e2e-latency").to_arrow().to_pylist()
    (expected,) = [row for row in rows if row["path"] == path]
    assert sum(bins["count"]) == expected["reached"]
    assert bins["count"][-1] == 0
    low = bins["low"]
    width = low[1] - low[0]
    assert [later - earlier for earlier, later in itertools.pairwise(low)] == [width] * (
        len(low) - 1
    )
    assert low[0] == expected["min_ns"]
    assert low[-2] <= expected["max_ns"] < low[-1]


@pytest.mark.thorough
def test_a_long_run_opens_where_bars_can_be_read(systems: Path, serve: Serve, page: Page) -> None:
    """Around the longest callback, with a way to the whole."""
    page.open(serve(systems).address)
    page.go("#/timeline?run=3")
    view = "[msgflow.page.renderer.view.from, msgflow.page.renderer.view.to]"
    start, end = page.page.evaluate(view)
    length = page.page.evaluate("msgflow.run.length")
    found, longest = page.page.evaluate(
        """() => {
            const { table } = msgflow.page.renderer.bars;
            const inside = [...table.start_at.keys()].filter(at =>
                table.start_at[at] < msgflow.page.renderer.view.to
                && table.start_at[at] + table.length[at] > msgflow.page.renderer.view.from);
            const calls = inside.filter(at => table.kind[at] === 0);
            return [inside.length, Math.max(...calls.map(at => table.length[at]))];
        }"""
    )
    assert end - start < length / 10
    assert 100 < found < 1600
    with open_db(systems) as opened:
        ((slowest,),) = opened.connection.execute(
            "SELECT max(end_ns - start_ns) FROM callback_instance WHERE run_id = 3"
        ).fetchall()
    assert longest == slowest
    page.page.locator("button.whole").click()
    assert page.page.evaluate(view) == [0, length]
    # A window in the address is kept, and so is the whole of a run with few bars.
    page.go("#/timeline?run=3&from=0&to=1000000")
    assert page.page.evaluate(view) == [0, 1_000_000]
    assert page.page.locator("button.whole").count() == 0


@pytest.mark.thorough
def test_a_topic_with_the_name_of_its_node_is_written_once(
    systems: Path, serve: Serve, page: Page
) -> None:
    page.open(serve(systems).address)
    for place in ("#/paths", "#/overview"):
        page.go(place)
        texts = page.page.locator("td.long, .path-text").all_inner_texts()
        assert any("/PointsTransformerFront" in text for text in texts)
        for text in texts:
            parts = text.split(" → ")
            assert all(one != other for one, other in itertools.pairwise(parts))


@pytest.fixture
def apart(simulated: Callable[..., Path]) -> Path:
    """The robot on two hosts, as recorded: each of its paths passes both."""
    return simulated("demo", 0.3)


@pytest.mark.parametrize(
    ("shown", "share"),
    [("apart", 1), ("demo", 0), thorough("systems", None)],
)
def test_durations_between_clocks_that_are_apart_are_marked(
    shown: str, share: int | None, request: pytest.FixtureRequest, serve: Serve, page: Page
) -> None:
    is_together = share == 0
    page.open(serve(request.getfixturevalue(shown)).address)
    page.go("#/paths")
    marked = page.page.locator("[data-path]:has(.doubt)").count()
    paths = page.page.locator("[data-path]").count()
    assert paths
    assert (0 < marked < paths) if share is None else (marked == share * paths)
    page.go("#/overview")
    page.page.locator(".slow li").first.wait_for()
    assert (page.page.locator(".slow .doubt").count() == 0) == is_together


@pytest.mark.thorough
def test_hosts_and_nodes_of_the_slowest_flow_stand_out_in_the_graph(
    systems: Path, report: Report, page: Page
) -> None:
    page.open(report(systems))
    page.go("#/graph")
    with open_db(systems) as opened:
        busy = opened.query("callbacks").to_arrow().to_pylist()
    heats = page.page.evaluate(
        "[...msgflow.page.model.vertices.values()].map(vertex => [vertex.label, vertex.busy ?? 0])"
    )
    totals: dict[str, int] = {}
    for row in busy:
        totals[row["node"]] = totals.get(row["node"], 0) + (row["total_ns"] or 0)
    assert {name: total for name, total in heats if total} == {
        name: total for name, total in totals.items() if total
    }
    page.page.locator(".vertex.slowest").first.wait_for(timeout=60_000)
    assert page.page.locator(".vertex.slowest").count() > 1
    colors_of = page.page.locator(".group-box").evaluate_all(
        "all => [...new Set(all.map(one => getComputedStyle(one).stroke))].length"
    )
    assert colors_of == 2
    legend = page.page.locator(".legend").inner_text()
    assert "on reference-system-1" in legend
    assert "on reference-system-2" in legend
    # All of it is in sight.
    room, drawn = page.page.evaluate("""() => {
        const [frame, svg] = [".graph", ".graph svg"].map(one => document.querySelector(one));
        return [[frame.clientWidth, frame.clientHeight], [svg.clientWidth, svg.clientHeight]];
    }""")
    assert drawn[0] <= room[0]
    assert drawn[1] <= room[1]


def test_executors_have_a_scale_and_a_legend_above_them(
    demo: Path, report: Report, page: Page
) -> None:
    page.open(report(demo))
    page.go("#/executors")
    page.page.locator("canvas.strip").first.wait_for()
    ticks = page.page.locator(".axis span").all_inner_texts()
    length = page.page.evaluate("msgflow.run.length")
    assert (ticks[0], ticks[-1]) == ("0", shown(length))
    tops = [
        page.page.locator(name).first.bounding_box()["y"]
        for name in (".legend", ".axis", "canvas.strip")
    ]
    assert tops == sorted(tops)


@pytest.mark.thorough
def test_a_table_that_is_wider_says_so_and_is_cards_on_a_phone(
    systems: Path, serve: Serve, page: Page
) -> None:
    page.open(serve(systems).address)
    page.page.set_viewport_size({"width": 700, "height": 800})
    page.go("#/paths")
    edge = page.page.locator(".table-edge").first
    inside = edge.locator(".table-scroll")
    page.page.locator(".table-edge.has-more").first.wait_for()
    inside.evaluate("one => { one.scrollLeft = one.scrollWidth; }")
    page.page.wait_for_function(
        "() => !document.querySelector('.table-edge').classList.contains('has-more')"
    )
    page.page.set_viewport_size({"width": 390, "height": 844})
    assert inside.evaluate("one => one.scrollWidth <= one.clientWidth")
    said = inside.locator("td.number").first.evaluate(
        "one => getComputedStyle(one, '::before').content"
    )
    assert said == '"median "'


def test_no_tab_is_out_of_sight_on_a_phone(demo: Path, report: Report, page: Page) -> None:
    page.page.set_viewport_size({"width": 390, "height": 844})
    page.open(report(demo))
    tabs = page.page.locator("nav .tabs a")
    boxes = [tab.bounding_box() for tab in tabs.all()]
    assert len(boxes) == 6
    assert all(box and box["x"] >= 0 and box["x"] + box["width"] <= 390 for box in boxes)
    # On a narrow screen, a long name of a run moves nothing but itself.
    page.page.set_viewport_size({"width": 800, "height": 844})
    first, second = (page.page.locator(one).bounding_box() for one in (".theme", "nav .tabs"))
    assert first["y"] + first["height"] <= second["y"]
    assert second["height"] < 2 * first["height"]


@pytest.mark.thorough
def test_a_screenshot_is_no_blank_page(demo: Path, read: Read, report: Report, page: Page) -> None:
    number = a_publication(read(demo), 1)
    for width, height, scheme in ((1280, 800, "light"), (390, 844, "dark")):
        page.page.set_viewport_size({"width": width, "height": height})
        page.page.emulate_media(color_scheme=scheme)
        page.open(f"{report(demo)}#/timeline?flow=publication:{number}")
        page.page.locator(".steps tbody tr").first.wait_for()
        assert colors(page) > 10
        assert len(page.page.screenshot()) > 15_000
        wide = page.page.evaluate("document.documentElement.scrollWidth")
        assert wide <= width


def test_a_report_has_all_in_it(demo: Path, report: Report) -> None:
    content = Path(report(demo).removeprefix("file://")).read_text(encoding="utf-8")
    assert "default-src 'none'" in content
    assert " src=" not in content.replace("img-src", "").replace("script-src", "").replace(
        "style-src", ""
    ).replace("default-src", "")
    packed = content.partition('id="msgflow-data">')[2].partition("</script>")[0]
    assert base64.b64decode(packed)[:2] == b"\x1f\x8b"
