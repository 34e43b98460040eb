"""Selection of rows of a query, their order and number: a SELECT around its SQL."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.text.name_suggestions import column_named

if TYPE_CHECKING:
    from msgflow.sql.header import Header
    from msgflow.sql.value import Value

# Kinds of names in columns: headers of queries have them in place of a unit.
KINDS = ("node", "topic", "callback", "host")
# Pairs of root and arrival that count: those of the first or last arrival of each root, of the
# newest root of each arrival, or all.
CASES = ("first", "last", "newest", "every_pair")
PATH = "path"
INTERNAL_COLUMN = "is_internal"
CUT_COLUMN = "is_cut"
# Columns beside those of the query; the last is missing where no row is left.
COUNTS = ("msgflow total", "msgflow hidden", "msgflow cut")
PLACE = "msgflow place"


@dataclass(frozen=True)
class Selection:
    """Which rows of a result are wanted."""

    node: tuple[str, ...] = ()  # names of nodes, or globs: rows that name any of them
    topic: tuple[str, ...] = ()  # likewise topics
    callback: tuple[str, ...] = ()  # likewise callbacks, as msgflow names them: 'Timer(*)'
    host: tuple[str, ...] = ()  # likewise hosts
    via: tuple[str, ...] = ()  # nodes, topics or services: paths that visit all of them
    without: tuple[str, ...] = ()  # paths that visit none of them
    where: str | None = None  # a condition in SQL, already known to read only
    sort: tuple[str, ...] = ()  # columns, each with ':desc' or ':asc' behind it or not
    limit: int | None = None  # most rows; all when None
    slowest: int | None = None  # so many of the slowest rows; all when None

    def names(self) -> dict[str, tuple[str, ...]]:
        """Return the wanted names by kind; a 'visit' is a place or a path."""
        given = {kind: getattr(self, kind) for kind in KINDS} | {"visit": self.via + self.without}
        return {kind: names for kind, names in given.items() if names}


def selected(header: Header, selection: Selection, internal: bool) -> tuple[str, dict[str, Value]]:
    """Return the SQL of a query inside the selection, and its additional bindings.

    The columns COUNTS and PLACE come after those of the query: the number of rows before the limit,
    of internal rows that are hidden, and of rows that are cut off. There is always a row; if its
    PLACE is NULL, no row was selected.
    """
    names = [column.name for column in header.columns]
    conditions, bindings = conditions_of(header, selection)
    if selection.where is not None:
        # The line break ends a comment in the condition.
        conditions.append(f"(\n{selection.where}\n)")
    is_hidden = f"coalesce({INTERNAL_COLUMN}, false)" if INTERNAL_COLUMN in names else "false"
    if internal:
        is_hidden = "false"
    is_cut = CUT_COLUMN if CUT_COLUMN in names else "false"
    order = [*_order(header, selection), f'"{PLACE}"']
    limit = selection.limit if selection.slowest is None else selection.slowest
    first = "" if limit is None else f"ORDER BY {', '.join(order)} LIMIT {int(limit)}"
    total, hidden, cut = (f'"{name}"' for name in COUNTS)
    sql = f"""
