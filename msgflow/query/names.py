"""Names, ids and numbers of paths that a user gives: an error says which of them no run has.

The number of a path is the same in every command: its place among all paths of the runs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.query.selection import PATH, values_of
from msgflow.sql.statement import internal_sql
from msgflow.text.name_suggestions import did_you_mean
from msgflow.text.values import ARROW

if TYPE_CHECKING:
    import duckdb

    from msgflow.result.query_result import QueryResult
    from msgflow.run.choice import Run
    from msgflow.sql.value import Value

# Parameters that take topics or nodes, in every query.
PLACE_PARAMETERS = ("from", "to", "via", "without")
# Those that take paths, too.
VISITS = ("via", "without")
# Steps of a path that name no place.
_NAMELESS = ("?", "not traced")
_SHOWN = 3
# By kind of name: the command that lists them. What a run has of them is `known_KIND`.
_LISTED_BY = {
    "topic": "msgflow query topics",
    "node": "msgflow info --section nodes",
    "callback": "msgflow query callbacks",
    "host": "msgflow info --section hosts",
    "place": "msgflow graph --format table",
}
# Parameters that take an id, in every query: the view and column of it, and the command that lists
# the ids.
_IDS = {
    "take": ("take", "take_id", "msgflow query flows"),
    "callback_id": ("callback", "callback_id", "msgflow query waits"),
}
_EVERY_PATH = "main.flow_path($runs, only_paths := true)"
_MISSING = """
SELECT each
FROM (SELECT unnest($patterns::VARCHAR[]) AS each)
WHERE NOT EXISTS (
    FROM ({known}) AS known WHERE known.name = each OR known.name GLOB each
)
"""


def require_places(
    connection: duckdb.DuckDBPyConnection,
    runs: Sequence[Run],
    bound: Mapping[str, Value],
    *,
    is_known: bool = False,
) -> dict[str, Value]:
    """Return topics and nodes among the parameters of a query, which the runs must have.

    `is_known` says that they have them.
    """
    places: dict[str, Value] = {}
    for key in PLACE_PARAMETERS:
        given = bound.get(key)
        if isinstance(given, str):
            given = [*names_in(connection, runs, "place", given)]
        if isinstance(given, list):
            if not is_known:
                kind = "visit" if key in VISITS else "place"
                require_names(connection, runs, kind, [str(each) for each in given])
            places[key] = given
    return places


def names_in(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], kind: str, text: str
) -> tuple[str, ...]:
    """Return the names that one text means: a name that the runs have, else several with commas."""
    parts = values_of(text)
    if parts == (text,):
        return parts
    known = connection.execute(
        f"SELECT 1 FROM ({internal_sql().text(f'known_{kind}')}) AS k WHERE k.name = $name LIMIT 1",
        {"runs": [run.run_id for run in runs], "name": text},
    ).fetchall()
    return (text,) if known else parts


def require_names(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], kind: str, names: Sequence[str]
) -> None:
    """Raise unless the chosen runs have every name, and something that fits every pattern.

    `kind` is 'topic', 'node', 'callback', 'host', 'place' for topics, nodes and services, or
    'visit' for a place or a path of places. Patterns are globs. Without runs, every name passes.
    """
    if kind == "visit":
        names = [place for name in names for place in _places_of(name)]
        kind = "place"
    if not runs or not names:
        return
    sql, source = internal_sql().text(f"known_{kind}"), _LISTED_BY[kind]
    values = {"runs": [run.run_id for run in runs]}
    missing = connection.execute(
        _MISSING.format(known=sql), values | {"patterns": list(names)}
    ).fetchall()
    if not missing:
        return
    name = missing[0][0]
    rows = connection.execute(sql, values).fetchall()
    # A name in brackets is a process whose node is unknown: it is no help.
    there = {
        (bool(is_internal), each)
        for each, is_internal in rows
        if each is not None and not each.startswith("[")
    }
    # Names of ROS itself, such as services of parameters, come last.
    known = list(dict.fromkeys(each for _, each in sorted(there)))
    ordinary = [each for is_internal, each in sorted(there) if not is_internal]
    what, plural = kind, f"{kind}s"
    if kind == "place":
        what, plural = "topic or node", "topics and nodes"
    where = "the run" if len(runs) == 1 else "these runs"
    is_pattern = any(character in name for character in "*?[")
    problem = f"no {what} in {where} fits" if is_pattern else f"there is no such {what} in {where}"
    more = len(known) - _SHOWN
    rest = f" and {more} more ({source})" if more > 0 else ""
    shown = f"the {plural} are {', '.join(known[:_SHOWN])}{rest}" if known else source
    hint = did_you_mean(name, ordinary, did_you_mean(name, known, shown))
    raise UsageError(f"{problem} — {name}", hint)


def _places_of(path: str) -> list[str]:
    if ARROW not in path:
        return [path]
    steps = [step.strip().strip("()") for step in path.split(ARROW)]
    return [step for step in steps if step not in _NAMELESS]


def require_ids(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], bound: Mapping[str, Value]
) -> None:
    """Raise unless the chosen runs, if any, have every id among the parameters of a query."""
    for key, (view, column, hint) in _IDS.items():
        number = bound.get(key)
        if number is None or not runs:
            continue
        known = connection.execute(
            f"SELECT 1 FROM main.{view} WHERE {column} = $number AND list_contains($runs, run_id)",
            {"number": number, "runs": [run.run_id for run in runs]},
        ).fetchall()
        if not known:
            where = "the run" if len(runs) == 1 else "these runs"
            raise UsageError(f"there is no such {view} in {where} — {number}", f"see {hint}")


def with_path_numbers(
    connection: duckdb.DuckDBPyConnection, result: QueryResult, known: str = _EVERY_PATH
) -> QueryResult:
    """Return a result with the numbers of its paths, if it has several.

    What ends in the middle of a path is no path of the runs: its number comes behind those of all
    paths. `known` is a table with all of these.
    """
    if PATH not in result.columns:
        return result
    own = {path for path in result.table[PATH].to_pylist() if path is not None}
    if len(own) < 2:
        return result
    every = _every_path(connection, result.runs, known)
    texts = [*every, *sorted(own.difference(every))]
    return replace(result, path_numbers={text: n for n, text in enumerate(texts, start=1)})


def numbered_path(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], number: int
) -> dict[str, list[str]]:
    """Return the arguments of `Database.query` that choose the path with a number."""
    every = _every_path(connection, runs)
    if not 1 <= number <= len(every):
        raise UsageError(
            f"no path has this number — {number}",
            f"msgflow query e2e-latency shows paths 1 to {len(every)}" if every else None,
        )
    return {"via": [every[number - 1]]}


def _every_path(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], known: str = _EVERY_PATH
) -> list[str]:
    chosen = {"runs": [run.run_id for run in runs]} if known is _EVERY_PATH else {}
    rows = connection.execute(f"SELECT DISTINCT path FROM {known}", chosen).fetchall()
    return sorted(path for (path,) in rows)
