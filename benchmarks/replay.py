"""Whether a replay gives what was recorded, and predicts what a change does.

    python benchmarks/replay.py [--systems 60] [--first 0] [--changes 0] [--seeds 10] [--jobs N]
                                [--verbose]

Systems of the simulator of four to forty nodes (`robot/replayed.py`): single-threaded,
multi-threaded and events executors of Humble and Rolling, and rclpy as `msgflow record` traces it.

A path is reproduced if the median of the replay without a change is within 2 % or 100 us of the
recording, and the 95th percentile within 5 % or 100 us. Of the paths whose busiest executor needs
less than 70 % of the time of its threads, 95 % have to be, of those with 70 to 90 %, 85 %.

With `--changes N`, the first N systems are simulated with a change of each kind, too: the truth is
the mean of both systems over several seeds, with the same random numbers. A size that is said is
right within 20 % or 1 ms, and two standard errors. 95 % of them have to be, and 98 % of the signs
where the truth is above 1 ms and two standard errors. The exit code is 1 if any is not.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from random import Random
from statistics import mean, stdev

import pyarrow.parquet as pq
from robot.replayed import CHANGES, KINDS, changes_of, replayed

import msgflow
from msgflow.ingest import ingest
from msgflow.replay.predict import MOST_LOAD, Change, Prediction, Spread, is_near, predict
from msgflow.run.slice import Slice
from msgflow_sim import Scenario, simulate

_BUSY = 0.7
_REPRODUCED, _REPRODUCED_BUSY, _RIGHT, _SIGN, _SAID = 0.95, 0.85, 0.95, 0.98, 0.75
_SHARE, _NS = 0.2, 1_000_000
# A path as the truth names it: topics and the node at the end.
Path_ = tuple[tuple[str, ...], str]


@dataclass(frozen=True)
class Effect:
    """What a change does to a statistic of a path [ns]; `error`: standard error of the truth."""

    kind: str
    what: str
    truth: float
    error: float
    predicted: tuple[float, ...]
    load: float
    doubt: str | None

    @property
    def is_right(self) -> bool:
        """Whether the first prediction is as near as it has to be."""
        return abs(self.predicted[0] - self.truth) <= (
            max(_SHARE * abs(self.truth), _NS) + 2 * self.error
        )

    @property
    def is_real(self) -> bool:
        """Whether the truth is more than noise."""
        return abs(self.truth) > max(_NS, 2 * self.error)


@dataclass(frozen=True)
class Judged:
    """What was asked of a system."""

    name: str
    kind: str
    paths: tuple[Prediction, ...]
    effects: tuple[Effect, ...]
    seconds: float


def judge(number: int, seeds: int) -> Judged:
    """Replay a system as it was, and with changes if there are `seeds` to know the truth by."""
    scenario = replayed(number)
    changes = [*changes_of(scenario, Random(number))] if seeds else []
    with tempfile.TemporaryDirectory() as folder:
        trace, database = Path(folder) / "trace", Path(folder) / "run.duckdb"
        simulate(scenario, trace)
        ingest([str(trace)], database)
        with msgflow.open_db(database) as opened:
            connection = opened.connection
            run = Slice().one_run(connection, "a replay")
            begun = time.process_time()
            paths = predict(connection, run)
            seconds = time.process_time() - begun
            predicted = [predict(connection, run, [change]) for change, _ in changes]
    effects: list[Effect] = []
    before = _truths(scenario, seeds) if changes else []
    for (change, other), found in zip(changes, predicted, strict=True):
        effects += _effects(change, before, _truths(other, seeds), found)
    return Judged(scenario.name, KINDS[number % 3], tuple(paths), tuple(effects), seconds)


def _truths(scenario: Scenario, seeds: int) -> list[dict[Path_, Spread]]:
    """Median and 95th percentile of each path, for each seed."""
    truths = []
    for seed in range(1, seeds + 1):
        with tempfile.TemporaryDirectory() as folder:
            simulation = simulate(scenario, Path(folder) / "trace", seed=seed)
            rows = pq.read_table(simulation.truth["end_to_end"]).to_pylist()
        first: dict[tuple[Path_, int], int] = {}
        for row in rows:
            key = (tuple(row["path"]), row["sink_node"]), row["root_callback_instance_id"]
            first[key] = min(row["latency_ns"], first.get(key, row["latency_ns"]))
        latencies = defaultdict(list)
        for (path, _), latency in first.items():
            latencies[path].append(latency)
        truths.append({path: _spread(sorted(each)) for path, each in latencies.items()})
    return truths


def _spread(ordered: Sequence[int]) -> Spread:
    count = len(ordered)
    return Spread(ordered[(count - 1) // 2], ordered[(count * 95 + 99) // 100 - 1], count)


def _effects(
    change: Change,
    before: Sequence[dict[Path_, Spread]],
    after: Sequence[dict[Path_, Spread]],
    found: Sequence[Prediction],
) -> list[Effect]:
    effects = []
    for each in found:
        steps = each.path.split(" → ")
        path = tuple(steps[1::2]), steps[-1]
        pairs = [
            (one[path], other[path])
            for one, other in zip(before, after, strict=True)
            if path in one and path in other
        ]
        if len(pairs) < len(before) or not each.predicted or each.replayed is None:
            continue
        for what in ("median", "p95"):
            gains = [getattr(other, what) - getattr(one, what) for one, other in pairs]
            effects.append(
                Effect(
                    change.kind,
                    f"{what} of {each.path} by {change.kind} {change.place} {change.value:g}",
                    mean(gains),
                    stdev(gains) / len(gains) ** 0.5,
                    tuple(
                        getattr(said, what) - getattr(each.replayed, what)
                        for said in each.predicted
                    ),
                    each.load,
                    each.doubt,
                )
            )
    return effects


def main(arguments: Sequence[str] | None = None) -> int:
    """Judge systems, print tables; return the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--systems", type=int, default=60)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--changes", type=int, default=0)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--verbose", action="store_true", help="every path that is wrong")
    given = parser.parse_args(arguments)
    numbers = range(given.first, given.first + given.systems)
    seeds = [given.seeds if number - given.first < given.changes else 0 for number in numbers]
    with ProcessPoolExecutor(given.jobs) as pool:
        judged = []
        for each in pool.map(judge, numbers, seeds):
            judged.append(each)
            _print_one(each, given.verbose)
    is_good = _print_unchanged(judged)
    if given.changes:
        is_good &= _print_changed(judged)
    return 0 if is_good else 1


