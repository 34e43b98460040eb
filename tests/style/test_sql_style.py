"""How SQL is written here: line length, indentation, explicit columns in what users see."""

from __future__ import annotations

import re

from support.each import each
from support.sql_files import SqlFile, sql_files
from support.sql_layout import fixed, sql_paths, wrong_lines

from msgflow.db.objects import VIEW_LAYERS

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


def test_expressions_have_lines_of_their_own() -> None:
    wrong = [f"{path}:{line}" for path in sql_paths() for line in wrong_lines(path.read_text())]
    assert not wrong, "python tests/support/sql_layout.py --fix"


CROWDED = """\
WITH last AS (SELECT thread_id, max(start_ns) AS start_ns FROM run GROUP BY thread_id),
chosen AS (
    SELECT
        -- What a user asked for.
        a.run_id, a.thread_id, 0, a.name AS thread, -- as it is now
        CASE
            WHEN a.is_first THEN 'first'
            ELSE 'later' END AS place, a.end_ns, a.start_ns
    FROM thread AS a
)
SELECT run_id, thread_id FROM chosen WHERE name IS DISTINCT FROM 'x, y AS z'
"""
LAID_OUT = """\
WITH last AS (
    SELECT
        thread_id,
        max(start_ns) AS start_ns
    FROM run
    GROUP BY thread_id
),
chosen AS (
    SELECT
        -- What a user asked for.
        a.run_id, a.thread_id, 0,
        a.name AS thread, -- as it is now
        CASE
            WHEN a.is_first THEN 'first'
            ELSE 'later' END AS place,
        a.end_ns, a.start_ns
    FROM thread AS a
)
SELECT run_id, thread_id FROM chosen WHERE name IS DISTINCT FROM 'x, y AS z'
"""


def test_layout_moves_only_expressions_that_share_a_line() -> None:
    assert wrong_lines(CROWDED) == [1, 3]
    assert fixed(CROWDED) == LAID_OUT
    assert not wrong_lines(LAID_OUT)


def test_layout_breaks_a_line_that_gets_too_long() -> None:
    first = "coalesce(waited_for_the_cpu_ns, 0) + coalesce(ready_ns, 0)"
    sql = f"a AS (SELECT b, {first} - coalesce(running_on_another_cpu_ns, 0) AS c FROM d)\n"
    assert fixed(sql).splitlines()[2:5] == [
        "        b,",
        f"        {first}",
        "            - coalesce(running_on_another_cpu_ns, 0) AS c",
    ]


@each([file for file in FILES if file.layer in VIEW_LAYERS])
def test_a_stored_definition_names_what_it_leaves_out(file: SqlFile) -> None:
    """DuckDB keeps several columns of EXCLUDE or REPLACE in no order: the text would change."""
    code = "\n".join(code_lines(file))
    for list_ in re.findall(r"(?:EXCLUDE|REPLACE) \(([^()]*(?:\([^()]*\)[^()]*)*)\)", code):
        assert "," not in re.sub(r"\([^()]*\)", "", list_), list_
