"""Verification of a run: its verdicts on the requirements of a file, measured by named queries."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cache
from operator import eq
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from msgflow.backports import StrEnum
from msgflow.files.default_files import DEFAULT_PATHS
from msgflow.query.catalogue import load_query
from msgflow.query.notes import AMBIGUOUS
from msgflow.query.runner import run_query
from msgflow.query.selection import Selection, conditions_of
from msgflow.result.query_result import QueryResult
from msgflow.run.slice import Slice
from msgflow.sql.header import Param
from msgflow.sql.statement import internal_sql, registered
from msgflow.text.name_suggestions import did_you_mean
from msgflow.trace.numpy_arrow import integers_to_arrow, texts_to_arrow, to_arrow
from msgflow.verify.condition import format_value
from msgflow.verify.junit import junit_xml
from msgflow.verify.metrics import ENDS, KEYS, PATH, SUBJECTS
from msgflow.verify.worst_case import LOST_FLOW, find_worst_case, worst_case_of

if TYPE_CHECKING:
    import duckdb

    from msgflow.run.choice import Run
    from msgflow.run.window import Window
    from msgflow.sql.header import Header
    from msgflow.sql.value import Value
    from msgflow.verify.metrics import Metric
    from msgflow.verify.targets_file import Requirement, Target, TargetsFile


class Verdict(StrEnum):
    """Whether a requirement is met."""

    PASSED = "passed"
    FAILED = "failed"
    NOT_MEASURED = "not measured"
    NO_DATA = "no data"


_LOST = "SELECT sum(discarded_event_count)::BIGINT FROM main.trace WHERE run_id = $run_id"


@dataclass(frozen=True)
class Verification:
    """The verdicts on a run.

    Attributes:
        result: one row per requirement and measured thing; its header describes the columns.
        run: the run.
        file: the name of the file with the requirements.
        paths: the name of the file with the named paths.
    """

    result: QueryResult
    run: Run
    file: str
    paths: str = DEFAULT_PATHS

    def __str__(self) -> str:
        return str(self.result)

    def _repr_html_(self) -> str:
        return self.result._repr_html_()

    def count(self, verdict: str) -> int:
        """Return how many requirements have a verdict.

        Args:
            verdict: 'passed', 'failed', 'not measured' or 'no data'.
        """
        verdicts: list[str] = self.result.table["verdict"].to_pylist()
        return verdicts.count(Verdict(verdict))

    def unmet(self, *, with_value: bool = True) -> list[str]:
        """Return a line for each requirement that is not met, or has no value, with the reason.

        Args:
            with_value: also those that were measured and failed.
        """
        return [
            f"{row['verdict']}: {row['subject'] or row['target']}: {row['metric']}"
            f" {row['condition']}: {row['measured'] or row['reason']}"
            for row in self.result.table.to_pylist()
            if row["value"] is None or (with_value and row["verdict"] == Verdict.FAILED)
        ]

    def to_junit(self, *, allow_not_measured: bool = False) -> str:
        """Return the verdicts as JUnit XML: one without a value is an error, or skipped."""
        return junit_xml(self.result, self.run, allow_not_measured=allow_not_measured)


def verify(
    connection: duckdb.DuckDBPyConnection,
    targets: TargetsFile,
    part: Slice,
    *,
    paths: Mapping[str, Mapping[str, Sequence[str]]] | None = None,
    case: str = "first",
) -> Verification:
    """Return the verdicts on the requirements of a file.

    `paths` has for each named path of the requirements its topics and nodes, or globs, by 'from',
    'to', 'via' and 'without'. `case` are the arrivals of paths that count, as in the query flows.
    """
    one = part.one_run(connection, "a verification")
    part = replace(part, run=one.run_id)
    window = part.window([one])
    vanished = _vanished(connection, targets, one)
    work = _Work(connection, part, window, paths or {}, case)
    rows = [
        row
        for place, target in enumerate(targets.targets)
        for row in work.rows(target, vanished.get(place))
    ]
    header = replace(internal_sql().header("requirement_verdict"), name="verify")
    judged = pa.table(
        {
            column.name: _column([row.get(column.name) for row in rows], column.type)
            for column in header.columns
        }
    )
    with registered(connection, judged=judged):
        table = internal_sql().run(connection, "requirement_verdict", {}).to_arrow_table()
    notes = list(work.notes)
    lost = connection.execute(_LOST, {"run_id": one.run_id}).fetchall()[0][0]
    if lost:
        notes.append(f"the trace lost {lost:,} events, so that values may be wrong: msgflow check")
    return Verification(QueryResult(table, header, (one,), notes), one, str(targets.file.path))


def _column(values: Sequence[Any], sql_type: str) -> pa.Array:
    """Return values as a column of a type of SQL."""
    match sql_type:
        case "VARCHAR":
            return texts_to_arrow(values)
        case "BIGINT":
            return integers_to_arrow(values, pa.int64())
        case _:
            numbers = np.array(values, np.float64)
            return to_arrow(numbers, np.isnan(numbers))


@dataclass
class _Work:
    connection: duckdb.DuckDBPyConnection
    part: Slice
    window: Window
    paths: Mapping[str, Mapping[str, Sequence[str]]]
    case: str
    notes: dict[str, None] = field(default_factory=dict)

    def rows(self, target: Target, vanished: str | None) -> Iterator[dict[str, Any]]:
        """Yield the verdicts on a target; `vanished` says what of it the run does not have."""
        if vanished is not None:
            for requirement in target.requirements:
                row = {"verdict": Verdict.NOT_MEASURED, "reason": vanished}
                yield self._verdict(target, requirement) | row
            return
        metrics = SUBJECTS[target.kind].metrics
        asked: dict[str, list[Requirement]] = {}
        for requirement in target.requirements:
            asked.setdefault(metrics[requirement.metric].query, []).append(requirement)
        measured = {name: self._measure(target, name, asked[name]) for name in sorted(asked)}
        for requirement in target.requirements:
            name = metrics[requirement.metric].query
            place = asked[name].index(requirement)
            for row in measured[name]:
                yield self._row(target, requirement, row, place)
            if not measured[name]:
                yield self._missing(target, requirement)

    def _measure(
        self, target: Target, name: str, requirements: Sequence[Requirement]
    ) -> list[dict[str, Any]]:
        """Return the values of the requirements that one query measures, a row per thing."""
        subject = SUBJECTS[target.kind]
        columns = [f"{subject.label[name]} AS subject"]
        for place, requirement in enumerate(requirements):
            metric = subject.metrics[requirement.metric]
            statistic = requirement.condition.statistic
            value = metric.value.format(statistic, samples=metric.samples)
            key = KEYS[metric.worst] if metric.worst else "NULL"
            columns.append(f"({value})::DOUBLE AS value_{place}")
            columns.append(f"({metric.samples})::BIGINT AS samples_{place}")
            columns.append(f"{key} AS key_{place}")
        if any(column.name == AMBIGUOUS for column in load_query(name).columns):
            columns.append(AMBIGUOUS)
        where, given = self._conditions(target, load_query(name))
        condition = " AND ".join(where) or "true"
        sql = f"SELECT {', '.join(columns)} FROM ({{}}) AS result WHERE {condition} ORDER BY ALL"
        return self._ask(name, sql, target, given)

    def _conditions(self, target: Target, header: Header) -> tuple[list[str], dict[str, Value]]:
        """Return which rows of a query a target means, with the values of its conditions."""
        if target.path_name is not None:
            places = self.paths[target.path_name.value]
            visited = Selection(
                via=tuple(places.get("via", ())), without=tuple(places.get("without", ()))
            )
            return conditions_of(header, visited)
        if target.kind == PATH:
            topics: list[Value] = [topic.value for topic in target.topics]
            return ["list_has_all(string_split(path, ' → '), $via)"], {"via": topics}
        if target.kind == ENDS:
            # The parameters of the query choose.
            return [], {}
        filters = SUBJECTS[target.kind].filters
        where = [
            self._matches(header, field, filters[field].columns[header.name])
            for field in target.chosen
        ]
        return where, {f"wanted_{field}": text.value for field, text in target.chosen.items()}

    @staticmethod
    def _matches(header: Header, field: str, columns: Sequence[str]) -> str:
        is_named = " OR ".join(f"{column} = $wanted_{field}" for column in columns)
        is_meant = " OR ".join(f"{column} GLOB $wanted_{field}" for column in columns)
        if any(column.name == "is_internal" for column in header.columns):
            # A pattern leaves out what ROS does for itself; an exact name does not.
            is_meant = f"({is_meant}) AND NOT is_internal"
        return f"({is_named} OR ({is_meant}))"

    def _ask(
        self, name: str, sql: str, target: Target, given: dict[str, Value]
    ) -> list[dict[str, Any]]:
        header = load_query(name)
        params = tuple(
            Param(key, "VARCHAR[]" if isinstance(value, list) else "VARCHAR", None, True, "")
            for key, value in given.items()
        )
        around = replace(
            header,
            body=sql.format(header.body.rstrip()),
            params=header.params + params,
            # The result does not have the columns of the named query.
            columns=(),
        )
        own: dict[str, Value] = dict(given)
        if target.path_name is not None:
            places = self.paths[target.path_name.value]
            own |= {word: [*places[word]] for word in ("from", "to") if word in places}
        elif target.kind == PATH:
            own |= {"from": [target.topics[0].value], "to": [target.topics[-1].value]}
        elif target.kind == ENDS:
            own = {field: text.value for field, text in target.chosen.items()}
        if any(param.name == "case" for param in header.params):
            own["case"] = self.case
        part = self.part if header.has_window else Slice(self.part.run)
        result = run_query(self.connection, around, own, part, internal=True)
        self.notes.update(dict.fromkeys(result.notes))
        rows: list[dict[str, Any]] = result.to_arrow().to_pylist()
        return rows

    def _row(
        self, target: Target, requirement: Requirement, row: dict[str, Any], place: int
    ) -> dict[str, Any]:
        metric = SUBJECTS[target.kind].metrics[requirement.metric]
        condition = requirement.condition
        value = row[f"value_{place}"]
        verdict = _without_value(metric)
        # It is made of links that may be other ones.
        doubted = row.get(AMBIGUOUS)
        doubt = f"values by links that may be other ones: {doubted:,}" if doubted else None
        found = self._verdict(target, requirement)
        if value is not None:
            verdict = Verdict.PASSED if condition.holds(value) else Verdict.FAILED
            if condition.is_exceeded_by(value) and metric.worst:
                found |= self._worst(target, metric.worst, row["subject"], row[f"key_{place}"])
        return found | {
            "verdict": verdict,
            "subject": target.name if target.kind == PATH else row["subject"],
            "path": row["subject"] if target.kind == PATH else None,
            "measured": None if value is None else format_value(value, metric.dimension),
            "value": value,
            "samples": row[f"samples_{place}"],
            "reason": (metric.lacking or metric.missing) if value is None else doubt,
        }

    def _missing(self, target: Target, requirement: Requirement) -> dict[str, Any]:
        if target.kind == PATH:
            reason = "no message of the first topic led to the last one along this path"
            if target.path_name is not None:
                reason = "no message led from the start of this path to its end"
        elif target.kind == ENDS:
            reason = "no message led from the one to the other"
        else:
            reason = f"nothing of this {target.kind} was measured in the time window"
        metric = SUBJECTS[target.kind].metrics[requirement.metric]
        return self._verdict(target, requirement) | {
            "verdict": _without_value(metric),
            "reason": metric.lacking or reason,
        }

    @staticmethod
    def _verdict(target: Target, requirement: Requirement) -> dict[str, Any]:
        return {
            "target": target.name,
            "metric": requirement.metric,
            "condition": requirement.condition.text,
            "unit": str(SUBJECTS[target.kind].metrics[requirement.metric].dimension),
            "line": requirement.line,
        }

    def _worst(self, target: Target, kind: str, subject: str, key: Any) -> dict[str, Any]:
        if kind in ("flow", "first_flow", "last_flow"):
            return worst_case_of([*key, "take"])
        if kind == "lost_flow":
            rows = self._ask("flows", LOST_FLOW, target, {"subject": subject})
            return worst_case_of(list(rows[0].values())) if rows else {}
        return find_worst_case(self.connection, kind, key, self.window)


def _without_value(metric: Metric) -> Verdict:
    """Return the verdict on a requirement without a value; its name is known in the run."""
    return Verdict.NO_DATA if metric.lacking is None else Verdict.NOT_MEASURED


def _vanished(connection: duckdb.DuckDBPyConnection, file: TargetsFile, run: Run) -> dict[int, str]:
    """Return why targets cannot be measured, by place: a name that nothing in the run has."""
    topics = SUBJECTS["topic"].filters["topic"]

    @cache
    def names(sql: str) -> list[str]:
        rows = connection.execute(sql, {"run_id": run.run_id}).fetchall()
        return sorted(name for (name,) in rows if name is not None)

    found: dict[int, str] = {}
    for place, target in enumerate(file.targets):
        filters = SUBJECTS[target.kind].filters
        wanted = [(text, topics) for text in target.topics]
        wanted += [(text, filters[word]) for word, text in target.chosen.items()]
        for text, one in wanted:
            there = names(one.names)
            # Topics of a path are no patterns.
            fits = eq if text in target.topics else fnmatchcase
            if text.value in there or any(fits(name, text.value) for name in there):
                continue
            more = f" and {len(there) - 5} more" if len(there) > 5 else ""
            some = f"{', '.join(there[:5])}{more}" if there else f"no {one.what} at all"
            hint = did_you_mean(text.value, there, f"it has {some}")
            found.setdefault(place, f"the run has no such {one.what} — {text.value}; {hint}")
    return found
