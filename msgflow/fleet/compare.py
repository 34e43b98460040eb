"""Comparison of runs of a lake by a label: do they differ more than runs of one side do?"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from msgflow.db.sandbox import open_memory
from msgflow.errors import UsageError
from msgflow.fleet.lake import Lake
from msgflow.fleet.lake_connection import Reading, choose
from msgflow.query.compare import runs_compared, share_of
from msgflow.query.differences import STATISTICS, Differences
from msgflow.query.selection import CASES, CUT_COLUMN
from msgflow.sql.statement import registered
from msgflow.text.name_suggestions import meant_or, nearest
from msgflow.text.values import count

Row = dict[str, Any]

_VALUES = """
SELECT labels[$by] AS value, count(*)
FROM chosen
WHERE value IS NOT NULL
GROUP BY value
"""
_SIDED = """
SELECT
    run,
    CASE labels[$by] WHEN $base THEN 'a' WHEN $other THEN 'b' END AS side,
    coalesce(labels[$unit], run) AS unit
FROM chosen
WHERE side IS NOT NULL
"""
_TABLES = ("flow", "e2e_latency")
_SHOWN = ("B is longer", "B is shorter")
_MOST_NAMED = 10
_ALL_PATHS = "--where chooses runs whose paths were all found: is_cut of fleet query e2e-latency"


def compare(
    lake: Lake,
    by: str,
    base: str | None = None,
    other: str | None = None,
    *,
    where: str | None = None,
    unit: str | None = None,
    case: str = "first",
    confidence: float = 0.95,
    at_least: str = "5%",
) -> Differences:
    """Compare runs whose label has one value with those of another.

    `by` is the key of the label, `base` and `other` its values on side A and B. They may be left
    out if the runs have two values: A is the lesser one, and numbers in them count by their size.
    Runs with the same value of the label `unit` count as one: runs of one robot are more alike than
    runs of several, so that they tell less. Arrivals of paths are those of `case`, one of CASES. An
    interval contains the true difference with the probability `confidence`. Less than `at_least` is
    about equal.
    """
    if not 0 < confidence < 1:
        raise UsageError(f"the confidence lies between 0 and 1 — {confidence}", "0.95 is usual")
    if case not in CASES:
        raise UsageError(f"there is no such case — {case}", f"choose one of {', '.join(CASES)}")
    choice = choose(lake, where)
    known_labels = ", ".join(choice.labels)
    have = f"the labels are {known_labels}" if known_labels else "there are no labels"
    for key in (by, unit):
        if key is not None and key not in choice.labels:
            raise UsageError(
                f"no run of the lake has such a label — {key}",
                meant_or(nearest(key, choice.labels), have, "?"),
            )
    with open_memory() as con, registered(con, chosen=choice.runs):
        known = dict(con.execute(_VALUES, {"by": by}).fetchall())
        base, other = _sides(by, known, base, other)
        values = {"by": by, "unit": unit, "base": base, "other": other}
        sided = con.sql(_SIDED, params=values).to_arrow_table()
        with registered(con, sided=sided):
            runs = con.sql("FROM chosen SEMI JOIN sided USING (run)").to_arrow_table()
    with Reading(replace(choice, runs=runs), _TABLES) as reading:
        reading.connection.register("sided", sided)
        result = runs_compared(
            reading.connection, case=case, confidence=confidence, at_least=share_of(at_least)
        )
    rows = result.to_arrow().to_pylist()
    result.notes.extend(_who(by, base, other, sided.to_pylist(), unit))
    result.notes.extend(_left_out(by, known, len(sided), len(choice.runs)))
    paths = [row for row in rows if row["statistic"] == STATISTICS[0]]
    result.notes.extend(_one_sided(paths, by))
    result.notes.extend(_doubts(rows, paths, confidence))
    return Differences(result=result, all_paths=_ALL_PATHS)


def _sides(
    by: str, known: Mapping[str, int], base: str | None, other: str | None
) -> tuple[str, str]:
    """Return the values of the label for side A and side B."""
    values = sorted(known, key=_natural)
    have = ", ".join(f"{value} ({known[value]:,})" for value in values[:_MOST_NAMED])
    have += ", …" if len(values) > _MOST_NAMED else ""
    if base in known and other is None and len(values) == 2:
        (other,) = set(values) - {base}
    if base is None or other is None:
        if base is not None or len(values) != 2:
            raise UsageError(
                f"two values of {by} are compared, the runs have {len(values)}: {have or 'none'}",
                f"msgflow fleet compare BASE OTHER --by {shlex.quote(by)}",
            )
        return values[0], values[1]
    for value in (base, other):
        if value not in known:
            raise UsageError(f"no run has {by}={value}", f"the runs have {have or 'none'}")
    if base == other:
        raise UsageError(f"both sides are the same — {base}", "give two values")
    return base, other


def _natural(text: str) -> list[tuple[int, int | str]]:
    """Return the sort key of a version: 2.9 before 2.10."""
    return [
        (0, int(part)) if part.isdecimal() and part.isascii() else (1, part)
        for part in re.split(r"(\d{1,40})", text)
        if part
    ]


def _who(by: str, base: str, other: str, sided: Sequence[Row], unit: str | None) -> Iterator[str]:
    units: dict[str, set[str]] = {}
    for side, value in (("a", base), ("b", other)):
        runs = [row["unit"] for row in sided if row["side"] == side]
        units[side] = set(runs)
        of = f", {len(units[side]):,} by {unit}" if unit is not None else ""
        yield f"{side.upper()} is {by}={value}: {count(len(runs), 'run')}{of}"
    both = units["a"] & units["b"]
    if unit is not None and both:
        yield (
            f"by {unit}, {len(both):,} on both sides: what tells one from another counts as chance,"
            " so that intervals are rather too wide"
        )


def _left_out(by: str, known: Mapping[str, int], sided: int, total: int) -> Iterator[str]:
    labelled = sum(known.values())
    others, without = labelled - sided, total - labelled
    if others or without:
        yield f"left out: {others:,} runs with other values of {by}, {without:,} without it"


def _one_sided(paths: Sequence[Row], by: str) -> Iterator[str]:
    """Yield a note for each side that has paths of its own."""
    if not any(row["a_count"] and row["b_count"] for row in paths):
        raise UsageError(
            "the two sides have no path with latencies in common",
            f"msgflow fleet query e2e-latency --group-by {shlex.quote(by)} tells what each has",
        )
    for side in ("A", "B"):
        number = sum(row["verdict"] == f"only in {side}" for row in paths)
        if number:
            yield f"{count(number, 'path')} with values only in {side}"


def _doubts(rows: Sequence[Row], paths: Sequence[Row], confidence: float) -> Iterator[str]:
    """Yield notes that limit what the numbers show."""
    if any(row[CUT_COLUMN] for row in rows):
        yield "some runs have more paths than an ingest looks for, and those are left out"
    for side in ("a", "b"):
        affected = sum(row[f"{side}_loss_affected"] or 0 for row in paths)
        if affected:
            yield f"{affected:,} flows of {side.upper()} have a gap of a trace in their time"
        doubted = sum(row[f"{side}_ambiguous"] or 0 for row in paths)
        if doubted:
            yield f"{doubted:,} flows of {side.upper()} pass a link that may be another one"
    intervals = [row for row in rows if row["low_ns"] is not None]
    shown = sum(row["verdict"] in _SHOWN for row in rows)
    if shown:
        yield (
            f"{shown:,} of {len(intervals):,} intervals show a difference; if there were none,"
            f" some {(1 - confidence) * len(intervals):.2g} would"
        )
