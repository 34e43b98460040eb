"""The header at the top of every SQL file: what the object means, takes, and returns.

    -- title: End-to-end latency by path
    -- description: Time from the start of a flow's root to the end of its sink,
    --     one line continued by four spaces.
    -- grain: one row per path
    -- param: from VARCHAR = NULL     Topic where flows start; every source when NULL
    -- param: case VARCHAR {first|last} = 'first'     Which rows count
    -- param: depth BIGINT {1..} = 32     How deep; at least 1
    -- param: bins BIGINT {1..2000} = 80     How many; at most 2000
    -- column: median_ns BIGINT [ns]  Half of the flows took no longer
    -- brief: rank (heading), path, median_ns (slowest), lost (even 0)
    -- note: clocks
    -- when: staging.gap
    -- also: derive.a_b
    -- reads: path_chain, derive.a_c
    -- next: query topics --topic {topic_name} | check
    -- variant: measure VARCHAR {latency|age} = 'latency'  What is measured
    -- column: run_id, path_id, root_ns

The header ends at the first line that is not a `--` comment. Two spaces end a parameter's default.
The name of the object is that of its file; below `schema/` the schema that the objects of its
folder are in stands before. Only what others put in front of theirs says its kind: `inline`.

- `column`: of what people see: public views, queries, pages, results. Others name columns in SQL.
- `note: clocks`: rows compare times of hosts, so the runner names clocks that differ.
- `note: callbacks`: rows are made of callbacks, so the runner names processes that record none.
- `note: kernel`: rows are made of the kernel's events, so the runner says where there are none.
- `note: requests`: likewise of requests to services. The rows compare times of hosts as well.
- `note: goals`: likewise of goals of actions.
- `note: samples`: likewise of samples of functions. The rows compare times of hosts as well.
- `note: usage`: likewise of samples of the system.
- `brief`: the columns that a narrow terminal shows, the most important first. A mark behind one
  says how the rows are shown on a terminal: `(heading)`, above a table, once for each value of the
  first of these, on which the others depend; `(even 0)`, also where it is 0 in all rows, since
  people ask for it; `(not 0)`, rows in which it is 0 are left out. `--slowest N` goes by the column
  with the mark `(slowest)`.
- `when`: tables, views, or macros of a run. If none of them has a row, this object has none either,
  and an ingest does not run its SQL. A condition may follow a name, as in
  `store.gap WHERE kind = 'loss'`: then only such rows count. In the model only tables count, and
  the empty table is made by its statement in `schema/model.sql`.
- `also`: objects whose rows are stored in the table of this one, too. Each has a `when` of its own,
  so that what few recordings have is planned only there.
- `reads`: tables that the statement reads, and that something else makes: a step of another query
  of the folder, which then comes first, with what that step reads; else the program, before it runs
  the statement. Names with a schema are objects of `schema/`: an ingest makes one table of the rows
  of all of them, and gives its name to the macro as the first argument, the run as the second. An
  object whose `when` finds no row is left out.
- `next`: the command that shows more, or cures: words behind `msgflow`. `{node}` stands for the
  value of that column in the row, as one word. Of several, with ` | ` between them, the first holds
  whose columns all have values.

- `variant`: a parameter whose values are queries of their own. The default is this file, and `age`
  stands in the file of the same name with `-age` behind it; a BOOLEAN `each`, in that with `-each`.
  A query may have several: each value of them is one file.

A `param` or `column` may be a list of names, whose meaning stands elsewhere: for a variant in its
query (NAME-variant.sql, or NAME.sql of a lake), for a public view in the table of the same name,
else in `schema/vocabulary.sql`. There stands what several files mean alike. A file
in which a word means something else declares it itself.

The unit of a column may also say what the column names: 'node', 'topic', 'callback', 'host' or
'path'. Options that choose rows by them use it. Files in `schema/health` have a
`severity`, a `cause` and a `cure`. An object is made after all objects that its statement, its
`when`, its `also` or its `reads` names.

Outside of `schema/public`, what most statements take needs no declaration: the run (`run`,
`run_id`, or `only_run` of a macro) or `runs`; `start_ns` and `end_ns`, a window of time in epoch
ns, without its end; `origin_ns`, the moment from which times of pages count.

The tables that a statement looks up stay in memory until it ends. A query may therefore go in
steps, as may an object of the model: other statements stand before its own, each of the form
`CREATE OR REPLACE TEMP TABLE name AS SELECT …;`. Nothing else reads these tables. A line
`-- when: main.a, main.b` above one names what it has its rows from, as in the header: where that
has no row, the table is empty, and DuckDB does not look at the SQL. The line below says which
columns it has: `-- columns: a_id BIGINT`. Both may be continued, and of other steps the first ones
stand in front.

What few recordings have may stand behind `WHERE $has_kernel`, or another name of RECORDED
(`msgflow.sql.statement`). DuckDB plans nothing for it where no recording has any.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from msgflow.files.resources import resource_directory
from msgflow.sql.value import Value, parse_literal

_HEAD = re.compile(r"(?:--[^\n]*(?:\n|$))*")
_FIELD = re.compile(r"-- (?P<key>[a-z_]+):(?: +(?P<value>\S.*))?")
_CONTINUATION = re.compile(r"-- {4,}(?P<value>\S.*)")
_NAME = r"(?P<name>[A-Za-z_][A-Za-z0-9_]*)"
_NAMES = re.compile(r"\w+(?:, *\w+)*")
_TYPE = r"(?P<type>[A-Za-z_][A-Za-z0-9_]*(?:\([A-Z0-9, ]+\))?(?:\[\])*)"
_CHOICES = r"(?: +\{(?P<choices>[^{}]+)\})?"
_DEFAULT = r"(?: += +(?P<default>'(?:[^']|'')*'|\[[^\]]*\]|[^'\s\[]\S*))?"
_PARAM = re.compile(rf"{_NAME} +{_TYPE}{_CHOICES}{_DEFAULT}(?P<gap> +)(?P<description>\S.*)")
_COLUMN = re.compile(rf"{_NAME} +{_TYPE}(?: +\[(?P<unit>[^\]]+)\])? +(?P<description>\S.*)")
_STEP = re.compile(
    r"(?:-- when: (?P<when>.*?)\n"
    r"-- columns: (?P<columns>[^\n]*(?:\n-- {4,}[^\n]*)*)\n|--[^\n]*\n)*?"
    r"CREATE OR REPLACE TEMP TABLE (?P<table>[a-z_]+) AS\n.*?;\n+",
    re.DOTALL,
)
_MADE = re.compile(r"^CREATE OR REPLACE TEMP TABLE ([a-z_]+) AS$", re.MULTILINE)
_WORD = re.compile(r"[a-z_]+")
_PLACEHOLDER = re.compile(r"\{([a-z_]+)\}")
_COMMENT = re.compile(r"--[^\n]*")
# Without a word's begin, which would take twice the time. No alias ends like a schema.
_OBJECT = re.compile(r"(?:raw|staging|store|derive|main)\.[a-z_0-9]+\b")
_RELATION = re.compile(r"\b(?:FROM|JOIN) ([a-z_0-9]+)\b(?![.(])")
_NEXT_SOURCE = re.compile(r", (?=[a-z]+\.)")
_RANGE = re.compile(r"(-?\d+)\.\.(-?\d+)?")
_MACRO = re.compile(r"(?:--[^\n]*\n|\s)*CREATE (?:OR REPLACE )?MACRO ")
# The schema of the database that the objects of a folder of `schema/` are in.
SCHEMAS = {
    "alignment": "staging",
    "model": "staging",
    "kernel": "staging",
    "arrival": "staging",
    "overlap": "overlap",
    "link": "derive",
    "clock": "derive",
    "delivery": "derive",
    "flow": "derive",
    "stat": "derive",
    "public": "main",
    "health": "finding",
    "internal": "internal",
    "culprit": "culprit",
}
# Fields of a header that have the text that stands there, or the names.
_TEXTS = ("severity", "cause", "cure", "note")
_LISTS = ("also", "reads")


class HeaderError(ValueError):
    """A header that cannot be read: a mistake in an SQL file, not of the user."""


@dataclass(frozen=True)
class Param:
    """A parameter, bound as `$name`."""

    name: str  # as written after the dollar sign
    type: str  # DuckDB type
    default: Value  # the value bound when none is given; meaningless unless `has_default`
    has_default: bool  # false where the caller has to give a value
    description: str  # one sentence
    choices: tuple[str, ...] = ()  # the only values allowed, or empty for any
    minimum: int | None = None  # the least integer allowed, or None for any
    maximum: int | None = None  # the greatest one, likewise; only what strangers ask for has one


@dataclass(frozen=True)
class Column:
    """A column of the output."""

    name: str
    type: str  # DuckDB type as `DESCRIBE` prints it; empty where only a table says so
    unit: str | None  # 'ns' for a duration, 'epoch ns' for a point in time, what it names, …
    description: str  # one sentence


@dataclass(frozen=True)
class Step:
    """A table on the way to the result of a query."""

    table: str
    sql: str  # the statement that makes it
    # Tables and views, each with a condition on its rows, or with an empty one: if none of them has
    # such a row, the table has none. Not known when empty.
    sources: tuple[tuple[str, str], ...] = ()
    columns: str = ""  # names and types, where there are sources


@dataclass(frozen=True)
class Header:
    """The header of an SQL file, and the SQL below it; the grammar above explains the rest."""

    name: str  # the file's name, below `schema/` behind the schema that it is in
    title: str  # a few words for lists; the name where the file has none
    description: str  # what it means
    grain: str  # "one row per …"; empty for scalar macros
    # 'view' (the body is a SELECT; in the model a table is made of it), 'inline' (the same, but
    # never made a table) or 'macro' (the body is the whole statement)
    kind: str
    body: str  # the SQL below the header; of a query in steps, the statement that returns its rows
    path: Path
    params: tuple[Param, ...] = ()  # parameters in the order of the file
    columns: tuple[Column, ...] = ()  # output columns in the order of the file
    severity: str | None = None  # severity of a finding, else None
    cause: str | None = None  # cause of a finding, else None
    cure: str | None = None  # remedy for a finding, else None
    note: str | None = None
    brief: tuple[str, ...] = ()
    answer: tuple[str, ...] = ()  # columns that a terminal shows even where all are 0
    heading: tuple[str, ...] = ()  # columns that stand above a table
    slowest: str | None = None  # column by which rows are the slowest, else None
    zero: str | None = None  # column that is 0 in rows that a terminal leaves out, else None
    steps: tuple[Step, ...] = ()  # what a query makes before, in order
    sources: tuple[tuple[str, str], ...] = ()  # of `when`, each with its condition or ''
    also: tuple[str, ...] = ()  # objects whose rows are stored in the same table
    reads: tuple[str, ...] = ()  # tables that others make, and objects whose rows become one
    next: tuple[tuple[str, ...], ...] = ()  # commands, each the words behind `msgflow`
    variants: tuple[Param, ...] = ()
    # of a variant: the name of the query, and the option that chooses this one
    chosen: str | None = None
    # whether a query has a command of its own name, in place of `msgflow query NAME`
    is_command: bool = False

    @property
    def words(self) -> str:
        """The name of a query, and the option of a variant."""
        return self.chosen or self.name

    @property
    def command(self) -> str:
        """What a user types to ask a query."""
        return f"msgflow {self.words}" if self.is_command else f"msgflow query {self.words}"

    @property
    def when(self) -> tuple[str, ...]:
        """The names of `sources`."""
        return tuple(name for name, _ in self.sources)

    @cached_property
    def needs(self) -> tuple[str, ...]:
        """The objects and tables that come before this one, as `schema.name`, sorted.

        A name in a string counts, since a table may be given to a macro by name.
        """
        named = (name for text in self.statements for name in _OBJECT.findall(_code(text)))
        return tuple(sorted({*named, *self.when, *self.also, *self.united} - {self.name}))

    @property
    def united(self) -> tuple[str, ...]:
        """The objects of `reads`, whose rows a macro takes as one table."""
        return tuple(name for name in self.reads if "." in name)

    @cached_property
    def relations(self) -> frozenset[str]:
        """The names without a schema that the statements read from; see `relations_of`."""
        return frozenset().union(*map(relations_of, self.statements))

    @property
    def statements(self) -> tuple[str, ...]:
        """All that is executed, in order."""
        return (*(step.sql for step in self.steps), self.body)

    @property
    def has_window(self) -> bool:
        """Whether there is a window of time to give."""
        return any("$start_ns" in statement for statement in self.statements)

    def next_command(self, row: Mapping[str, object]) -> tuple[str, ...] | None:
        """Return the words behind `msgflow` of the command that shows more of a row."""
        for words in self.next:
            columns = _PLACEHOLDER.findall(" ".join(words))
            if all(row.get(column) is not None for column in columns):
                return tuple(_PLACEHOLDER.sub(lambda place: str(row[place[1]]), w) for w in words)
        return None


def parse(text: str, path: Path) -> Header:
    """Parse the text of an SQL file.

    Tests see to it that all files follow the rest of the grammar.
    """
    fields, body = _split(text, path)
    steps, body = _steps(body)
    single = dict(fields)
    brief = [name.partition(" ")[::2] for name in _names(single.get("brief", ""))]

    def marked(mark: str) -> tuple[str, ...]:
        return tuple(name for name, its_mark in brief if its_mark == mark)

    params: tuple[Param, ...] = _declared("param", fields, _param, path)
    columns: tuple[Column, ...] = _declared("column", fields, _column, path)
    if "reads" in single:
        steps = (*_read_steps(_names(single["reads"]), path), *steps)
    name = name_of(path)
    return Header(
        name=name,
        title=single.get("title", name),
        description=single.get("description", ""),
        grain=single.get("grain", ""),
        kind=single.get("kind", "macro" if _MACRO.match(body) else "view"),
        params=params,
        columns=columns,
        body=body,
        path=path,
        steps=steps,
        sources=_sources(single.get("when", "")),
        brief=tuple(name for name, _ in brief),
        answer=marked("(even 0)"),
        heading=marked("(heading)"),
        slowest=next(iter(marked("(slowest)")), None),
        zero=next(iter(marked("(not 0)")), None),
        variants=_declared("variant", fields, _param, path),
        next=tuple(tuple(shlex.split(one)) for one in single.get("next", "").split(" | ") if one),
        **{key: single.get(key) for key in _TEXTS},  # type: ignore[arg-type]
        **{key: _names(single.get(key, "")) for key in _LISTS},  # type: ignore[arg-type]
    )


def read(path: Path) -> Header:
    """Parse the SQL file at `path`."""
    return parse(path.read_text(encoding="utf-8"), path)


def name_of(path: Path) -> str:
    """Return the name that the object of a file has by its place."""
    root = resource_directory("schema").parts
    below = path.parts[len(root) :] if path.parts[: len(root)] == root else ()
    schema = SCHEMAS.get(below[0]) if below else None
    return path.stem if schema is None else f"{schema}.{path.stem}"


def relations_of(text: str) -> frozenset[str]:
    """Return the names without a schema that SQL reads from: tables, other statements, CTEs."""
    return frozenset(_RELATION.findall(_code(text)))


def _split(text: str, path: Path) -> tuple[list[tuple[str, str]], str]:
    body = _HEAD.sub("", text, count=1)
    fields: list[tuple[str, str]] = []
    for line in map(str.rstrip, text[: len(text) - len(body)].splitlines()):
        if fields and (continuation := _CONTINUATION.fullmatch(line)):
            key, value = fields.pop()
            # Two spaces, so that the description of a parameter may begin on the next line.
            gap = "  " if key in ("param", "variant") else " "
            fields.append((key, f"{value}{gap}{continuation['value']}".strip()))
        elif match := _FIELD.fullmatch(line):
            fields.append((match["key"], match["value"] or ""))
        else:
            raise HeaderError(
                f"{path}: expected '-- field: value', or a continuation after four spaces, not"
                f" {line!r} (separate other comments from the header by an empty line)"
            )
    if not fields:
        raise HeaderError(f"{path}: there is no header")
    return fields, body.strip("\n") + "\n"


def _steps(body: str) -> tuple[tuple[Step, ...], str]:
    steps: list[Step] = []
    while match := _STEP.match(body):
        sources, columns = _sources(_joined(match["when"])), _joined(match["columns"])
        steps.append(Step(match["table"], match[0].rstrip(), sources, columns))
        body = body[match.end() :]
    return tuple(steps), body


def _joined(value: str | None) -> str:
    return re.sub(r"\n-- +", " ", value or "")


def _code(text: str) -> str:
    return _COMMENT.sub("", text)


def _names(text: str) -> tuple[str, ...]:
    return tuple(filter(None, map(str.strip, text.split(","))))


def _sources(text: str) -> tuple[tuple[str, str], ...]:
    parts = (part.partition(" WHERE ") for part in _NEXT_SOURCE.split(text) if part)
    return tuple((name, condition) for name, _, condition in parts)


def _read_steps(tables: Iterable[str], path: Path) -> tuple[Step, ...]:
    """Return the steps of other queries that make these tables, and what those steps read."""
    found: dict[str, Step] = {}
    for table in tables:
        if (maker := _makers(path.parent).get(table, path)) == path:
            continue
        wanted, steps = {table}, []
        for step in reversed(_declaring(maker).steps):
            if step.table in wanted:
                steps.append(step)
                wanted.update(_WORD.findall(_code(step.sql)))
        found |= {step.table: step for step in reversed(steps)}
    return tuple(found.values())


@cache
def _makers(folder: Path) -> Mapping[str, Path]:
    """Return for each table that a step makes in a folder the file of the step."""
    return {
        table: path
        for path in sorted(folder.glob("*.sql"))
        for table in _MADE.findall(path.read_text(encoding="utf-8"))
    }


def vocabulary() -> Header:
    """Return the parameters and columns that several files mean alike."""
    return _declaring(resource_directory("schema") / "vocabulary.sql")


def completed(header: Header, declared: Mapping[str, Column] | None = None) -> Header:
    """Fill in the columns that a public file only names: as a table declares them, or as meant."""
    known = {column.name: column for column in vocabulary().columns} | dict(declared or {})
    columns = (column if column.type else known[column.name] for column in header.columns)
    return replace(header, columns=tuple(columns))


def _meaning(key: str, name: str, path: Path) -> Param | Column:
    """Return what a name means that stands alone in a file."""
    # A table may declare the columns of a public view, and is not known here.
    if key == "column" and path.parent.name == "public":
        return Column(name, "", None, "")
    base = _base(path)
    for header in (vocabulary(),) if base is None else (_declaring(base), vocabulary()):
        for item in header.params if key == "param" else header.columns:
            if item.name == name:
                return item
    raise ValueError(f"nothing declares this {key} — {name}")


def _base(path: Path) -> Path | None:
    """Return the query that a file is a variant of, or that it asks of a lake."""
    queries, name = resource_directory("queries"), path.stem.replace("_", "-")
    if path.parent == queries:
        name = name.rpartition("-")[0]
    elif path.parent.parent.name != "fleet":
        return None
    base = queries / f"{name}.sql"
    return base if base.exists() else None


_declaring = cache(read)


def _declared(
    key: str, fields: Iterable[tuple[str, str]], read_value: Callable[[str], Any], path: Path
) -> tuple[Any, ...]:
    """Return what all fields of a key declare."""
    items: list[Any] = []
    for value in (value for each, value in fields if each == key):
        try:
            if _NAMES.fullmatch(value):
                items += (_meaning(key, name, path) for name in _names(value))
            else:
                items.append(read_value(value))
        except ValueError as error:
            raise HeaderError(f"{path}: {error}") from None
    return tuple(items)


def _param(text: str) -> Param:
    match = _PARAM.fullmatch(text)
    if match is None or (match["default"] is not None and len(match["gap"]) < 2):
        raise ValueError(
            "expected '-- param: name TYPE {choice|choice} = default  description' (choices, or"
            " {least..} or {least..most} of an integer, and default may be left out, two spaces end"
            f" the default), not {text!r}"
        )
    choices = tuple(part.strip() for part in (match["choices"] or "").split("|") if part.strip())
    minimum: int | None = None
    maximum: int | None = None
    if limits := _RANGE.fullmatch("|".join(choices)):
        minimum, choices = int(limits[1]), ()
        maximum = int(limits[2]) if limits[2] else None
    default = None if match["default"] is None else parse_literal(match["default"])
    return Param(
        name=match["name"],
        type=match["type"],
        default=default,
        has_default=match["default"] is not None,
        description=" ".join(match["description"].split()),
        choices=choices,
        minimum=minimum,
        maximum=maximum,
    )


def _column(text: str) -> Column:
    match = _COLUMN.fullmatch(text)
    if match is None:
        raise ValueError(f"expected '-- column: name TYPE [unit]  description', not {text!r}")
    return Column(match["name"], match["type"], match["unit"], match["description"])
