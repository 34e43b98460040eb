"""What to change: what may make data sooner is tried in replays, and the best is said first."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from msgflow.errors import UsageError
from msgflow.replay.change import read_change
from msgflow.replay.predict import ROUNDS, Predictor
from msgflow.result.query_result import QueryResult
from msgflow.sql.statement import internal_sql, registered
from msgflow.text.values import count

if TYPE_CHECKING:
    import duckdb

    from msgflow.query.why import Explanation
    from msgflow.replay.change import Change
    from msgflow.replay.predict import Prediction
    from msgflow.run.choice import Run

# So many are tried with one replay each, and so many of the best with as many as intervals need.
_MOST_TRIED, _MOST_SHOWN = 24, 6
# Then no more is tried [s of CPU].
_LONGEST = 60
# So many callback instances and messages are replayed within a second of CPU, with so many changes;
# so many times as many are too much to read.
_QUICK, _QUICK_TRIED, _TOO_MANY = 4_000, 3, 10
# That a callback may be faster goes without saying; a bound says too little.
_UNSAID = ("faster", "own_cpu")
# What gains less of the latency is not worth a line of its own.
_LEAST = 0.1
_NUMBERS = (
    "recorded_ns", "recorded_p95_ns", "predicted_ns", "predicted_p95_ns", "gain_ns", "low_ns",
    "high_ns", "p95_gain_ns", "p95_low_ns", "p95_high_ns", "flows", "predicted_flows",
)  # fmt: skip
_PREDICTION = pa.schema(
    [
        *((name, pa.string()) for name in ("change", "path", "doubt")),
        ("is_reached", pa.bool_()),
        *((name, pa.int64()) for name in _NUMBERS),
    ]
)


@dataclass(frozen=True)
class Remedies:
    """What makes data sooner.

    Attributes:
        run: what was replayed.
        place: the topic or node at which flows end; None: wherever they end.
        remedies: a row for each change that gains something, the best first: what to change, where,
            what it gains, what gets worse, and what the recording cannot know.
        gains: what each of these does to each path.
        notes: a sentence each.
    """

    run: Run
    place: str | None
    remedies: QueryResult
    gains: QueryResult
    notes: tuple[str, ...]

    @property
    def sections(self) -> dict[str, QueryResult]:
        """The results, by the names of the attributes."""
        return {"remedies": self.remedies, "gains": self.gains}


def find_remedies(
    connection: duckdb.DuckDBPyConnection,
    predictor: Predictor,
    found: Explanation,
    progress: Callable[[int, int, str], None],
) -> Remedies:
    """Try what may help on the paths of an explanation; `progress` gets what is tried then."""
    tried, untried = _tried(predictor, found, progress)
    paths = found.paths.table["path"].to_pylist()
    ranked = _asked(connection, "remedy", found, tried)
    best = ranked["change"].to_pylist()[:_MOST_SHOWN]
    for number, text in enumerate(best, 1):
        progress(number, len(best), text)
        tried[text] = predictor.predict([read_change(text)], rounds=ROUNDS)
    tried = {text: tried[text] for text in best}
    remedies = _asked(connection, "remedy", found, tried)
    notes = []
    if more := ranked.num_rows - len(best):
        notes.append(f"{count(more, 'more change')} may help, and gain less")
    if untried:
        notes.append(f"{count(untried, 'more change')} may help, and would take longer to try")
    notes += _doubts(predictor, paths)
    return Remedies(
        found.run,
        found.place,
        _result("remedy", remedies, found.run),
        _result("predicted_path", paths_of(connection, tried, None), found.run),
        tuple(notes),
    )


def suggested(connection: duckdb.DuckDBPyConnection, found: Explanation) -> str | None:
    """Return what to try first, if it gains a tenth and a replay is quick; None: nothing."""
    said = [row for row in found.candidates.to_pylist() if row["remedy"] not in _UNSAID]
    if not said:
        return None
    values = {"run_id": found.run.run_id}
    ((size,),) = internal_sql().run(connection, "replay_size", values).fetchall()
    if size > _TOO_MANY * _QUICK:
        return None
    length = (found.run.end_ns or 0) - (found.run.start_ns or 0)
    predictor = Predictor(connection, found.run, length * _QUICK // max(size, _QUICK))
    tried: dict[str, list[Prediction]] = {}
    for row in said[:_QUICK_TRIED]:
        tried |= _prediction(predictor, row["change"])
    for row in _asked(connection, "remedy", found, tried).to_pylist()[:1]:
        if row["share"] > _LEAST:
            return f"try: {row['headline']}"
    return None


def predicted_paths(
    connection: duckdb.DuckDBPyConnection,
    run: Run,
    predictor: Predictor,
    changes: Sequence[Change],
    place: str | None,
) -> QueryResult:
    """Return what changes do to each path that ends at a place."""
    text = "; ".join(map(str, changes))
    found = predictor.predict(changes)
    return _result("predicted_path", paths_of(connection, {text: found}, place), run)


def paths_of(
    connection: duckdb.DuckDBPyConnection,
    tried: Mapping[str, Sequence[Prediction]],
    place: str | None,
) -> pa.Table:
    """Return a row for each change and path."""
    with registered(connection, prediction=_table(tried)):
        values = {"place": place}
        return internal_sql().run(connection, "predicted_path", values).to_arrow_table()


def _tried(
    predictor: Predictor, found: Explanation, progress: Callable[[int, int, str], None]
) -> tuple[dict[str, list[Prediction]], int]:
    """Return what each change does, by one replay; and how many would take too long."""
    begun = time.process_time()
    candidates = found.candidates["change"].to_pylist()
    tried: dict[str, list[Prediction]] = {}
    for number, text in enumerate(candidates):
        if number >= _MOST_TRIED or time.process_time() - begun > _LONGEST:
            return tried, len(candidates) - number
        progress(number + 1, min(len(candidates), _MOST_TRIED), text)
        tried |= _prediction(predictor, text)
    return tried, 0


def _prediction(predictor: Predictor, text: str) -> dict[str, list[Prediction]]:
    try:
        return {text: predictor.predict([read_change(text)], rounds=0)}
    except UsageError:
        # It is of something that is not replayed: a service, a callback of no executor.
        return {}


def _asked(
    connection: duckdb.DuckDBPyConnection,
    name: str,
    found: Explanation,
    tried: Mapping[str, Sequence[Prediction]],
) -> pa.Table:
    values = {"paths": found.paths.table["path"].to_pylist()}
    with registered(connection, candidate=found.candidates, prediction=_table(tried)):
        return internal_sql().run(connection, name, values).to_arrow_table()


def _doubts(predictor: Predictor, paths: Sequence[str]) -> Iterator[str]:
    """Yield for how many of the paths no size can be said, and why."""
    reasons: dict[str, int] = {}
    for each in predictor.predict(rounds=ROUNDS):
        if each.path in paths and each.doubt is not None:
            reasons[each.doubt] = reasons.get(each.doubt, 0) + 1
    for reason, number in sorted(reasons.items(), key=lambda item: -item[1]):
        yield f"no size can be said of {number} of {count(len(paths), 'path')}: {reason}"
    if predictor.window is not None:
        begin, end = predictor.window
        yield f"{(end - begin) / 1e9:.0f} s in the middle of the run are replayed"


def _table(tried: Mapping[str, Sequence[Prediction]]) -> pa.Table:
    rows = [_row(text, each) for text, found in tried.items() for each in found]
    return pa.Table.from_pylist(rows, schema=_PREDICTION)


def _row(text: str, each: Prediction) -> dict[str, Any]:
    predicted = each.predicted[0] if each.predicted else None
    row: dict[str, Any] = {
        "change": text,
        "path": each.path,
        "doubt": each.doubt,
        "is_reached": each.is_reached,
    }
    for spread, name in ((each.recorded, "recorded"), (predicted, "predicted")):
        if spread is not None:
            row |= {f"{name}_ns": spread.median, f"{name}_p95_ns": spread.p95}
            row["flows" if name == "recorded" else "predicted_flows"] = spread.flows
    for gain, prefix in ((each.median, ""), (each.p95, "p95_")):
        if gain is not None:
            row |= {
                f"{prefix}gain_ns": gain.size,
                f"{prefix}low_ns": gain.low,
                f"{prefix}high_ns": gain.high,
            }
    return row


def _result(name: str, table: pa.Table, run: Run) -> QueryResult:
    return QueryResult(table, internal_sql().header(name), (run,))
