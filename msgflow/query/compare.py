"""Comparison of two runs, or of several on either side."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

import duckdb

from msgflow.errors import NoFlowError, UsageError
from msgflow.files.resources import resource_directory
from msgflow.query.catalogue import load_query
from msgflow.query.differences import STATISTICS, Differences, warm_up_seconds
from msgflow.query.names import require_places
from msgflow.query.notes import AMBIGUOUS, clock_notes, doubt_notes, function_notes, schedule_notes
from msgflow.query.runner import bind, run_query
from msgflow.query.selection import CUT_COLUMN
from msgflow.query.why import explain as explain_run
from msgflow.result.query_result import QueryResult
from msgflow.run.choice import Run, choose_one, choose_runs, read_runs
from msgflow.run.slice import Slice
from msgflow.run.window import MAXIMUM_NS
from msgflow.sql.failure import query_errors
from msgflow.sql.header import completed, read
from msgflow.sql.statement import internal_sql, registered

if TYPE_CHECKING:
    import pyarrow as pa

    from msgflow.sql.value import Value

DEFAULT_RESAMPLES = 1_000
# With fewer runs on one side and many on the other, intervals are too narrow: docs/fleet.md.
LEAST_RUNS = 6
_CUT = (
    "paths beyond the limits are left out; --max-paths and --max-depth raise them, --from and --to"
    " choose"
)
_OF_PARTS = ("from", "to", "case", "max_depth", "max_paths")


@dataclass(frozen=True, kw_only=True)
class Comparison(Differences):
    """Run B compared with run A.

    Attributes:
        run_a: the baseline; of several runs the first.
        run_b: the run that is compared with it, likewise.
        skipped: seconds that were left out at the start of each run.
    """

    run_a: Run
    run_b: Run
    skipped: float

    def __str__(self) -> str:
        return str(self.changes(only_different=False))

    def _repr_html_(self) -> str:
        return self.changes(only_different=False)._repr_html_()


def compare(
    connection: duckdb.DuckDBPyConnection,
    /,
    run_a: str | int | None,
    run_b: str | int | None,
    *,
    run: str | int | None = None,
    window: Sequence[str] = (),
    at_least: str = "5%",
    explain: bool = False,
    has_culprits: bool = False,
    **given: Value,
) -> Comparison:
    """Compare two runs of a database, or two times of one; see `Database.compare`.

    `has_culprits` asks who is to blame for the changes of paths.
    """
    if (run_a is None) is not (run_b is None) or (run_a is None and not window):
        raise UsageError(
            "a comparison is of two runs, or of two times of one",
            "msgflow compare before after, or --run drive --window 0s..60s --window 60s..120s",
        )
    if run is not None and run_a is not None:
        raise UsageError(
            f"two runs are named already — --run {run}",
            "leave it out, or compare two times of it: --run RUN --window … --window …",
        )
    runs = read_runs(connection)
    wanted = (run, run) if run_a is None else (run_a, run_b)
    sides = [
        (choose_one(runs, each, "a comparison of windows"),) if window else _side(runs, each)
        for each in wanted
    ]
    first, second = (side[0] for side in sides)
    both: dict[str, Value] = {"run_a": first.run_id, "run_b": second.run_id}
    both["at_least"] = share_of(at_least)
    both |= _windows(window, (first, second))
    asked = bind(internal_sql().header("compare"), given | both, "msgflow compare")
    _require_sense(asked)
    if explain and asked["what"] != "paths":
        raise UsageError(f"only changes of paths have parts — {asked['what']}", "leave out --what")
    if max(map(len, sides)) > 1:
        return _several(connection, asked, sides, explain=explain)
    if explain and window and asked["skip_first"]:
        raise UsageError("a window leaves out the start itself", "leave out --skip-first")
    compared = _compared(connection, asked, first, second)
    for side, one, text in zip("AB", (first, second), window, strict=False):
        compared.result.notes.append(f"{side} is {text} of run {one.title}")
    if not window:
        compared.result.notes.extend(_slow_starts(compared))
    if asked["what"] != "paths":
        return compared
    windows = window or ("..", "..")
    if has_culprits:
        compared = _with_culprits(connection, compared, asked, windows)
    if not explain:
        return compared
    return replace(compared, parts=_parts(connection, compared, asked, windows))


def _slices(compared: Comparison, windows: Sequence[str]) -> Iterator[tuple[str, Run, Slice]]:
    """Yield which side it is, the run of each, and its times; `windows` are 'START..END'."""
    skipped = str(compared.skipped) if compared.skipped else None
    for side, run, window in zip("ab", compared.result.runs, windows, strict=True):
        start, _, end = window.partition("..")
        yield side, run, Slice(run.run_id, start or skipped, end or None)


def _with_culprits(
    connection: duckdb.DuckDBPyConnection,
    compared: Comparison,
    asked: Mapping[str, Any],
    windows: Sequence[str],
) -> Comparison:
    """Return a comparison with what is to blame in one run, and not as much in the other."""
    found = {}
    for side, run, part in _slices(compared, windows):
        try:
            found[side] = explain_run(connection, run, part, asked["to"])
        except NoFlowError:
            return compared
    tables = {"compared": compared.result.table}
    for side, each in found.items():
        tables |= {f"culprit_{side}": each.verdict.table, f"wait_{side}": each.waits.table}
    with registered(connection, **tables):
        table = internal_sql().run(connection, "changed_culprit", asked).to_arrow_table()
        with registered(connection, changed_culprit=table):
            lines = internal_sql().run(connection, "change_sentence", {}).fetchall()
    header = replace(internal_sql().header("changed_culprit"), name="compare")
    culprits = QueryResult(table, header, compared.result.runs)
    return replace(compared, culprits=culprits, lines=tuple(line for (line,) in lines))


def _parts(
    connection: duckdb.DuckDBPyConnection,
    compared: Comparison,
    asked: Mapping[str, Any],
    windows: Sequence[str],
) -> QueryResult:
    """Return the parts of the difference of the means of each path, the largest first.

    `asked` are the parameters of the comparison, and `windows` 'START..END' of either side.
    """
    parameters = {name: asked[name] for name in _OF_PARTS}
    tables = {"compared": compared.result.table}
    for side, run, part in _slices(compared, windows):
        found = run_query(connection, load_query("path-breakdown"), parameters, part)
        tables[f"part_{side}"] = found.table
        values = {"run_id": run.run_id, **part.window([run]).bindings}
        states = internal_sql().run(connection, "callback_state", values)
        tables[f"state_{side}"] = states.to_arrow_table()
    with duckdb.connect() as con, registered(con, **tables):
        table = internal_sql().run(con, "change_part", {}).to_arrow_table()
    header = replace(internal_sql().header("change_part"), name="compare --explain")
    return QueryResult(table, header, compared.result.runs, compared.result.notes)


def _side(runs: Sequence[Run], wanted: str | int | None) -> tuple[Run, ...]:
    """Return the runs of a side: a name, id or label, or several of them."""
    is_name = any(run.name == wanted for run in runs)
    texts = [wanted] if is_name or wanted is None else str(wanted).split(",")
    found = dict.fromkeys(run for text in texts for run in choose_runs(runs, text))
    if not found:
        raise UsageError("the database holds no run yet", "msgflow ingest TRACE")
    return tuple(found)


def _several(
    connection: duckdb.DuckDBPyConnection,
    asked: dict[str, Any],
    sides: Sequence[tuple[Run, ...]],
    *,
    explain: bool,
) -> Comparison:
    """Compare sides of several runs; their paths alone."""
    if explain or asked["what"] != "paths":
        refused = "--explain" if explain else f"--what {asked['what']}"
        raise UsageError(f"paths of several runs are compared — {refused}", "give one run each")
    if both := set(sides[0]) & set(sides[1]):
        raise UsageError(
            f"a run is on one side — {next(iter(both)).title}", "give different runs or labels"
        )
    asked = asked | require_places(connection, [*sides[0], *sides[1]], asked)
    with query_errors("the comparison", "the comparison failed: {}"):
        result = _sides_compared(connection, asked, sides)
    first, second = (side[0] for side in sides)
    result.notes.extend(_one_sided(result, "paths", *sides))
    for name, side in zip("AB", sides, strict=True):
        of = f"{len(side)} runs" if len(side) > 1 else "1 run"
        result.notes.append(f"{name} is {of}: {', '.join(run.title for run in side)}")
        doubted = doubt_notes(connection, side, _ambiguous(result, name))
        result.notes.extend(f"{name}: {note}" for note in doubted)
    if any(row[CUT_COLUMN] for row in result.to_arrow().to_pylist()):
        result.notes.append(_CUT)
    result.notes.extend(clock_notes(connection, [*sides[0], *sides[1]]))
    if (least := min(map(len, sides))) < LEAST_RUNS:
        result.notes.append(
            f"{LEAST_RUNS} runs on either side tell a change from chance, one has {least}:"
            " a_spread_percent and b_spread_percent of --wide say how much its runs differ"
        )
    return Comparison(result=result, run_a=first, run_b=second, skipped=asked["skip_first"])


def runs_compared(
    connection: duckdb.DuckDBPyConnection,
    *,
    case: str = "first",
    confidence: float = 0.95,
    at_least: float = 0.05,
    name: str = "fleet compare",
) -> QueryResult:
    """Return the differences between two sides: it reads `flow`, `e2e_latency` and `sided`."""
    measured = internal_sql().run(connection, "fleet_run_value", {"case": case}).to_arrow_table()
    values = {
        "z": NormalDist().inv_cdf((1 + confidence) / 2),
        "least_units": LEAST_RUNS,
        "at_least": at_least,
    }
    with registered(connection, measured=measured):
        rows = internal_sql().run(connection, "fleet_comparison", values).to_arrow_table()
    return QueryResult(rows, replace(internal_sql().header("fleet_comparison"), name=name))


def _sides_compared(
    connection: duckdb.DuckDBPyConnection, asked: dict[str, Any], sides: Sequence[Sequence[Run]]
) -> QueryResult:
    """Return how the paths of the runs of side B differ from those of side A."""
    import pyarrow as pa

    sided = [(str(run.run_id), side) for side, of in zip("ab", sides, strict=True) for run in of]
    runs, names = ([row[place] for row in sided] for place in (0, 1))
    asked = asked | {"runs": [int(run) for run in runs]}
    flow = internal_sql().run(connection, "compared_flow", asked).to_arrow_table()
    table = pa.table({"run": runs, "side": names, "unit": runs})
    with registered(connection, flow=flow, e2e_latency=flow, sided=table):
        return runs_compared(
            connection,
            case=asked["case"],
            confidence=asked["confidence"],
            at_least=asked["at_least"],
            name="compare",
        )


def share_of(text: str) -> float:
    """Return a share that stands in percent, such as '5%'."""
    try:
        share = float(text.strip().removesuffix("%")) / 100
    except ValueError:
        share = -1.0
    if not 0 <= share < math.inf:
        raise UsageError(f"what matters is a share — {text}", "such as --at-least 5%")
    return share


def _windows(window: Sequence[str], runs: tuple[Run, Run]) -> dict[str, Value]:
    """Return the time windows of both sides, as the statement takes them."""
    if len(window) not in (0, 2):
        raise UsageError(
            f"there is one --window for each side — {len(window)}",
            "--window 0s..60s --window 60s..120s",
        )
    found: dict[str, Value] = {"a_window": None, "b_window": None}
    for side, run, text in zip("ab", runs, window, strict=False):
        start, dots, end = text.partition("..")
        if not dots:
            raise UsageError(f"a window has a begin and an end — {text}", "--window 0s..60s")
        times = Slice(start=start or None, end=end or None).window([run])
        found[f"{side}_window"] = [times.start_ns, times.end_ns]
    return found


def warm_up(connection: duckdb.DuckDBPyConnection, run: Run) -> float:
    """Return how long a run warms up, in seconds, as a comparison of its paths finds it.

    0 means that it does not warm up.
    """
    both: dict[str, Value] = {"run_a": run.run_id, "run_b": run.run_id, "resamples": 0}
    both |= {"at_least": 0.0, **_windows((), (run, run))}
    asked = bind(internal_sql().header("compare"), both, "msgflow compare")
    _require_sense(asked)
    return _warm_up(_compared(connection, asked, run, run, is_strict=False))


def _compared(
    connection: duckdb.DuckDBPyConnection,
    asked: dict[str, Any],
    first: Run,
    second: Run,
    *,
    is_strict: bool = True,
) -> Comparison:
    """Return how two runs differ, with notes; unless `is_strict`, they may have nothing in common.

    `asked` are the parameters of `internal.comparison`.
    """
    what = str(asked["what"])
    asked = asked | require_places(connection, [first, second], asked)
    for run in (first, second):
        require_places(connection, [run], {"from": asked["from"], "to": asked["to"]})
    with query_errors("the comparison", "the comparison failed: {}"):
        table = internal_sql().run(connection, "compare", asked).to_arrow_table()
    header = completed(read(resource_directory("schema") / "public" / "comparison.sql"))
    result = QueryResult(table, header, (first, second))
    if is_strict:
        result.notes.extend(_one_sided(result, what, [first], [second]))
        result.notes.extend(function_notes(connection, asked))
    if what == "callbacks":
        result.notes.extend(schedule_notes(connection, asked, result))
    result.notes.extend(_doubts(connection, result, asked))
    if len(result):
        result.notes.extend(clock_notes(connection, list(dict.fromkeys((first, second)))))
    return Comparison(result=result, run_a=first, run_b=second, skipped=asked["skip_first"])


def _warm_up(compared: Comparison) -> float:
    """Return the seconds after which no run has the longest values of its start; 0 if none has."""
    table = compared.result.table
    ends = [*table.column("a_warm_up_ns").to_pylist(), *table.column("b_warm_up_ns").to_pylist()]
    return warm_up_seconds(max((end for end in ends if end is not None), default=None))


def _slow_starts(compared: Comparison) -> Iterable[str]:
    """Say which run starts slowly, and how to leave that out."""
    table = compared.result.table
    slow = [
        run.title
        for side, run in (("a", compared.run_a), ("b", compared.run_b))
        if table.column(f"{side}_warm_up_ns").null_count < len(table)
    ]
    if slow:
        yield (
            f"run {' and run '.join(slow)} may warm up: its longest values lie at its start;"
            f" --skip-first {_warm_up(compared):g} leaves it out"
        )


def _require_sense(asked: dict[str, Any]) -> None:
    """Refuse values that are out of range; set the number of resamples if the user has not."""
    confidence, resamples = asked["confidence"], asked["resamples"]
    if not 0 < confidence < 1:
        raise UsageError(f"the confidence lies between 0 and 1 — {confidence}", "0.95 is usual")
    needed = least_resamples(confidence)
    if resamples is None:
        asked["resamples"] = max(DEFAULT_RESAMPLES, needed)
    elif resamples != 0 and resamples < needed:
        raise UsageError(
            f"the ends of an interval are not seen in so few resamples — {resamples}",
            f"{needed} are needed for a confidence of {confidence:g}, or 0 for no intervals",
        )
    if not 0 <= asked["skip_first"] <= MAXIMUM_NS / 1_000_000_000:
        raise UsageError(f"seconds to leave out are not negative — {asked['skip_first']}")
    if asked["what"] not in ("paths", "ends") and (
        asked["from"] is not None or asked["to"] is not None
    ):
        raise UsageError(
            f"only paths start and end at topics, not {asked['what']}", "leave out the topics"
        )


def least_resamples(confidence: float) -> int:
    """Return the resamples that an interval needs: ten beyond either end."""
    return math.ceil(20 / (1 - confidence) - 1e-6)


def _doubts(
    connection: duckdb.DuckDBPyConnection, result: QueryResult, asked: Mapping[str, Any]
) -> Iterable[str]:
    """Yield notes on limits, losses and verdicts: the numbers do not show these."""
    with registered(connection, compared=result.table):
        notes = internal_sql().run(connection, "comparison_note", asked).fetchall()
    yield from (sentence for (sentence,) in notes)
    for side, run in zip("AB", result.runs, strict=True):
        for note in doubt_notes(connection, [run], _ambiguous(result, side)):
            yield f"run {side}, {run.title}, {note}"


def _ambiguous(result: QueryResult, side: str) -> pa.Table:
    """Return which values of a side pass links that may be other ones."""
    table = result.table.select(["subject", f"{side.lower()}_{AMBIGUOUS}"])
    return table.rename_columns(["subject", AMBIGUOUS])


def _one_sided(
    result: QueryResult, what: str, first: Sequence[Run], second: Sequence[Run]
) -> Iterable[str]:
    """Yield notes on subjects of one side only; raise if the sides have no subject in common."""
    titles = [", ".join(run.title for run in side) for side in (first, second)]
    rows = [row for row in result.to_arrow().to_pylist() if row["statistic"] == STATISTICS[0]]
    if not any(row["a_count"] and row["b_count"] for row in rows):
        only = {row["subject"] for row in rows}
        example = f"; one of them has {min(only)}" if only else ""
        raise UsageError(
            f"the runs have no {what} with values in common — {' and '.join(titles)}{example}",
            f"msgflow query e2e-latency --run {first[0].run_id}, and likewise"
            f" --run {second[0].run_id}, tell what each has",
        )
    for side, runs, title in zip("AB", (first, second), titles, strict=True):
        number = sum(row["verdict"] == f"only in {side}" for row in rows)
        if number:
            thing = what[:-1] if number == 1 else what
            yield f"{number} {thing} with values only in {'run ' * (len(runs) == 1)}{side}, {title}"
