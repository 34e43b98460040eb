"""Whether `msgflow query changes` finds when something changed, and names what.

    python benchmarks/changes.py [--seeds 20] [--first 0] [--stationary 100] [--kind KIND]…
                                 [--size SIZE] [--jobs N] [--verbose]

Systems of the simulator of ten to forty nodes (`robot/changing.py`), on one host or two, with
events lost or the clock set in some: in each one thing changes at some moment, by some size. A
change is found if a row has it within a second, what grows all the time if it is a trend. The cause
is right if a row that follows from no other names the node, or what began. Rows at any other time
are false.

Of changes that at least double something, or lose three of ten messages, 95 % have to be found, of
those by a half 80 %; 95 % of
the rows have to be true; systems in which nothing changes may have one row in 100 recordings. The
exit code is 1 if not.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from robot.changing import KINDS, SIZED, Planted, changing

import msgflow
from msgflow.ingest import ingest
from msgflow_sim import simulate

_SECOND = 1e9
_NEAR_S = 1.0
_LARGE, _HALF, _LOSS = 2, 1.5, 0.3
_FOUND, _FOUND_HALF, _TRUE = 0.95, 0.8, 0.95


@dataclass(frozen=True)
class Judged:
    """What was asked of a system, and what came: rows in words, each with whether it is true."""

    name: str
    planted: Planted
    is_found: bool
    is_cause_right: bool
    rows: tuple[tuple[bool, str], ...]


def judge(kind: str, seed: int) -> Judged:
    """Simulate a system, and compare what `changes` says with what was planted."""
    scenario, planted = changing(kind, seed)
    with tempfile.TemporaryDirectory() as folder:
        trace, database = Path(folder) / "trace", Path(folder) / "run.duckdb"
        simulate(scenario, trace)
        ingest([str(trace)], database)
        with msgflow.open_db(database) as opened:
            rows = opened.query("changes").table.to_pylist()
            begin = opened.sql("SELECT min(start_ns) AS ns FROM run").table["ns"][0].as_py()
    true = [_is_true(row, planted, begin) for row in rows]
    roots = [row for row, is_true in zip(rows, true, strict=True) if is_true]
    return Judged(
        scenario.name,
        planted,
        any(true),
        any(_names(row, planted) for row in roots),
        tuple(zip(true, (_in_words(row, begin) for row in rows), strict=True)),
    )


def _is_true(row: dict[str, Any], planted: Planted, begin: int) -> bool:
    if planted.kind == "growing":
        return bool(row["kind"] == "trend")
    at = (row["at_ns"] - begin) / _SECOND
    if any(abs(at - moment) < _NEAR_S for moment in planted.moments):
        return True
    # What follows from it may come later: a queue that grows, pauses of what gets lost.
    return bool(row["follows"]) and any(at > moment for moment in planted.moments)


def _names(row: dict[str, Any], planted: Planted) -> bool:
    if planted.occasion:
        return planted.occasion in (row["since"] or "")
    return not row["follows"] and row["node"] == planted.node


def _in_words(row: dict[str, Any], begin: int) -> str:
    return " ".join(
        str(each)
        for each in (
            f"{(row['at_ns'] - begin) / _SECOND:.2f} s",
            *(row[name] for name in ("kind", "what", "node", "subject", "change", "count")),
            f"since {row['since']}, follows {row['follows']}",
        )
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Judge systems, print a table; return the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--stationary", type=int, default=100)
    parser.add_argument("--kind", action="append", choices=KINDS)
    parser.add_argument("--size", type=float, help="only changes by this size")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--verbose", action="store_true", help="all rows, not only false ones")
    given = parser.parse_args(arguments)
    seeds = range(given.first, given.first + given.seeds)
    cases = [
        (kind, seed)
        for kind in given.kind or KINDS
        for seed in seeds
        if given.size is None or changing(kind, seed)[1].size == given.size
    ]
    cases += [("", seed) for seed in range(given.first, given.first + given.stationary)]
    with ProcessPoolExecutor(given.jobs) as pool:
        judged = list(_printed(pool.map(judge, *zip(*cases, strict=True)), given.verbose))
    return _summary(judged)


def _printed(judged: Iterable[Judged], is_verbose: bool) -> Iterable[Judged]:
    for each in judged:
        is_missed = bool(each.planted.kind) and not each.is_found
        if is_verbose or is_missed or not all(is_true for is_true, _ in each.rows):
            print(each.name, each.planted, "MISSED" if is_missed else "", flush=True)
            for is_true, words in each.rows:
                if is_verbose or not is_true:
                    print("   ", "" if is_true else "false:", words, flush=True)
        yield each


def _summary(judged: Sequence[Judged]) -> int:
    kinds: dict[str, list[Judged]] = defaultdict(list)
    for each in judged:
        size = f" {each.planted.size:g}" if each.planted.kind in (*SIZED, "lossy") else ""
        kinds[(each.planted.kind or "stationary") + size].append(each)
    print("\n| change | systems | found | cause right | with false rows |")
    print("| --- | ---: | ---: | ---: | ---: |")
    for name, group in sorted(kinds.items()):
        false = sum(not all(is_true for is_true, _ in each.rows) for each in group)
        found = sum(each.is_found for each in group)
        right = sum(each.is_cause_right for each in group)
        print(f"| {name} | {len(group)} | {found} | {right} | {false} |")
    planted = [each for each in judged if each.planted.kind]
    large = [each for each in planted if _is_large(each.planted)]
    half = [each for each in planted if each not in large and each.planted.size == _HALF]
    rows = [is_true for each in planted for is_true, _ in each.rows]
    still = [each for each in judged if not each.planted.kind]
    marks = {
        f"found from {_LARGE} times up": (_share(each.is_found for each in large), _FOUND),
        f"found at {_HALF} times": (_share(each.is_found for each in half), _FOUND_HALF),
        "cause right of those found": (
            _share(each.is_cause_right for each in large if each.is_found),
            _FOUND,
        ),
        "true rows": (_share(rows), _TRUE),
        "stationary systems without a row": (_share(not each.rows for each in still), 0.99),
    }
    print()
    for name, (share, least) in marks.items():
        print(f"{name}: {share:.3f} (at least {least})" + ("" if share >= least else " ✗"))
    return int(any(share < least for share, least in marks.values()))


def _is_large(planted: Planted) -> bool:
    if planted.kind == "lossy":
        return planted.size >= _LOSS
    return planted.kind not in SIZED or planted.size >= _LARGE


def _share(facts: Iterable[bool]) -> float:
    known = list(facts)
    return sum(known) / len(known) if known else 1.0


if __name__ == "__main__":
    sys.exit(main())
