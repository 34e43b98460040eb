from __future__ import annotations

from pathlib import Path

import pytest
from support.header_rules import faults

from msgflow.db.store_table import store_tables
from msgflow.files.resources import resource_directory
from msgflow.query.catalogue import load_query
from msgflow.sql.header import Column, Header, HeaderError, Param, completed, parse, vocabulary

PATH = Path("queries/example.sql")

FULL = """\
-- title: An example
-- description: What it means,
--     on two lines.
-- grain: one row per path
-- param: from VARCHAR = NULL     Topic where flows start
-- param: case VARCHAR {every_pair|first} = 'first'  Which rows
-- param: limit BIGINT = 10  Most rows
-- param: share DOUBLE = 0.5
--     Part of
--     the whole
-- param: kinds VARCHAR[] = ['a', 'b']  Kinds
-- param: label VARCHAR = 'it''s  two'  Text
-- param: needed BIGINT  Has to be given
-- column: median_ns BIGINT [ns]  Half took no longer
-- column: hidden BOOLEAN Whether
-- column: size DECIMAL(18,3)  Size
-- column: start_ns BIGINT [epoch ns]
--     When
-- when: main.a WHERE kind IN ('a', 'b'),
--     main.b
-- also: main.c, main.d
-- brief: start_ns (heading),
--     median_ns (slowest), size (even 0), hidden (not 0)
-- severity: warning
SELECT 1
-- a comment of the body
"""


def parse_with(line: str) -> Header:
    return parse(f"-- title: Example\n-- description: x\n{line}\nSELECT 1\n", PATH)


def test_everything_is_parsed() -> None:
    header = parse(FULL, PATH)
    assert header.name == "example"
    assert header.title == "An example"
    assert header.description == "What it means, on two lines."
    assert header.grain == "one row per path"
    assert header.kind == "view"
    assert header.params == (
        Param("from", "VARCHAR", None, True, "Topic where flows start"),
        Param("case", "VARCHAR", "first", True, "Which rows", ("every_pair", "first")),
        Param("limit", "BIGINT", 10, True, "Most rows"),
        Param("share", "DOUBLE", 0.5, True, "Part of the whole"),
        Param("kinds", "VARCHAR[]", ["a", "b"], True, "Kinds"),
        Param("label", "VARCHAR", "it's  two", True, "Text"),
        Param("needed", "BIGINT", None, False, "Has to be given"),
    )
    assert header.columns == (
        Column("median_ns", "BIGINT", "ns", "Half took no longer"),
        Column("hidden", "BOOLEAN", None, "Whether"),
        Column("size", "DECIMAL(18,3)", None, "Size"),
        Column("start_ns", "BIGINT", "epoch ns", "When"),
    )
    assert header.sources == (("main.a", "kind IN ('a', 'b')"), ("main.b", ""))
    assert header.when == ("main.a", "main.b")
    assert header.also == ("main.c", "main.d")
    assert header.severity == "warning"
    assert header.brief == ("start_ns", "median_ns", "size", "hidden")
    assert header.answer == ("size",)
    assert header.heading == ("start_ns",)
    assert (header.slowest, header.zero) == ("median_ns", "hidden")
    assert header.body == "SELECT 1\n-- a comment of the body\n"


def test_an_object_needs_what_its_statements_name() -> None:
    header = parse_with(
        "-- when: staging.d, derive.f\n"
        "-- also: derive.g\n"
        "-- reads: derive.h, made\n"
        "CREATE OR REPLACE TEMP TABLE step AS\nFROM store.c;\n\n"
        "WITH e AS (FROM main.b) -- not main.x\nSELECT derive.f(e.main, 'a.b') FROM e\n"
        "JOIN query_table('raw.a') USING (id)"
    )
    assert header.needs == (
        "derive.f", "derive.g", "derive.h", "main.b", "raw.a", "staging.d", "store.c"
    )  # fmt: skip
    assert header.relations == {"e"}


def test_an_object_does_not_need_itself() -> None:
    text = "-- description: x\nCREATE MACRO main.a() AS TABLE FROM main.b\n"
    assert parse(text, resource_directory("schema") / "public" / "a.sql").needs == ("main.b",)


def test_folders_above_the_checkout_give_no_name() -> None:
    path = Path("/schema/model/msgflow/queries/topics.sql")
    assert parse("-- description: x\nSELECT 1\n", path).name == "topics"


@pytest.mark.parametrize(("limits", "maximum"), [("1..", None), ("1..64", 64)])
def test_an_integer_may_have_a_minimum(limits: str, maximum: int | None) -> None:
    (param,) = parse_with(f"-- param: depth BIGINT {{{limits}}} = 32  How deep").params
    assert param == Param("depth", "BIGINT", 32, True, "How deep", minimum=1, maximum=maximum)


def test_a_note_is_kept() -> None:
    assert parse_with("-- note: clocks").note == "clocks"
    assert parse_with("-- note: callbacks").note == "callbacks"
    assert parse_with("-- note: kernel").note == "kernel"
    assert parse_with("-- note: requests").note == "requests"
    assert parse_with("-- grain: one row").note is None


def test_the_title_defaults_to_the_name() -> None:
    assert parse("-- description: x\nSELECT 1\n", PATH).title == "example"


