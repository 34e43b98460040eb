"""The collector of golden cases itself."""

from __future__ import annotations

from pathlib import Path

import golden
import pytest


def test_an_empty_field_is_null_and_an_empty_text_is_not() -> None:
    assert golden.parse_csv('a,b,c\n1,,""\n') == [["a", "b", "c"], ["1", None, ""]]
    assert golden.parse_csv("a,b\n,\n") == [["a", "b"], [None, None]]
    assert golden.parse_csv("a\n\n") == [["a"], [None]]


def test_quotes_commas_and_lines_inside_of_quotes() -> None:
    assert golden.parse_csv('"a"\n"x,""y""\nz"') == [["a"], ['x,"y"\nz']]


def test_comments_are_left_out() -> None:
    assert golden.parse_csv('# why\na\n# this\n"# that"\n') == [["a"], ["# that"]]


def test_differences_are_named() -> None:
    rows = [["a"], ["1"], [None]]
    assert golden.compare(rows, [["a"], ["1"], [None]]) is None
    assert golden.compare(rows, [["a"], ["1"], [""]]) == "line 3: expected [None], got ['']"
    assert golden.compare(rows, [["a"], ["1"]]) == "expected 2 rows, got 1"


def make_case(folder: Path, derive: bool) -> Path:
    """Write a case in which one message is published and taken."""
    tables = {
        "publisher": "publisher_id,topic_name\n1,/a\n",
        "subscription": "subscription_id,topic_name\n1,/a\n",
        "publication": "publication_id,publisher_id,start_ns,end_ns,source_timestamp_ns\n"
        "1,1,10,11,10\n",
        "take": "take_id,subscription_id,taken_ns,source_timestamp_ns,method\n1,1,20,10,rmw\n",
    }
    case = folder / "main.flow_forward" / "one_message"
    (case / "input").mkdir(parents=True)
    for table, text in tables.items():
        (case / "input" / f"{table}.csv").write_text(text)
    (case / "params.json").write_text('{"start_kind": "publication", "start_id": 1}')
    if derive:
        (case / "derive").touch()
    return case


def test_links_are_derived_where_the_case_says_so(
    pytestconfig: pytest.Config, tmp_path: Path
) -> None:
    empty = golden.template(pytestconfig)
    with_links = golden.evaluate(make_case(tmp_path / "with", derive=True), empty)
    without = golden.evaluate(make_case(tmp_path / "without", derive=False), empty)
    start = ["publication", "1"]
    assert golden.parse_csv(without)[1:] == [start]
    assert golden.parse_csv(with_links)[1:] == [start, ["take", "1"]]


def test_a_column_that_does_not_exist_is_named(pytestconfig: pytest.Config, tmp_path: Path) -> None:
    case = make_case(tmp_path, derive=False)
    (case / "input" / "node.csv").write_text("node_id,colour\n1,red\n")
    with pytest.raises(ValueError, match=r"store\.node has no column colour"):
        golden.evaluate(case, golden.template(pytestconfig))
