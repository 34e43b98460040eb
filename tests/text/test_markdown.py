from __future__ import annotations

import pytest

from msgflow.text.markdown import code, code_lines, markdown_line


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("/scan", "`/scan`"),
        ("<img src=x> [a](b) @all", "`<img src=x> [a](b) @all`"),
        ("a`b", "`` a`b ``"),
        ("``", "``` `` ```"),
    ],
)
def test_code_is_longer_than_the_ticks_in_it(text: str, written: str) -> None:
    assert code(text) == written


def test_a_cell_does_not_end_its_column() -> None:
    assert markdown_line(["a|b", "c"]) == r"| a\|b | c |"


def test_lines_do_not_end_the_block_of_code() -> None:
    assert code_lines(["a", "b\n```\n# c"]) == ["````", "a", "b\n```\n# c", "````"]
