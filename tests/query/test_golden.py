"""The collector of golden cases itself."""

from __future__ import annotations

from pathlib import Path

import pytest
from support import golden


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


CASE = """\
== params
{"start_kind": "publication", "start_id": 1}
== publisher
publisher_id,topic_name
1,/a
== subscription
subscription_id,topic_name
1,/a
== publication
publication_id,publisher_id,start_ns,end_ns,source_timestamp_ns
1,1,10,11,10
== take
take_id,subscription_id,taken_ns,source_timestamp_ns,method
1,1,20,10,rmw
== expected
"""


def make_case(folder: Path, text: str) -> Path:
    """Write a case of what comes of a publication."""
    case = folder / "main.flow_forward" / "one_message.case"
    case.parent.mkdir(parents=True)
    case.write_text(text)
    return case


def test_links_are_derived_where_the_case_says_so(
    pytestconfig: pytest.Config, tmp_path: Path
) -> None:
    bench = golden.bench(pytestconfig)
    with_links = bench.evaluate(make_case(tmp_path / "with", f"== derive\n{CASE}"))
    without = bench.evaluate(make_case(tmp_path / "without", CASE))
    start = ["publication", "1"]
    assert golden.parse_csv(without)[1:] == [start]
    assert golden.parse_csv(with_links)[1:] == [start, ["take", "1"]]


def test_a_column_that_does_not_exist_is_named(pytestconfig: pytest.Config, tmp_path: Path) -> None:
    case = make_case(tmp_path, f"== node\nnode_id,colour\n1,red\n{CASE}")
    with pytest.raises(ValueError, match=r"store\.node has no column colour"):
        golden.bench(pytestconfig).evaluate(case)


def test_a_case_has_what_its_system_has_unless_it_says_otherwise(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(golden, "SYSTEMS", tmp_path)
    (tmp_path / "shared.case").write_text("== node\nnode_id\n1\n== take\ntake_id\n1\n")
    case = golden.read_case(make_case(tmp_path, "== system shared\n== take\ntake_id\n2\n"))
    assert case.tables == {"node": "node_id\n1\n", "take": "take_id\n2\n"}


def test_an_expected_output_is_replaced() -> None:
    text = golden.updated(CASE, "kind\ntake\n")
    assert text == f"{CASE}kind\ntake\n"
    assert golden.updated(text, "") == CASE
