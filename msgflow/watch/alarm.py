"""Alarms: targets that a window does not meet, and what was to blame."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import duckdb

from msgflow.errors import NoFlowError
from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query
from msgflow.query.why import explain
from msgflow.run.slice import Slice
from msgflow.run.window import Window
from msgflow.text.values import ARROW, format_duration
from msgflow.verify.metrics import ENDS
from msgflow.verify.targets_file import TargetsFile
from msgflow.verify.verify import Verdict, verify

Row = dict[str, Any]

# A requirement has the first of these that a window gave it.
_STRONGEST = (Verdict.FAILED, Verdict.PASSED, Verdict.NO_DATA, Verdict.NOT_MEASURED)


@dataclass(frozen=True)
class _Told:
    """What an alarm has told of a requirement that is not met.

    A case is news if it began after all that was judged, or is worse than all that was told. When
    the worst case has left the window, the next worst one is no news.
    """

    worst_ns: int  # the worst case so far; 0 of requirements that have no worst case
    until_ns: int  # until when all was judged
    culprit: Row | None  # which was told of it

    def is_surpassed(self, worst_ns: int | None, at_ns: int | None) -> bool:
        is_later = at_ns is not None and at_ns >= self.until_ns
        return is_later or (worst_ns or 0) > self.worst_ns


@dataclass
class Alarm:
    """The targets, and which of them were met since the begin."""

    targets: TargetsFile
    # Places of the named paths of the requirements, as `verify` takes them.
    paths: Mapping[str, Mapping[str, Sequence[str]]]
    # Gets a sentence about each requirement that had data and has none any more.
    note: Callable[[str], None]
    with_flows: bool = False  # also ask what became of the flows of paths

    def __post_init__(self) -> None:
        self._places = {
            target.name: {field: text.value for field, text in target.chosen.items()}
            for target in self.targets.targets
            if target.kind == ENDS
        }
        # By (target, metric, condition).
        self._verdicts: dict[tuple[str, str, str], Verdict] = {}
        self._failing: dict[tuple[Any, ...], _Told] = {}
        self._silent: set[tuple[str, str, str]] = set()

    def count(self, verdict: Verdict) -> int:
        """Return how many requirements have a verdict: one that failed once has failed."""
        return list(self._verdicts.values()).count(verdict)

    @property
    def is_measured(self) -> bool:
        """Each requirement had a value in some window. False before the first window."""
        found = set(self._verdicts.values())
        return bool(found) and found <= {Verdict.FAILED, Verdict.PASSED}

    def judge(
        self, con: duckdb.DuckDBPyConnection, window: Window, final_ns: int
    ) -> tuple[list[Row], list[Row]]:
        """Verify a window, of whose times those from `final_ns` on are not final yet.

        It returns what is violated there and was not before; and the rows of `verify`, each with
        `culprit`, the row of `msgflow why` that is to blame for what fails, and as `flows` the row
        of `e2e-latency` of a path if asked for.
        """
        part = Slice(start=window.start_ns, end=window.end_ns)
        rows = verify(con, self.targets, part, paths=self.paths).result.table.to_pylist()
        found: list[Row] = []
        failing = {}
        culprits: list[Row] | None = None
        for row in rows:
            verdict = Verdict(row["verdict"])
            before = self._verdicts.get(_key(row), verdict)
            self._verdicts[_key(row)] = min(before, verdict, key=_STRONGEST.index)
            row |= {"culprit": None, "flows": self._flows(con, row, part)}
            if verdict != Verdict.FAILED:
                continue
            key = tuple(row[name] for name in ("target", "metric", "condition", "subject", "path"))
            told = self._failing.get(key)
            if told is None or told.is_surpassed(row["worst_ns"], row["worst_at_ns"]):
                culprits = _culprits(con, part) if culprits is None else culprits
                row["culprit"] = _culprit_of(row, culprits)
                found.append(_violation(row, final_ns))
            else:
                row["culprit"] = told.culprit
            worst_ns = max(row["worst_ns"] or 0, 0 if told is None else told.worst_ns)
            failing[key] = _Told(worst_ns, window.end_ns, row["culprit"])
        self._failing = failing
        self._note_silence(rows)
        return found, rows

    def _flows(self, con: duckdb.DuckDBPyConnection, row: Row, part: Slice) -> Row | None:
        """Return `median_ns`, `p99_ns`, `lost` and `dropped` of a path, or between two topics."""
        if not self.with_flows or row["subject"] is None:
            return None
        if row["path"] is not None:
            query, subject, prefix, ends = "e2e-latency", row["path"], "", _ends(row["path"])
        else:
            query, subject, prefix = "e2e-latency-ends", row["subject"], "first_"
            ends = self._places.get(row["target"], {})
        if not ends:
            return None
        for each in run_query(con, load_query(query), ends, part).table.to_pylist():
            between = each.get("path") or f"{each['first_topic']} → {each['last_topic']}"
            if subject in (between, f"{between} → {each.get('node')}"):
                numbers = {name: each[f"{prefix}{name}"] for name in ("median_ns", "p99_ns")}
                return numbers | {name: each[name] for name in ("lost", "dropped")}
        return None

    def _note_silence(self, rows: Sequence[Row]) -> None:
        """Say what had data before and has none in this window, once for each silence."""
        measured = {_key(row) for row in rows if row["value"] is not None}
        silent = {_key(row) for row in rows} - measured
        for row in rows:
            had_data = self._verdicts[_key(row)] in (Verdict.FAILED, Verdict.PASSED)
            if had_data and _key(row) in silent - self._silent:
                name = row["subject"] or row["target"]
                self.note(f"no data of {name}: {row['metric']} {row['condition']}: {row['reason']}")
        self._silent = silent


def _violation(row: Row, final_ns: int) -> Row:
    at_ns = row["worst_at_ns"]
    return {
        "subject": row["subject"] or row["target"],
        "path": row["path"],
        "metric": row["metric"],
        "condition": row["condition"],
        "measured": row["measured"],
        "worst_ns": row["worst_ns"],
        "at_ns": at_ns,
        "is_final": at_ns is None or at_ns < final_ns,
        "culprit": row["culprit"],
    }


def _key(row: Row) -> tuple[str, str, str]:
    return row["target"], row["metric"], row["condition"]


def _culprits(con: duckdb.DuckDBPyConnection, part: Slice) -> list[Row]:
    """Return what `msgflow why` says of a window, the worst culprit first."""
    try:
        found = explain(con, part.one_run(con, "an alarm"), part)
    except NoFlowError:
        return []
    rows: list[Row] = found.verdict.table.to_pylist()
    return rows


def _culprit_of(row: Row, culprits: Sequence[Row]) -> Row | None:
    """Return the worst culprit on the way that a requirement is about.

    Of two ends the steps between are those of the path that the culprit delays. Where nothing
    stands out, the only row has the slowest path: the way may be part of that.
    """
    ends = (row["path"] or row["subject"] or "").split(ARROW)
    for culprit in culprits:
        if culprit["kind"] is None:
            return culprit if {*ends} <= {*(culprit["path"] or "").split(ARROW)} else None
        steps = (row["path"] or culprit["path"] or "").split(ARROW)
        if ends[0] not in steps or ends[-1] not in steps:
            continue
        # What the first node does before it publishes is not on the way.
        way = steps[steps.index(ends[0]) + 1 : len(steps) - steps[::-1].index(ends[-1])]
        # The rate of a topic, which is the last step then, is not changed by who takes it.
        if culprit["node"] in way or culprit["topic_name"] in way[:-1]:
            return culprit
    return None


def violation_line(violation: Row) -> str:
    """Return a violation in one line: what, how much, and what was to blame."""
    worst = violation["worst_ns"]
    longest = "" if worst is None else format_duration(worst)
    longest = f", up to {longest}" if longest not in ("", violation["measured"]) else ""
    words = (
        f"{violation['subject']}: {violation['metric']} {violation['measured']}{longest}, required"
        f" {violation['condition']}"
    )
    if (culprit := violation["culprit"]) is not None:
        words += f": {culprit['headline']}"
        if culprit["kind"] is None:
            words += "".join(f": {line}" for line in culprit["evidence"])
    if violation["path"] and violation["path"] != violation["subject"]:
        words += f" — {violation['path']}"
    return words if violation["is_final"] else f"{words} (provisional)"


def _ends(path: str | None) -> Row:
    """Return the topics between which a flow counts: a target may be part of a longer path."""
    topics = (path or "").split(" → ")[1:-1]
    ends = {"from": topics[:1], "to": topics[-1:]} if topics else {}
    return {word: named for word, named in ends.items() if named[0].startswith("/")}
