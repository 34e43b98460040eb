"""The timeline of a real browser: threads and cores as the kernel saw them."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import duckdb
import pytest
from support.served import Page, Served

Serve = Callable[[Path], Served]
_KINDS = "[...new Set(msgflow.page.renderer.lanes.map(lane => lane.kind))]"
_FIRST = "(SELECT start_ns FROM store.run)"
_PLACE = """(kind) => {
    const { renderer } = msgflow.page;
    const { table, ranges } = renderer.bars;
    const lane = renderer.lanes.find(lane => lane.kind === kind);
    const [first, last] = ranges.get(lane.key);
    for (let at = first; at < last; at++) {
        if (table.kind[at] !== 14) continue;
        msgflow.page.scrollTo(lane.y);
        msgflow.page.redraw();
        return [renderer.x(table.start_at[at] + table.length[at] / 2),
            30 + lane.y - renderer.scroll + lane.height / 2];
    }
}"""


@pytest.fixture(params=["taken"])
def traced(dropping: Path, tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """The same system, with a kernel trace of one of its threads, which loses the CPU once."""
    path = tmp_path / f"{request.param}.duckdb"
    shutil.copyfile(dropping, path)
    with duckdb.connect(str(path)) as connection:
        connection.execute(
            "INSERT INTO store.other_thread BY NAME SELECT 1 AS other_thread_id, run_id, host_id,"
            " 911 AS tid, 'stress' AS name FROM store.host LIMIT 1"
        )
        states = (
            "(0, 30, 'running', NULL), (30, 70, 'preempted', 1), (70, 80, 'running', NULL), "
            "(80, 95, 'sleeping', NULL)"
        )
        connection.execute(
            "INSERT INTO store.thread_state BY NAME SELECT t.run_id, t.thread_id, "
            f"{_FIRST} + s.b * 1000000 AS start_ns, {_FIRST} + s.e * 1000000 AS end_ns, s.state, "
            "0 AS cpu, CASE WHEN NOT $idle THEN s.other END AS preempted_by_other_thread_id, "
            "coalesce($idle AND s.other = 1, false) AS is_cpu_idle, false AS is_loss_affected "
            f"FROM (VALUES {states}) AS s (b, e, state, other) "
            "CROSS JOIN (SELECT * FROM store.thread ORDER BY thread_id LIMIT 1) AS t",
            {"idle": request.param == "idle"},
        )
    return path


@pytest.mark.thorough
def test_threads_and_cores_say_what_took_the_cpu(traced: Path, serve: Serve, page: Page) -> None:
    page.open(f"{serve(traced).address}#/timeline?from=0&to=100000000")
    assert {"schedule", "core"} <= set(page.page.evaluate(_KINDS))
    assert page.page.locator(".legend-states").get_by_text("runnable").is_visible()
    for kind, said in (("schedule", "preempted by stress 911"), ("core", "stress 911 took it")):
        x, y = page.page.evaluate(_PLACE, kind)
        page.page.locator("canvas.timeline").hover(position={"x": x, "y": y})
        assert f"{said}: 40 ms" in page.page.locator(".tooltip").inner_text()


@pytest.mark.thorough
def test_without_a_kernel_trace_there_is_nothing_of_it(
    dropping: Path, serve: Serve, page: Page
) -> None:
    page.open(f"{serve(dropping).address}#/timeline?from=0&to=100000000")
    assert not {"schedule", "core"} & set(page.page.evaluate(_KINDS))
    assert not page.page.locator(".legend-states").is_visible()
    page.page.locator("details.menu summary").click()
    assert not page.page.get_by_label("cores").is_visible()
    assert page.page.get_by_label("executors").is_visible()


@pytest.mark.thorough
@pytest.mark.parametrize("traced", ["idle"], indirect=True)
def test_an_idle_cpu_was_taken_by_no_thread(traced: Path, serve: Serve, page: Page) -> None:
    page.open(f"{serve(traced).address}#/timeline?from=0&to=100000000")
    said_of = {
        "schedule": "ready, but without its CPU, which is idle (a quota, or a limit)",
        "core": "idle, while a thread is ready",
    }
    for kind, said in said_of.items():
        x, y = page.page.evaluate(_PLACE, kind)
        page.page.locator("canvas.timeline").hover(position={"x": x, "y": y})
        assert f"{said}: 40 ms" in page.page.locator(".tooltip").inner_text()


@pytest.mark.thorough
def test_programs_that_used_the_cpus_have_a_chart(
    dropping: Path, tmp_path: Path, serve: Serve, page: Page
) -> None:
    path = tmp_path / "sampled.duckdb"
    shutil.copyfile(dropping, path)
    with duckdb.connect(str(path)) as connection:
        connection.execute(
            "INSERT INTO store.program_usage BY NAME SELECT r.run_id, h.host_id, p.pid, p.name, "
            "r.start_ns + p.from_ns AS start_ns, r.start_ns + p.from_ns + 1000 AS end_ns, p.cpu_ns "
            "FROM store.run AS r, store.host AS h, (VALUES (0, 5, 'stress', 700), "
            "(0, 6, 'tar', 300), (1000, 5, 'stress', 500)) AS p (from_ns, pid, name, cpu_ns)"
        )
    page.open(f"{serve(path).address}#/nodes")
    page.page.get_by_role("button", name="Executors").click()
    chart = page.page.get_by_role("img", name="what used the CPUs of")
    chart.wait_for()
    assert "stress" in chart.inner_text()
    assert "tar" in chart.inner_text()


@pytest.mark.thorough
def test_a_process_is_called_by_its_only_node_and_a_row_by_its_function(
    dropping: Path, serve: Serve, page: Page
) -> None:
    page.open(f"{serve(dropping).address}#/timeline")
    lanes = page.page.evaluate(
        "msgflow.page.renderer.lanes.map(({ type, label, name }) => [type, label, name ?? null])"
    )
    headings = [label for kind, label, _ in lanes if kind == "process"]
    assert headings
    assert all(label.startswith("/") and " · " in label for label in headings)
    assert not [label for kind, label, _ in lanes if kind == "node"]
    assert any(name for kind, _, name in lanes if kind == "row")
