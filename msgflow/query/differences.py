"""Differences between runs, and conditions that say how much worse one may be."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import duckdb
import pyarrow as pa

from msgflow.errors import UsageError
from msgflow.query.selection import CUT_COLUMN
from msgflow.sql.statement import internal_sql, registered

if TYPE_CHECKING:
    from msgflow.result.query_result import QueryResult

STATISTICS = ("median", "mean", "p95", "p99", "max")
SHARE = "share"
_CONDITION = re.compile(
    rf"\s*(?:(?P<statistic>{'|'.join(STATISTICS)})\s*>\s*(?P<limit>\d+(?:\.\d+)?)"
    rf"\s*(?P<unit>%|ns|us|µs|ms|s)|{SHARE}\s*<\s*-\s*(?P<points>\d+(?:\.\d+)?)\s*%)\s*"
)
# Warm-up is left out in steps of half a second.
_STEP_NS = 500_000_000
_UNIT_NS = {"ns": 1, "us": 1_000, "µs": 1_000, "ms": 1_000_000, "s": 1_000_000_000}
_NONE = "none shown"
_CHANGED = ("longer", "shorter", "both", "only in A", "only in B")


@dataclass(frozen=True)
class Condition:
    """A condition under which run B is worse than it may be."""

    text: str  # as the user wrote it, such as 'p95>5%' or 'share<-1%'
    statistic: str  # one of STATISTICS, or SHARE
    allowed: float  # in percent of run A, or in nanoseconds; for a share in percentage points
    is_relative: bool  # it is in percent


@dataclass(frozen=True)
class Failure:
    """A path, callback or topic that is worse than it may be.

    Attributes:
        condition: as the user wrote it.
        subject: the path, callback or topic.
        reason: the measured difference.
        may_be_chance: the values are too few, or too alike in both, to exclude chance.
    """

    condition: str
    subject: str
    reason: str
    may_be_chance: bool


@dataclass(frozen=True, kw_only=True)
class Differences:
    """How runs of one side differ from those of another.

    Attributes:
        result: one row per path (callback, topic) and statistic, see `main.comparison`; of several
            runs `internal.fleet_comparison`.
        parts: what the differences of the means of paths consist of, see `internal.change_part`;
            None unless asked for.
        culprits: what `why` blames in one run, and not as much in the other, see
            `internal.changed_culprit`; None where paths of two runs are not compared.
        lines: the greatest change, and where it comes from; then the culprits that changed.
        all_paths: how to compare all paths, where some are left out.
    """

    result: QueryResult
    parts: QueryResult | None = None
    culprits: QueryResult | None = None
    lines: tuple[str, ...] = ()
    all_paths: str = "a higher --max-paths or --max-depth, or --from and --to"

    def changes(self, *, only_different: bool = True) -> QueryResult:
        """Return a row for each path, callback or topic, the greatest change first.

        Args:
            only_different: leave out those without a proven difference.
        """
        with duckdb.connect() as con, registered(con, compared=self.result.table):
            table = internal_sql().run(con, "changes", {}).to_arrow_table()
        header = replace(internal_sql().header("changes"), name="changes")
        every = replace(self.result, table=table, header=header, notes=list(self.result.notes))
        alike = Counter(word for word in table["change"].to_pylist() if word not in _CHANGED)
        if not only_different or not alike:
            return every
        # Those that differ come first.
        found = every.first(len(every) - alike.total())
        none = alike.pop(_NONE, 0)
        parts = [f"{none} with no difference shown"] if none else []
        parts += [f"{number} with {reason}" for reason, number in sorted(alike.items())]
        text = f"{len(every)} compared, {', '.join(parts)}: --all lists them"
        if len(found):
            found.notes.insert(0, text)
            return found
        names = " and ".join(run.name for run in every.runs)
        between = f" between {names}" if names else ""
        return replace(found, when_empty=f"no difference is shown{between}: {text}")

    def failures(self, conditions: Iterable[str], *, even_by_chance: bool = False) -> list[Failure]:
        """Return what exceeds A by more than conditions such as 'p95>5%' or 'median>2ms' allow.

        'share<-1%' limits how much less may arrive: the share in B may be that many points below
        the share in A. A subject with values in A and none in B fails, too.

        Args:
            even_by_chance: differences count that may be chance, too.
        """
        wanted = parse_conditions(conditions)
        if not wanted:
            return []
        if any(self.result.to_arrow()[CUT_COLUMN].to_pylist()):
            raise UsageError(
                f"not all paths were compared, so that nothing holds of all — {wanted[0].text}",
                self.all_paths,
            )
        places = [vars(each) | {"place": place} for place, each in enumerate(wanted)]
        tables = {"compared": self.result.table, "condition": pa.Table.from_pylist(places)}
        with duckdb.connect() as con, registered(con, **tables):
            rows = internal_sql().run(con, "excess", {}).fetchall()
        for condition, subject, reason, a_text, _ in rows:
            if reason is None:
                raise UsageError(
                    f"no percentage can be told of {a_text} in A: {condition} — {subject}",
                    "msgflow clocks apply messages, or a limit in ns, us, ms or s",
                )
        return [
            Failure(condition, subject, reason, may_be_chance)
            for condition, subject, reason, _, may_be_chance in rows
            if even_by_chance or not may_be_chance
        ]


def warm_up_seconds(last_ns: int | None) -> float:
    """Return what leaves out a warm-up whose last long value lies so long after the start."""
    return 0.0 if last_ns is None else (last_ns // _STEP_NS + 1) * _STEP_NS / 1e9


def parse_conditions(texts: Iterable[str]) -> list[Condition]:
    """Read conditions; several may stand in one text, separated by commas."""
    parts = [part for text in texts for part in text.split(",")]
    return [_parse(part) for part in parts]


def _parse(text: str) -> Condition:
    found = _CONDITION.fullmatch(text)
    if found is None:
        raise UsageError(
            f"cannot read the condition — {text.strip() or 'an empty one'}",
            "such as 'p95>5%' or 'median>2ms', of " + ", ".join(STATISTICS) + ", or 'share<-1%'",
        )
    if found["points"] is not None:
        return Condition(text.strip(), SHARE, float(found["points"]), True)
    unit = found["unit"]
    return Condition(
        text.strip(), found["statistic"], float(found["limit"]) * _UNIT_NS.get(unit, 1), unit == "%"
    )
