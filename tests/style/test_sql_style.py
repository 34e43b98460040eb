"""How SQL is written here: line length, indentation, explicit columns in what users see."""

from __future__ import annotations

import re

from each import each
from sql_files import SqlFile, sql_files

FILES = sql_files()
KEYWORDS = re.compile(
    r"(?<![\w$.'\"])(select|from|where|join|left join|group by|order by|having|union all|with|case"
    r"|when|then|else|end|over|partition by|limit|on|and|or|not|in|is null|as)(?![\w.'\"])"
)
SIGNATURE = re.compile(r"MACRO [a-z_.]+\(([^()]*)\) AS")
MACROS = [file for file in FILES if file.header.kind == "macro"]
SHOWN = [file for file in FILES if file.layer in {"public", "queries"}]


def code_lines(file: SqlFile) -> list[str]:
    """Lines of the body without comments and text in quotes."""
    # In one pass: two hyphens in quotes, as of an option, begin no comment.
    found = re.compile(r"--[^\n]*|(?P<quoted>'(?:[^']|'')*')")
    return found.sub(lambda each: "''" if each["quoted"] else "", file.header.body).splitlines()


@each(FILES)
def test_lines_are_short_and_indented_by_spaces(file: SqlFile) -> None:
    for line in file.path.read_text().splitlines():
        assert len(line) <= 100, line
        assert "\t" not in line, line
        assert line == line.rstrip(), line


@each(FILES)
def test_keywords_are_upper_case(file: SqlFile) -> None:
    for line in code_lines(file):
        assert not KEYWORDS.search(line), line


@each(SHOWN)
def test_columns_are_listed(file: SqlFile) -> None:
    last = "\n".join(code_lines(file)).rpartition("SELECT")[2]
    assert not re.match(r"\s*(DISTINCT\s+)?\*", last)


@each(MACROS)
def test_parameters_for_runs_have_one_name(file: SqlFile) -> None:
    """The run of a macro is `only_run`, a name that no column has; several are `runs`.

    The two sides of a comparison are other runs.
    """
    signatures = SIGNATURE.findall("\n".join(code_lines(file)))
    assert signatures
    for signature in signatures:
        names = {part.partition(":=")[0].strip() for part in signature.split(",")}
        about_runs = {name for name in names if re.search(r"(?:^|_)runs?(?:_|$)", name)}
        assert about_runs <= {"only_run", "runs", "run_a", "run_b"}
