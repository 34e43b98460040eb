"""Whether CPU times of callbacks are those that the callbacks measured themselves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from operator import attrgetter
from pathlib import Path

import duckdb

from msgflow import trace

_LEAST_SHARE = 0.99
_ABSOLUTE_NS = 50_000
_RELATIVE = 0.01
# A clock of perf stops before a thread that waits is off its CPU, and goes on late. That of Python
# does not. A callback that does not wait for the disk waits once or twice.
_WAIT_NS = 10_000
# Calls behind the last one that was recorded are none of the recording.
_CALLS = """
WITH truth AS (
    SELECT function, begin_ns + $offset_ns AS begin_ns, cpu_ns, coalesce(waits, 0) AS waits
    FROM read_csv(
        $truth,
        delim = '\t',
        header = false,
        auto_detect = false,
        null_padding = true,
        columns = {
            'function': 'VARCHAR', 'begin_ns': 'BIGINT', 'cpu_ns': 'BIGINT', 'waits': 'BIGINT'
        }
    )
),
instance AS (
    SELECT regexp_extract(c.symbol, '(\\w+)(\\(|$)', 1) AS function, i.start_ns, i.end_ns, i.cpu_ns
    FROM main.callback_instance AS i
    JOIN main.callback AS c ON i.callback_id = c.callback_id
    WHERE i.end_ns IS NOT NULL
)
SELECT
    t.function,
    t.cpu_ns AS true_ns,
    CASE WHEN t.begin_ns <= i.end_ns THEN i.cpu_ns END AS told_ns,
    t.waits
FROM truth AS t
ASOF LEFT JOIN instance AS i ON t.function = i.function AND t.begin_ns >= i.start_ns
WHERE t.begin_ns < coalesce(
    (SELECT max(o.end_ns) FROM instance AS o WHERE o.function = t.function),
    (SELECT max(end_ns) FROM instance)
)
ORDER BY t.function, t.begin_ns
"""


@dataclass(frozen=True)
class Call:
    """A call of a callback.

    Attributes:
        function: of the callback.
        true_ns: CPU time that it measured.
        told_ns: CPU time that the recording tells; None: not known.
        waits: how often its thread waited; 0 in Python.
    """

    function: str
    true_ns: int
    told_ns: int | None
    waits: int = 0

    @property
    def is_right(self) -> bool:
        """Whether msgflow's CPU time is near enough."""
        limit_ns = _ABSOLUTE_NS + _RELATIVE * self.true_ns + _WAIT_NS * self.waits
        return self.told_ns is not None and abs(self.told_ns - self.true_ns) <= limit_ns


def clock_offset_ns(path: Path) -> int:
    """Return what a trace adds to its clock, which is CLOCK_MONOTONIC."""
    with trace.open([path]) as opened:
        (offset_ns,) = {each.clock_offset_ns for each in opened.traces}
    return offset_ns


def measured_calls(database: Path, truth: Path, offset_ns: int) -> list[Call]:
    """Return the calls that callbacks wrote down, as far as they were recorded."""
    with duckdb.connect(database, read_only=True) as connection:
        values = {"offset_ns": offset_ns, "truth": str(truth)}
        return [Call(*row) for row in connection.execute(_CALLS, values).fetchall()]


def wrong_times(calls: Sequence[Call]) -> Iterator[str]:
    """Yield what is wrong with the CPU times of each function."""
    if not calls:
        yield "no callback measured its CPU time"
    for function, of_function in groupby(calls, attrgetter("function")):
        some = list(of_function)
        right = sum(each.is_right for each in some)
        if right < _LEAST_SHARE * len(some):
            known = sum(each.told_ns is not None for each in some)
            yield f"CPU time of {function}: {right} of {len(some)} right, {known} known"


def in_words(calls: Sequence[Call]) -> str:
    """Say how many CPU times are right, and how far nearly all are off."""
    right = sum(each.is_right for each in calls)
    off = sorted(abs(each.told_ns - each.true_ns) for each in calls if each.told_ns is not None)
    words = f"CPU time right in {right} of {len(calls)} calls"
    if off:
        words += f", 99 % off by at most {off[int(_LEAST_SHARE * (len(off) - 1))] / 1e3:.0f} µs"
    return words