def _print_one(judged: Judged, verbose: bool) -> None:
    near = sum(is_near(each.recorded, each.replayed) for each in judged.paths)
    print(
        f"{judged.name:14} {judged.kind:7} {near:4} of {len(judged.paths):4} paths reproduced"
        f" {judged.seconds:6.2f} s",
        flush=True,
    )
    if not verbose:
        return
    for path in judged.paths:
        if not is_near(path.recorded, path.replayed):
            print(f"    load {path.load:.2f} {path.path}: {path.recorded} {path.replayed}")
    for effect in judged.effects:
        if effect.doubt is None and not effect.is_right:
            print(
                f"    {effect.what}: truth {effect.truth / 1e6:.2f} ± {effect.error / 1e6:.2f} ms,"
                f" predicted {[round(each / 1e6, 2) for each in effect.predicted]}"
            )


def _print_unchanged(judged: Sequence[Judged]) -> bool:
    count: Counter[tuple[str, str]] = Counter()
    near: Counter[tuple[str, str]] = Counter()
    for system in judged:
        for path in system.paths:
            if path.recorded is None:
                continue
            band = "above"
            if path.load < MOST_LOAD:
                band = "below 0.7" if path.load < _BUSY else "0.7 to 0.9"
            for kind in (system.kind, "all"):
                count[kind, band] += 1
                near[kind, band] += is_near(path.recorded, path.replayed)
    print("\nreplay without a change, by the load of the busiest executor of the path")
    is_good = True
    for band, least in (("below 0.7", _REPRODUCED), ("0.7 to 0.9", _REPRODUCED_BUSY), ("above", 0)):
        for kind in (*KINDS, "all"):
            total = count[kind, band]
            share = near[kind, band] / total if total else 1.0
            print(f"{band:12} {kind:8} {near[kind, band]:5} of {total:5} {100 * share:6.1f} %")
            is_good &= kind != "all" or share >= least
    return is_good


def _print_changed(judged: Sequence[Judged]) -> bool:
    print("\nchanges: paths and statistics below a load of 0.9")
    is_good = True
    every = [effect for system in judged for effect in system.effects if effect.load < MOST_LOAD]
    for kind in (*CHANGES, "all"):
        effects = [each for each in every if kind in {each.kind, "all"}]
        said = [each for each in effects if each.doubt is None]
        real = [each for each in said if each.is_real]
        right = sum(each.is_right for each in said)
        right_real = sum(each.is_right for each in real)
        signs = sum(each.predicted[0] * each.truth > 0 for each in real)
        print(
            f"{kind:10} said {len(said):5} of {len(effects):5}, right {right:5},"
            f" real effects {len(real):4}: right {right_real:4}, sign {signs:4}"
        )
        if kind == "all":
            is_good &= len(said) >= _SAID * len(effects) and right >= _RIGHT * len(said)
            is_good &= signs >= _SIGN * len(real)
    return is_good


if __name__ == "__main__":
    sys.exit(main())