def test_a_macro_keeps_its_whole_statement() -> None:
    body = "-- Of a table.\nCREATE MACRO m() AS 1\n"
    header = parse(f"-- description: x\n\n{body}", PATH)
    assert header.kind == "macro"
    assert header.body == body


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("--param: a BIGINT  x", "example.sql: expected '-- field: value'"),
        ("-- param: a BIGINT", "example.sql: expected '-- param: name TYPE"),
        ("-- param: a BIGINT = 1 one space", "expected '-- param: name TYPE"),
        ("-- param: a BIGINT = one  Default", "'one' is not NULL, TRUE, FALSE, a number"),
        ("-- column: a-b", "example.sql: expected '-- column: name TYPE [unit]"),
    ],
)
def test_a_bad_line_is_named(line: str, message: str) -> None:
    with pytest.raises(HeaderError) as raised:
        parse_with(line)
    assert message in str(raised.value)


def test_a_name_alone_is_that_of_the_vocabulary() -> None:
    header = parse_with("-- param: max_depth,\n--     from\n-- column: run_id, path_id")
    known = {each.name: each for each in (*vocabulary().params, *vocabulary().columns)}
    assert [*header.params, *header.columns] == [
        known[name] for name in ("max_depth", "from", "run_id", "path_id")
    ]
    for key in ("param", "column"):
        with pytest.raises(HeaderError, match=f"nothing declares this {key} — moon"):
            parse_with(f"-- {key}: moon")


def test_a_variant_means_what_its_query_means() -> None:
    for path in ("queries/links-suggested.sql", "msgflow/fleet/sql/links.sql"):
        folder = resource_directory("queries").parent
        header = parse("-- description: x\n-- column: kind, run_id\nSELECT 1\n", folder / path)
        of_links = {column.name: column for column in load_query("links").columns}
        assert header.columns == (of_links["kind"], of_links["run_id"])
        assert "periodic_async" in header.columns[0].description


def test_the_table_declares_the_columns_of_a_public_view() -> None:
    text = "-- description: x\n-- column: run_id, path_id\nSELECT 1\n"
    header = parse(text, resource_directory("schema") / "public" / "callback.sql")
    assert header.columns == (Column("run_id", "", None, ""), Column("path_id", "", None, ""))
    (run_id, path_id) = completed(header, store_tables()["callback"].columns).columns
    assert run_id == store_tables()["callback"].columns["run_id"]
    assert path_id.description.startswith("Path, as main.flow_path")


def test_steps_of_another_file_come_first(tmp_path: Path) -> None:
    head, step = "-- description: x\n", "CREATE OR REPLACE TEMP TABLE {} AS\nFROM {};\n\n"
    made = "".join(
        step.format(*names) for names in (("first", "a"), ("other", "b"), ("c", "first"))
    )
    (tmp_path / "a.sql").write_text(f"{head}{made}SELECT 1\n")
    text = f"{head}-- reads: c, of_program\n{step.format('own', 'c')}SELECT 1\n"
    (tmp_path / "x.sql").write_text(text)
    header = parse(text, tmp_path / "x.sql")
    assert [made.table for made in header.steps] == ["first", "c", "own"]
    assert header.reads == ("c", "of_program")


def test_the_next_command_is_the_first_whose_columns_have_values() -> None:
    header = parse_with("-- next: query waits --node {node} | flow --take '{id} x' | check")
    assert header.next_command({"node": "/a b", "id": 1}) == ("query", "waits", "--node", "/a b")
    assert header.next_command({"node": None, "id": 1}) == ("flow", "--take", "1 x")
    assert header.next_command({}) == ("check",)
    assert parse_with("-- grain: one row").next_command({}) is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("SELECT 1\n", "there is no header"),
        ("", "there is no header"),
        ("--     first\nSELECT 1\n", "expected '-- field: value'"),
    ],
)
def test_an_incomplete_file_is_refused(text: str, message: str) -> None:
    with pytest.raises(HeaderError) as raised:
        parse(text, PATH)
    assert message in str(raised.value)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("-- colour: red", "unknown field 'colour'"),
        ("-- title: again", "'title' stands twice"),
        ("-- kind: macro", "says only that its kind is 'inline', not 'macro'"),
        ("-- param: a VARCHAR {b|c} = 'd'  x", "the default 'd' is not among the choices"),
        ("-- param: a BIGINT {1..} = 0  x", "the default 0 is less than 1"),
        ("-- param: a BIGINT {1..9} = 10  x", "the default 10 is more than 9"),
        ("-- param: a VARCHAR {1..}  x", "only an integer has a minimum"),
        ("-- note: moon", "note 'moon' is not one of callbacks"),
        ("-- param: a BIGINT  x\n-- param: a BIGINT  y", "'a' stands twice"),
        ("-- column: a BIGINT  x\n-- column: a BIGINT  y", "'a' stands twice"),
        ("-- column: b BIGINT  x\n-- brief: a", "brief names a column that there is not: 'a'"),
        (
            "-- column: b BIGINT  x\n-- brief: b (heading), b (0)",
            "brief has a mark that there is not: 'b (0)'",
        ),
    ],
)
def test_what_breaks_a_rule_is_found(line: str, message: str) -> None:
    text = f"-- title: x\n-- description: x\n{line}\nSELECT 1\n"
    assert [fault for fault in faults(text, parse(text, PATH)) if message in fault]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("-- title: x\nSELECT 1\n", "the header has no 'description'"),
        ("-- description: x\n\n", "there is no SQL below the header"),
    ],
)
def test_what_is_missing_is_found(text: str, message: str) -> None:
    assert list(faults(text, parse(text, PATH))) == [message]
