"""Functions of the page Nodes: a flame graph of what samples saw."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import duckdb
import pytest
from support.served import Page, Served
from support.tables import decoded

from msgflow import Database
from msgflow.database import open_db
from msgflow.errors import UsageError
from msgflow.view import pages as pages_module
from msgflow.view.pages import Pages

Serve = Callable[[Path], Served]
# An attacker names functions.
_NAMES = ("main", "work", "<img src=x onerror=hacked=1>")
_FRAMES = list(enumerate(_NAMES, 1))


@pytest.fixture
def sampled(dropping: Path, tmp_path: Path) -> Path:
    """The same system; three samples of the first callback instance saw two stacks."""
    path = tmp_path / "sampled.duckdb"
    shutil.copyfile(dropping, path)
    with duckdb.connect(str(path)) as connection:
        connection.executemany(
            "INSERT INTO store.stack_frame BY NAME SELECT 1 AS run_id, ? AS stack_frame_id,"
            " ? AS function, '' AS file",
            _FRAMES,
        )
        connection.execute(
            "INSERT INTO store.stack BY NAME SELECT 1 AS run_id, s AS stack_id,"
            " s + 1 AS stack_frame_id, s + 1 AS depth FROM range(1, 3) AS r (s)"
        )
        connection.execute(
            "INSERT INTO store.stack_call BY NAME SELECT 1 AS run_id, s AS stack_id, p AS position,"
            " p AS stack_frame_id FROM range(1, 3) AS r (s), range(1, s + 2) AS q (p)"
        )
        connection.execute(
            "INSERT INTO store.stack_sample BY NAME SELECT 1 AS run_id, process_id, thread_id,"
            " 1 AS tid, start_ns AS at_ns, 0 AS cpu, callback_instance_id, s AS stack_id"
            " FROM (SELECT * FROM store.callback_instance ORDER BY callback_instance_id LIMIT 1),"
            " (VALUES (1), (1), (2)) AS v (s)"
        )
    return path


def sample_every_callback(path: Path) -> None:
    with duckdb.connect(str(path)) as connection:
        connection.execute(
            "INSERT INTO store.stack_sample BY NAME SELECT 1 AS run_id, process_id, thread_id,"
            " 1 AS tid, start_ns AS at_ns, 0 AS cpu, callback_instance_id, 2 AS stack_id"
            " FROM store.callback_instance"
        )


def test_stacks_are_those_that_are_exported(
    sampled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pages_module, "MOST_STACKS", 1)
    with open_db(sampled) as opened:
        opened.export_folded(tmp_path / "folded")
        found = decoded(Pages().answer(opened.connection, "stack", {}))
    lines = (tmp_path / "folded").read_text().splitlines()
    assert [f"{row['stack']} {row['samples']}" for row in found.rows] == lines[:1]
    assert lines[0].endswith(";main;work 2")
    # Those with fewer samples are left out where there are too many, and that is said.
    assert found.meta["left_out"] == 1


def samples_on(database: Database, path: int, **choice: int) -> int:
    """Return the samples of callbacks on the way of the flows of a path: each saw `main`."""
    rows = database.query("functions", path=str(path), **choice).to_arrow().to_pylist()
    return sum(row["samples"] for row in rows if row["function"] == "main")


def test_stacks_of_the_slowest_flows_are_apart_from_those_of_the_others(sampled: Path) -> None:
    sample_every_callback(sampled)
    with open_db(sampled) as opened:
        pages = Pages()
        paths = decoded(pages.answer(opened.connection, "path", {})).rows
        numbers = {text: at for at, text in enumerate(sorted({row["path"] for row in paths}), 1)}
        path = max(paths, key=lambda row: len(row["path"]))
        asked = {"path": path["path_id"], "slowest": 3}
        found = decoded(pages.answer(opened.connection, "stack", asked))
        slow, others = (
            sum(row["samples"] for row in found.rows if row["part"] == part) for part in (0, 1)
        )
        number = numbers[path["path"]]
        assert slow == samples_on(opened, number, slowest=3) > 0
        assert slow + others == samples_on(opened, number) > slow
        assert f"query functions --path {number} --slowest 3 " in found.meta["command"]
        with pytest.raises(UsageError, match="the run has no such path — 999"):
            pages.answer(opened.connection, "stack", asked | {"path": 999})


@pytest.mark.thorough
def test_a_flame_graph_says_what_samples_saw(
    sampled: Path, demo: Path, serve: Serve, page: Page, tmp_path: Path
) -> None:
    page.open(serve(sampled).address)
    page.go("#/nodes?section=functions")
    frames = page.page.locator(".flame g.frame")
    frames.first.wait_for()
    titles = page.page.locator(".flame title").all_text_contents()
    assert "all samples: 3 samples" in titles
    assert {f"{_NAMES[0]}: 3 samples", f"{_NAMES[2]}: 1 sample"} <= set(titles)
    page.page.get_by_label("mark functions with this text").fill("<IMG")
    width = "() => +document.querySelector('.flame g[name=work] rect').getAttribute('width')"
    # Frames grow into their places. Only then their widths can be compared.
    page.page.wait_for_function(
        f"async () => {{ const w = ({width})(); await new Promise(r => setTimeout(r, 500));"
        f" return w === ({width})(); }}"
    )
    before = page.page.evaluate(width)
    page.page.locator(".flame g[name='<img src=x onerror=hacked=1>']").click()
    page.page.get_by_text("33.3 %, 1 sample").wait_for()
    assert page.page.evaluate("typeof hacked") == "undefined"
    page.page.get_by_role("button", name="all of it").click()
    page.page.wait_for_function(f"before => ({width})() === before", arg=before)
    # On the page Paths the slowest flows stand beside the others, if any has a sample: the first
    # callback, which has those above, led to no flow.
    whole = Path(shutil.copyfile(sampled, tmp_path / "whole.duckdb"))
    sample_every_callback(whole)
    page.open(serve(whole).address)
    page.go("#/paths")
    page.page.get_by_label("how many flows are the slowest").select_option("1")
    slowest = "[aria-label='flame graph of functions: the slowest flow'] g.frame"
    page.page.locator(slowest).first.wait_for()
    # Without samples there is no such section.
    page.open(serve(demo).address)
    page.go("#/nodes")
    page.page.evaluate("msgflow.page.complete")
    assert page.page.locator(".flame").count() == 0
