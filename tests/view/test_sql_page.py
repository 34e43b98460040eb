"""The SQL page: what the server answers, and what a browser makes of it."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlencode

import duckdb
import pytest
from support.hostile import HOSTILE, renamed
from support.processes import children_of, has_ended
from support.served import Page, Served
from support.tables import Decoded, decoded
from support.thorough import thorough

from msgflow.database import open_db
from msgflow.sql.header import read as read_header
from msgflow.view.sql_page import MOST_ROWS, examples

Serve = Callable[[Path], Served]
Read = Callable[[Path], duckdb.DuckDBPyConnection]
SLOW = "SELECT levenshtein(repeat('a', 400000), repeat('b', 400000))"
LONGEST = (
    "SELECT c.callback_instance_id, b.node, c.start_ns, c.end_ns - c.start_ns AS duration_ns\n"
    "FROM callback_instance AS c\n"
    "JOIN callback_label AS b ON c.callback_id = b.callback_id\n"
    "ORDER BY duration_ns DESC, 1"
)


def ask(server: Served, text: str, **more: Any) -> Decoded:
    status, _, content = server.get(f"/api/sql?{urlencode({'text': text, **more})}")
    assert status == 200, content
    return decoded(content)


def test_rows_of_any_names_and_types(demo: Path, serve: Serve) -> None:
    found = ask(
        serve(demo),
        """
        SELECT 1 AS rows, 2 AS rows, 1.5 AS meta, sum(i) AS "__proto__", true AS "a b", NULL AS n,
            10::HUGEINT ** 30 AS large, 9007199254740993 AS exact, 18446744073709551615 AS most,
            'a' AS text, [1, 2] AS list, {'a': 'nan'::DOUBLE} AS struct, 'x'::BLOB AS bytes,
            'inf'::DOUBLE AS endless, DATE '2020-01-02' AS day, 'b'::ENUM ('a', 'b') AS kind
        FROM range(3) AS t (i)
        """,
    )
    assert found.meta["names"] == [
        "rows",
        "rows_1",
        "meta",
        "__proto__",
        "a b",
        "n",
        "large",
        "exact",
        "most",
        "text",
        "list",
        "struct",
        "bytes",
        "endless",
        "day",
        "kind",
    ]
    (row,) = found.rows
    assert list(row.values()) == [
        1,
        2,
        1.5,
        3,
        True,
        None,
        1e30,
        "9007199254740993",
        "18446744073709551615",
        "a",
        "[1, 2]",
        '{"a": null}',
        "78",
        float("inf"),
        "2020-01-02",
        "b",
    ]
    assert ask(serve(demo), "SELECT 1 AS a WHERE false").rows == []


def test_rows_are_limited_and_it_is_said(demo: Path, serve: Serve) -> None:
    server = serve(demo)
    found = ask(server, "FROM range(2000)")
    assert (len(found.rows), found.meta["is_cut"]) == (1000, True)
    found = ask(server, "FROM range(2000)", rows=2000)
    assert (len(found.rows), found.meta["is_cut"]) == (2000, False)
    for rows in ("0", "-1", "x", "1.5", str(MOST_ROWS + 1), "9" * 40):
        status, _, content = server.get(f"/api/sql?text=FROM+run&rows={rows}")
        assert status == 400
        assert "rows is a whole number from 1" in json.loads(content)["error"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "there is no SQL to run"),
        ("DELETE FROM run", "not a statement that only reads"),
        ("SELECT 1; SELECT 2", "one query at a time"),
        ("COPY run TO '/tmp/x'", "not a statement that only reads"),
        ("FROM read_text('/etc/passwd')", "file system operations are disabled"),
        ("SELECT list_sum(range(700000000))", "more memory"),
        ("SELECT\n nothing FROM run", "LINE 2:  nothing FROM run\n         ^^^^^^^"),
        ("EXPLAIN SELECT\n nothing FROM run", "LINE 2:  nothing FROM run"),
        ("SELECT 1 FROM\n\nFROM", "LINE 3"),
        ("SELECT $a", "parameters: a"),
    ],
)
def test_what_is_wrong_with_a_query_is_an_answer(
    demo: Path, serve: Serve, text: str, said: str
) -> None:
    assert said in ask(serve(demo), text).meta["error"]


def test_the_examples_are_those_of_the_cookbook(demo: Path, read: Read) -> None:
    connection = read(demo)
    listed = examples().to_pylist()
    assert len(listed) == 10
    assert listed[0]["title"] == "How many messages per second, over time?"
    assert listed[6]["sql"].startswith("WITH part AS")
    for example in listed:
        connection.execute(example["sql"]).fetchall()


@pytest.mark.thorough
def test_a_query_that_takes_too_long_ends(demo: Path, tmp_path: Path) -> None:
    server = Served(Path(shutil.copyfile(demo, tmp_path / "late.duckdb")), seconds=2)
    try:
        assert "longer than 2 s" in ask(server, SLOW).meta["error"]
        assert len(ask(server, "FROM run").rows) == 1
    finally:
        server.close()


def test_a_query_that_nobody_waits_for_ends_and_keeps_no_page_waiting(
    demo: Path, serve: Serve
) -> None:
    server = serve(demo)
    ask(server, "FROM run")
    with socket.create_connection(("127.0.0.1", server.port)) as reader:
        reader.sendall(
            f"GET /api/sql?{urlencode({'text': SLOW})} HTTP/1.1\r\n"
            f"Host: 127.0.0.1:{server.port}\r\n"
            f"X-Token: {server.token}\r\n\r\n".encode()
        )
        time.sleep(0.5)
        begin = time.monotonic()
        assert server.get("/api/run")[0] == 200
    # The query behind it begins when it has ended.
    assert len(ask(server, "FROM run").rows) == 1
    assert time.monotonic() - begin < 15


@pytest.mark.thorough
def test_a_query_of_a_replaced_database_says_so(demo: Path, tmp_path: Path) -> None:
    path = Path(shutil.copyfile(demo, tmp_path / "copy.duckdb"))
    server = Served(path)
    try:
        before = server.generation()
        asked = "/api/sql?text=FROM+run"
        assert server.get(asked, X_Generation=before)[0] == 200
        os.utime(path, ns=(1, 1))
        status, _, content = server.get(asked, X_Generation=before)
        assert status == 409
        assert json.loads(content)["code"] == "replaced"
        assert server.get(asked, X_Generation=server.generation())[0] == 200
    finally:
        server.close()


@pytest.mark.thorough
def test_a_signal_ends_the_server_and_the_query(demo: Path, tmp_path: Path) -> None:
    path = Path(shutil.copyfile(demo, tmp_path / "copy.duckdb"))
    words = [sys.executable, "-m", "msgflow", "ui", "--no-browser", "--port", "0"]
    with subprocess.Popen(
        [*words, "--db", str(path)], stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        place, _, token = process.stderr.readline().strip().partition("/?token=")
        port = int(place.rpartition(":")[2])
        with socket.create_connection(("127.0.0.1", port)) as reader:
            reader.sendall(
                f"GET /api/sql?{urlencode({'text': SLOW})} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n"
                f"X-Token: {token}\r\n\r\n".encode()
            )
            for _ in range(200):
                if children := children_of(process.pid):
                    break
                time.sleep(0.05)
            time.sleep(1)
            process.send_signal(signal.SIGINT)
            begin = time.monotonic()
            _, error = process.communicate(timeout=60)
            assert time.monotonic() - begin < 10
        assert "Traceback" not in error
        assert all(map(has_ended, children))


def shown_rows(page: Page) -> list[list[str]]:
    """Return the cells of the table of rows, once it is there."""
    page.page.get_by_role("region", name="rows", exact=True).wait_for(timeout=30_000)
    found: list[list[str]] = page.page.locator(".sql-result tbody tr").evaluate_all(
        "rows => rows.map(row => [...row.cells].map(cell => cell.textContent))"
    )
    return found


def written(page: Page, text: str) -> None:
    """Write a text in place of what is in the editor."""
    page.page.locator(".editor .cm-content").click()
    page.page.keyboard.press("Control+A")
    page.page.keyboard.type(text)


def completions(page: Page) -> list[str]:
    options = page.page.locator(".editor .cm-completionLabel")
    options.first.wait_for(timeout=10_000)
    # A key that is pressed as the list opens is not meant for it.
    page.page.wait_for_timeout(150)
    found: list[str] = options.all_inner_texts()
    return found


@pytest.mark.thorough
def test_the_editor_completes_views_and_columns(demo: Path, serve: Serve, page: Page) -> None:
    page.open(serve(demo).address)
    page.go("#/sql")
    written(page, "SELECT * FROM callback_inst")
    assert completions(page)[0] == "callback_instance"
    page.page.keyboard.press("Enter")
    page.page.keyboard.type(" AS c WHERE c.end")
    assert completions(page) == ["end_ns", "is_end_inferred", "parent_id", "response_id"]
    assert "epoch ns" in page.page.locator(".editor .cm-completionInfo").inner_text()
    page.page.keyboard.press("Enter")
    # Of the views that are named, columns without a name in front as well.
    page.page.keyboard.type(" > 0 AND callback_i")
    assert {"callback_id", "callback_instance_id"} <= set(completions(page))
    page.page.keyboard.press("Escape")
    page.page.keyboard.type("d > 0 orde")
    assert completions(page)[0] == "ORDER"
    page.page.keyboard.press("Enter")
    page.page.keyboard.type(" BY ")
    # A click on a name beside the text writes it there.
    page.page.get_by_label("show views with this text").fill("callback_instance")
    names = (
        page.page.get_by_label("views and columns")
        .locator("details")
        .filter(has=page.page.get_by_role("button", name="callback_instance", exact=True))
    )
    names.locator("summary").first.click(position={"x": 5, "y": 8})
    names.get_by_role("button", name="start_ns", exact=True).first.click()
    page.page.keyboard.type(" LIMIT 3")
    page.page.keyboard.press("Escape")
    page.page.keyboard.press("Control+Enter")
    assert len(shown_rows(page)) == 3
    assert page.page.locator(".failed").count() == 0


def test_rows_are_those_of_msgflow_sql(demo: Path, serve: Serve, page: Page) -> None:
    page.open(serve(demo).address)
    page.go(f"#/sql?text={quote(LONGEST)}")
    with open_db(demo) as opened:
        wanted = [
            ["" if value is None else str(value) for value in row.values()]
            for row in opened.sql(LONGEST, limit=100).to_arrow().to_pylist()
        ]
    assert shown_rows(page) == wanted
    assert "1,000 rows in" in page.page.locator(".sql-result").inner_text()
    assert "there are more" in page.page.locator(".sql-result .notes").inner_text()
    heads = page.page.locator(".sql-result th").all_inner_texts()
    assert heads == ["callback_instance_id", "node", "start_ns", "duration_ns"]
    # Times are numbers for the page: they are sorted as such.
    page.page.get_by_role("button", name="start_ns").click()
    page.page.get_by_role("button", name="start_ns").click()
    starts = [int(row[2]) for row in shown_rows(page)]
    assert starts == sorted(starts)
    with page.page.expect_download() as download:
        page.page.locator(".sql-result").get_by_role("button", name="CSV").click()
    assert download.value.path().read_text().splitlines()[0] == (
        '"callback_instance_id","node","start_ns","duration_ns"'
    )


@pytest.mark.thorough
def test_a_link_carries_query_rows_and_chart(demo: Path, serve: Serve, page: Page) -> None:
    page.open(serve(demo).address)
    page.go("#/sql")
    written(page, "SELECT i AS x, i * i AS y FROM range(1500) AS t (i) -- <b>")
    page.page.get_by_label("most rows").select_option("10000")
    page.page.get_by_role("button", name="Run", exact=True).click()
    shown_rows(page)
    page.page.get_by_role("button", name="line", exact=True).click()
    page.page.locator(".chart canvas").wait_for()
    address = page.page.url
    page.page.goto("about:blank")
    page.open(address)
    page.page.locator(".chart canvas").wait_for(timeout=30_000)
    assert "1,500 rows" in page.page.locator(".sql-result").inner_text()
    assert "range(1500)" in page.page.locator(".editor .cm-content").inner_text()
    # What was typed is there when one comes back.
    page.go("#/paths")
    page.go("#/sql")
    assert "range(1500)" in page.page.locator(".editor .cm-content").inner_text()


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("drawing", "across", "upwards"),
    [
        ("line", "at", "every number"),
        thorough("bars", "name", "a_ns"),
        thorough("histogram", "b", None),
    ],
)
def test_charts(
    demo: Path, serve: Serve, page: Page, drawing: str, across: str, upwards: str | None
) -> None:
    text = (
        "SELECT 'n' || i AS name, i * 10 AS at, i * 1000000 AS a_ns, i / 7 AS b"
        " FROM range(70) AS t (i)"
    )
    page.open(serve(demo).address)
    page.go(f"#/sql?draw={drawing}&text={quote(text)}")
    page.page.get_by_label("across").select_option(across)
    if upwards is not None:
        page.page.get_by_label("upwards").select_option(upwards)
    page.page.locator(".chart canvas").wait_for()
    page.page.wait_for_function(
        """() => {
            const canvas = document.querySelector(".chart canvas");
            const picture = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
            return new Set(new Uint32Array(picture.data.buffer)).size > 5;
        }"""
    )
    with page.page.expect_download() as download:
        page.page.locator(".chart-frame").get_by_role("button", name="CSV").click()
    rows = download.value.path().read_text().splitlines()
    if drawing == "line":
        assert rows[0] == '"at","a_ns","b"'
        assert rows[2].startswith("10,1000000,0.142857")
    elif drawing == "bars":
        assert rows[0] == '"row","a_ns"'
        assert rows[1:3] == ["0,0", "1,1000000"]
        assert "The first 60 rows" in page.page.locator(".sql-result").inner_text()
    else:
        counts = [int(row.split(",")[1]) for row in rows[1:-1]]
        assert len(counts) == 9
        assert sum(counts) == 70


@pytest.mark.thorough
def test_charts_of_what_cannot_be_drawn(demo: Path, serve: Serve, page: Page) -> None:
    page.open(serve(demo).address)
    for text in ("SELECT 'a' AS name", "SELECT 1 AS a WHERE false", "SELECT NULL::INT AS a"):
        for drawing in ("line", "bars", "histogram"):
            page.go(f"#/sql?draw={drawing}&text={quote(text)}")
            assert page.page.locator(".failed").count() == 0
    page.go(f"#/sql?draw=histogram&text={quote('SELECT 5 AS a FROM range(3)')}")
    page.page.locator(".chart canvas").wait_for()


@pytest.mark.thorough
def test_explain(demo: Path, serve: Serve, page: Page) -> None:
    page.open(serve(demo).address)
    page.go(f"#/sql?text={quote('SELECT name FROM run; -- end')}")
    shown_rows(page)
    page.page.get_by_role("button", name="EXPLAIN").click()
    page.page.locator(".plan").wait_for()
    assert "store.run" in page.page.locator(".plan").inner_text()
    assert "EXPLAIN" not in page.page.url


def test_an_error_is_in_duckdbs_words_and_marks_its_line(
    demo: Path, serve: Serve, page: Page
) -> None:
    page.open(serve(demo).address)
    page.go(f"#/sql?text={quote('SELECT name,' + chr(10) + '  nothing FROM run')}")
    said = page.page.locator(".sql-result .failed")
    said.wait_for()
    assert 'Referenced column "nothing" not found' in said.inner_text()
    assert "Candidate bindings" in said.inner_text()
    assert page.page.locator(".editor .wrong").all_inner_texts() == ["  nothing FROM run"]
    page.page.get_by_role("button", name="EXPLAIN").click()
    page.page.locator(".sql-result .failed").wait_for()
    assert page.page.locator(".editor .wrong").all_inner_texts() == ["  nothing FROM run"]
    # What is typed may be right.
    page.page.locator(".editor .cm-content").click()
    page.page.keyboard.type("x")
    assert page.page.locator(".editor .wrong").count() == 0
    written(page, " ")
    page.page.get_by_role("button", name="Run", exact=True).click()
    assert "no SQL to run" in said.inner_text()
    page.go(f"#/sql?text={'x' * 60_000}")
    assert "too long" in said.inner_text()


@pytest.mark.thorough
def test_a_query_can_be_stopped(demo: Path, serve: Serve, page: Page) -> None:
    page.open(serve(demo).address)
    page.go("#/sql")
    written(page, SLOW)
    page.page.get_by_role("button", name="Run", exact=True).click()
    page.page.get_by_role("button", name="Stop").click()
    page.page.get_by_text("stopped", exact=True).wait_for()
    written(page, "SELECT 1 AS one")
    page.page.get_by_role("button", name="Run", exact=True).click()
    assert shown_rows(page) == [["1"]]
    assert not page.page.get_by_role("button", name="Stop").is_visible()


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        thorough(
            "SELECT 'x' AS x, max(callback_instance_id) AS callback_instance_id"
            " FROM callback_instance WHERE run_id = 1",
            "callback_instance",
        ),
        thorough(
            "SELECT max(take_id) AS take_id, 1 AS publication_id FROM take WHERE run_id = 2", None
        ),
        thorough("SELECT 'take' AS kind, max(take_id) AS id FROM take WHERE run_id = 1", "take"),
        (
            "SELECT 7 AS path, 'publication' AS root_kind, max(publication_id) AS root_id,"
            " 1 AS take_id FROM publication WHERE run_id = 2",
            "publication",
        ),
    ],
)
def test_a_row_leads_to_its_flow_in_its_run(
    systems: Path, serve: Serve, page: Page, read: Read, text: str, wanted: str | None
) -> None:
    row = read(systems).execute(text).fetchall()[0]
    kind, number = (
        (wanted, row[2 if wanted == "publication" else 1])
        if wanted
        else (
            "publication",
            1,
        )
    )
    page.open(serve(systems).address)
    page.go(f"#/sql?run=3&text={quote(text)}")
    shown_rows(page)
    page.page.locator(".sql-result .pick").first.click()
    page.page.wait_for_url("**#/timeline*", timeout=30_000)
    assert (kind, number) in page.flow()
    column = f"{kind}_id"
    ((run,),) = (
        read(systems).execute(f"SELECT run_id FROM {kind} WHERE {column} = {number}").fetchall()
    )
    assert page.page.evaluate("msgflow.run.run_id") == run


@pytest.mark.thorough
def test_a_time_leads_to_its_moment(demo: Path, serve: Serve, page: Page, read: Read) -> None:
    text = "SELECT start_ns + 1000000000 AS at FROM run UNION ALL SELECT NULL"
    page.open(serve(demo).address)
    page.go(f"#/sql?text={quote(text)}")
    page.page.get_by_text("A click on a row leads").wait_for()
    page.page.locator(".sql-result .pick").first.click()
    page.page.wait_for_url("**#/timeline*")
    page.page.locator("canvas.timeline").wait_for()
    page.page.wait_for_function(
        "() => { const view = msgflow.page?.renderer?.view;"
        " return view?.from < 1e9 && view.to > 1e9 && view.to - view.from < 200e6; }"
    )


@pytest.mark.thorough
def test_rows_without_a_place_on_the_timeline_are_no_buttons(
    demo: Path, serve: Serve, page: Page
) -> None:
    page.open(serve(demo).address)
    page.go(
        f"#/sql?text={quote('SELECT 1741944414828624446 + 10 ** 17::BIGINT AS at_ns, 5 AS id')}"
    )
    shown_rows(page)
    assert page.page.locator(".sql-result .pick").count() == 0


@pytest.mark.thorough
def test_a_named_query_is_saved(
    demo: Path, serve: Serve, page: Page, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = (
        "SELECT run_id, n.full_name AS node, count(*) AS timers, min(start_ns) AS start_ns,"
        " 1.5 AS share\nFROM node AS n CROSS JOIN range(2) JOIN run USING (run_id)"
        "\nGROUP BY ALL\nORDER BY ALL;"
    )
    page.open(serve(demo).address)
    page.go(f"#/sql?text={quote(text)}")
    page.page.get_by_role("button", name="Save as named query").click()
    page.page.get_by_label("name of the query").fill("node-timers")
    page.page.get_by_label("title of the query").fill("Timers  of\teach node")
    with page.page.expect_download() as download:
        page.page.get_by_role("button", name="Download").click()
    assert download.value.suggested_filename == "node-timers.sql"
    content = download.value.path().read_text()
    assert content.strip() == page.page.locator(".query-file").inner_text().strip()
    target = tmp_path / "node-timers.sql"
    target.write_text(content)
    header = read_header(target)
    assert (header.name, header.title) == ("node-timers", "Timers of each node")
    assert [(column.name, column.type, column.unit) for column in header.columns] == [
        ("run_id", "BIGINT", None),
        ("node", "VARCHAR", None),
        ("timers", "BIGINT", None),
        ("start_ns", "BIGINT", "epoch ns"),
        ("share", "DECIMAL(2,1)", None),
    ]
    with open_db(demo) as opened:
        assert opened.sql(content).to_arrow().equals(opened.sql(text).to_arrow())
    page.page.get_by_label("name of the query").fill("../x")
    page.page.get_by_role("button", name="Download").click()
    assert page.page.evaluate("document.activeElement.validity.valid") is False


@pytest.mark.thorough
def test_names_are_only_ever_text_on_the_sql_page(
    systems: Path, tmp_path: Path, page: Page
) -> None:
    path = renamed(systems, tmp_path / "hostile.duckdb", HOSTILE)
    names = ", ".join(
        f"""{at} AS "{name.replace('"', '""')}\"""" for at, name in enumerate(HOSTILE)
    )
    names = names.replace("\0", "")
    server = Served(path)
    try:
        page.open(server.address)
        for text in (
            "SELECT * FROM callback_label JOIN node ON node = full_name",
            f"SELECT {names} FROM range(3)",
        ):
            for drawing in ("table", "line", "bars", "histogram"):
                page.go(f"#/sql?draw={drawing}&text={quote(text)}")
                page.page.locator(".sql-result section").wait_for()
                page.page.wait_for_timeout(100)
            page.page.get_by_role("button", name="Save as named query").click()
            page.page.locator(".query-file").wait_for()
            for made in ("img", "script", "iframe", "a[href^=http]", "a[href^=javascript]"):
                assert page.page.locator(f"main {made}").count() == 0
        for text in ("%3Cimg%20src%3Dx%20onerror%3Dhacked%3D1%3E", "'%3Cscript%3E"):
            page.go(f"#/sql?text={text}&draw={text}&rows={text}")
            page.page.locator(".sql-result .failed").wait_for()
        assert page.page.evaluate("typeof hacked") == "undefined"
    finally:
        page.page.goto("about:blank")
        server.close()


def test_a_report_has_no_sql_page(demo: Path, report: Callable[..., str], page: Page) -> None:
    page.open(report(demo))
    assert page.page.get_by_role("link", name="SQL").count() == 0