WITH numbered AS (
    SELECT *, row_number() OVER () AS "{PLACE}" FROM (
{header.body.rstrip().rstrip(";")}
    )
),
wanted AS MATERIALIZED (
    SELECT * FROM numbered AS result WHERE {" AND ".join(conditions) or "true"}
),
counted AS (
    SELECT
        count(*) FILTER (WHERE NOT {is_hidden}) AS {total},
        count(*) FILTER (WHERE {is_hidden}) AS {hidden},
        count(*) FILTER (WHERE {is_cut}) AS {cut}
    FROM wanted
),
shown AS (
    SELECT * FROM wanted WHERE NOT {is_hidden} {first}
)
SELECT s.*, {total}, {hidden}, {cut}
FROM counted
LEFT JOIN shown AS s ON true
ORDER BY {", ".join(f"s.{part}" for part in order)}
"""
    return sql, bindings


def conditions_of(header: Header, selection: Selection) -> tuple[list[str], dict[str, Value]]:
    """Return the conditions on names and paths, for rows called `result`, and their bindings."""
    conditions: list[str] = []
    bindings: dict[str, Value] = {}
    for kind in KINDS:
        if names := getattr(selection, kind):
            columns = columns_of(header, kind)
            if not columns:
                raise UsageError(
                    f"{header.words} has no column with a {kind} — --{kind} {names[0]}",
                    _what_it_has(header),
                )
            bindings[f"selected_{kind}"] = list(names)
            any_of = " OR ".join(_is_any(header, column, f"$selected_{kind}") for column in columns)
            conditions.append(f"({any_of})")
    for word in ("via", "without"):
        if names := getattr(selection, word):
            if not columns_of(header, PATH):
                raise UsageError(
                    f"{header.words} has no paths — --{word} {names[0]}", _what_it_has(header)
                )
            bindings[f"selected_{word}"] = list(names)
            conditions.append(_visits(header, word))
    return conditions, bindings


def columns_of(header: Header, kind: str) -> list[str]:
    """Return the columns of a query that name a node, topic, callback, host or path."""
    return [column.name for column in header.columns if column.unit == kind]


def _parts(header: Header, column: str) -> str:
    """Return the names in a column, a list."""
    (kept,) = (known for known in header.columns if known.name == column)
    if kept.type.endswith("[]"):
        return f'result."{column}"'
    parts = f"string_split(result.\"{column}\", ', ')"
    # A name may have the separator inside.
    return f'list_append({parts}, result."{column}")'


def _is_any(header: Header, column: str, patterns: str) -> str:
    """Return the condition that one of the names in a column is one of the patterns."""
    return (
        f"coalesce(list_bool_or(list_transform({_parts(header, column)}, lambda name:"
        f" list_bool_or(list_transform({patterns}, lambda each:"
        " name = each OR name GLOB each)))), false)"
    )


def _visits(header: Header, word: str) -> str:
    (column,) = columns_of(header, PATH)
    given = {"via": "NULL", "without": "NULL", word: f"$selected_{word}"}
    visits = f'main.path_visits(result."{column}", {given["via"]}, {given["without"]})'
    return f'(result."{column}" IS NOT NULL AND {visits})' if word == "via" else visits


def _order(header: Header, selection: Selection) -> list[str]:
    if selection.slowest is not None:
        if header.slowest is None:
            raise UsageError(
                f"{header.words} has no --slowest: its rows have no duration of their own",
                "--sort COLUMN:desc --limit N",
            )
        if selection.sort or selection.limit is not None:
            raise UsageError("--slowest N goes without --sort and --limit", "leave them out")
        return [f'"{header.slowest}" DESC NULLS LAST']
    return [_sorted(header, text) for text in selection.sort]


def sorted_by(header: Header, selection: Selection) -> tuple[str, ...]:
    """Return the columns that rows were asked to be sorted by."""
    names = [column.name for column in header.columns]
    return tuple(column_named(text.partition(":")[0], names) for text in selection.sort)


def _sorted(header: Header, text: str) -> str:
    name, _, direction = text.partition(":")
    if direction not in ("", "asc", "desc"):
        raise UsageError(f"rows are sorted asc or desc — {text}", f"--sort {name}:desc")
    column = column_named(name, [column.name for column in header.columns])
    return f'"{column}" {"DESC" if direction == "desc" else "ASC"} NULLS LAST'


def _what_it_has(header: Header) -> str:
    options = [f"--{kind}" for kind in KINDS if columns_of(header, kind)]
    if columns_of(header, PATH):
        options += ["--via", "--without"]
    if any(param.name == "from" for param in header.params):
        options += ["--from", "--to"]
    if options:
        return f"it has {', '.join(options)}; --where takes a condition on any column"
    return "--where takes a condition on any of its columns"


def values_of(given: str | Sequence[str] | None) -> tuple[str, ...]:
    """Return the names that a user gave: several as they are, or one text, in which commas part."""
    if given is None:
        return ()
    parts = (part.strip(" ") for part in given.split(",")) if isinstance(given, str) else given
    return tuple(part for part in parts if part)


def make_selection(
    given: Mapping[str, object],
    names_in: Callable[[str, str], Sequence[str]] = lambda _, text: values_of(text),
) -> Selection:
    """Return what words of `Database.query` mean; `names_in`: the names in a text, by kind."""
    words: dict[str, object] = {}
    for word, value in given.items():
        if word in ("limit", "slowest"):
            if value is not None and (not isinstance(value, int) or value < 1):
                raise UsageError(f"--{word} is at least 1 — {value}", f"--{word} 10")
            words[word] = value
        elif word == "where":
            words[word] = value
        elif isinstance(value, str) and word != "sort":
            words[word] = tuple(names_in(word if word in KINDS else "place", value))
        elif (
            value is None
            or isinstance(value, str)
            or (isinstance(value, list | tuple) and all(isinstance(each, str) for each in value))
        ):
            words[word] = values_of(value)
        else:
            raise UsageError(f"{word} is a name or several — {value}", f"{word}='/a*'")
    return Selection(**words)  # type: ignore[arg-type]
