"""Whether a replay gives what was recorded, and predicts what a change does.

    python benchmarks/replay.py [--systems 60] [--first 0] [--changes 0] [--seeds 10] [--jobs N]
                                [--verbose]

Systems of the simulator of four to forty nodes (`robot/replayed.py`): single-threaded,
multi-threaded and events executors of Humble and Rolling, and rclpy as `msgflow record` traces it.

A path is reproduced if the median of the replay without a change is within 2 % or 100 us of the
recording, and the 95th percentile within 5 % or 100 us. Of the paths whose busiest executor needs
less than 70 % of the time of its threads, 95 % have to be, of those with 70 to 90 %, 85 %.

With `--changes N`, the first N systems are simulated with changes of each kind, too: the truth is
the mean of both systems over several seeds, with the same random numbers. A size that is said is
right within 20 % or 1 ms, and two standard errors. 95 % of them have to be, and 98 % of the signs
where the truth is above 1 ms and two standard errors. A size is to be said for 75 % of the paths
below a load of 0.9; intervals are to hold the truth in 85 to 95 %. What a change cannot reach is
counted apart. The exit code is 1 if any is not.
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
from itertools import combinations
from pathlib import Path
from random import Random
from resource import RUSAGE_SELF, getrusage
from statistics import mean, stdev
from typing import TYPE_CHECKING

import pyarrow.parquet as pq
from robot.replayed import CHANGES, KINDS, changes_of, replayed

import msgflow
from msgflow.ingest import ingest
from msgflow.replay.predict import (
    MOST_LOAD,
    ROUNDS,
    Gain,
    Prediction,
    Predictor,
    Spread,
    is_near,
)
from msgflow.run.slice import Slice
from msgflow_sim import Scenario, simulate

if TYPE_CHECKING:
    from msgflow.replay.change import Change

_BUSY = 0.7
_REPRODUCED, _REPRODUCED_BUSY, _RIGHT, _SIGN, _SAID = 0.95, 0.85, 0.95, 0.98, 0.75
_ORDER, _HELD = 0.9, (0.85, 0.95)
_SHARE, _NS = 0.2, 1_000_000
# A path as the truth names it: topics and the node at the end.
Path_ = tuple[tuple[str, ...], str]


@dataclass(frozen=True)
class Effect:
    """By how much a change makes a statistic of a path shorter [ns].

    Attributes:
        error: standard error of the truth.
        gain: what is said; None: nothing is.
        has_bounds: callback groups make a difference.
    """

    kind: str
    change: str
    path: str
    statistic: str
    truth: float
    error: float
    gain: Gain | None
    load: float
    doubt: str | None
    is_reached: bool
    has_bounds: bool

    @property
    def is_right(self) -> bool:
        """Whether the size is as near as it has to be."""
        assert self.gain is not None
        return abs(self.gain.size - self.truth) <= (
            max(_SHARE * abs(self.truth), _NS) + 2 * self.error
        )

    @property
    def is_held(self) -> bool:
        """Whether the interval holds the truth."""
        assert self.gain is not None
        return self.gain.low <= self.truth <= self.gain.high

    @property
    def is_real(self) -> bool:
        """Whether the truth is more than noise."""
        return abs(self.truth) > max(_NS, 2 * self.error)


@dataclass(frozen=True)
class Judged:
    """What was asked of a system.

    Attributes:
        seconds: CPU time of reading it and replaying it once; `hundred`: of a hundred replays.
        megabytes: the most that the process has had.
    """

    name: str
    kind: str
    paths: tuple[Prediction, ...]
    effects: tuple[Effect, ...]
    seconds: float
    nodes: int
    hundred: float
    megabytes: int


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
            predictor = Predictor(connection, run)
            paths = predictor.predict()
            seconds = time.process_time() - begun
            begun = time.process_time()
            predicted = [predictor.predict([change]) for change, _ in changes]
            # Each drawn run is replayed once without changes.
            replays = ROUNDS + (ROUNDS + 1) * len(changes)
            hundred = (time.process_time() - begun) * 100 / replays
    megabytes = getrusage(RUSAGE_SELF).ru_maxrss // 1024
    effects: list[Effect] = []
    before = _truths(scenario, seeds) if changes else []
    for (change, other), found in zip(changes, predicted, strict=True):
        effects += _effects(change, before, _truths(other, seeds), found)
    return Judged(
        scenario.name,
        KINDS[number % len(KINDS)],
        tuple(paths),
        tuple(effects),
        seconds,
        sum(len(process.nodes) for process in scenario.processes),
        hundred,
        megabytes,
    )


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
        if len(pairs) < len(before):
            continue
        for statistic in ("median", "p95"):
            gains = [getattr(one, statistic) - getattr(other, statistic) for one, other in pairs]
            effects.append(
                Effect(
                    change.kind,
                    str(change),
                    each.path,
                    statistic,
                    mean(gains),
                    stdev(gains) / len(gains) ** 0.5,
                    getattr(each, statistic),
                    each.load,
                    each.doubt,
                    each.is_reached,
                    len(each.predicted) > 1,
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
        if effect.gain is not None and not effect.is_right:
            low, size, high = (
                f"{each / 1e6:.2f}"
                for each in (effect.gain.low, effect.gain.size, effect.gain.high)
            )
            print(
                f"    {effect.change}: {effect.statistic} of {effect.path} gains"
                f" {effect.truth / 1e6:.2f} ± {effect.error / 1e6:.2f} ms, said {size}"
                f" ({low} to {high})"
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
    print("\nchanges: paths and statistics below a load of 0.9 that a change reaches")
    is_good = True
    low = [each for system in judged for each in system.effects if each.load < MOST_LOAD]
    every = [each for each in low if each.is_reached]
    for kind in (*CHANGES, "all"):
        effects = [each for each in every if kind in {each.kind, "all"}]
        said = [each for each in effects if each.gain is not None]
        real = [each for each in said if each.is_real]
        right = sum(each.is_right for each in said)
        held = sum(each.is_held for each in said)
        signs = sum(each.gain is not None and each.gain.size * each.truth > 0 for each in real)
        print(
            f"{kind:8} said {_share(len(said), len(effects))}, right {_share(right, len(said))},"
            f" real effects: right {_share(sum(each.is_right for each in real), len(real))},"
            f" sign {_share(signs, len(real))}, intervals hold {_share(held, len(said))}"
        )
        if kind == "all":
            is_good &= len(said) >= _SAID * len(effects) and right >= _RIGHT * len(said)
            is_good &= signs >= _SIGN * len(real)
            is_good &= _HELD[0] * len(said) <= held <= _HELD[1] * len(said)
    apart = [each for each in low if not each.is_reached]
    still = sum(abs(each.truth) <= 2 * each.error for each in apart)
    print(f"beyond reach: the truth is 0 for {_share(still, len(apart))}")
    bounded = [each for each in every if each.has_bounds and each.gain is not None]
    print(
        f"groups unknown: within the bounds {_share(sum(e.is_held for e in bounded), len(bounded))}"
    )
    right, pairs = _order(judged)
    largest = max(judged, key=lambda each: each.nodes if each.effects else 0)
    print(
        f"a hundred replays of {largest.nodes} nodes: {largest.hundred:.1f} s of CPU,"
        f" {largest.megabytes} MB"
    )
    print(f"order of the three best: {_share(right, pairs)} pairs")
    return is_good and right >= _ORDER * pairs


def _order(judged: Sequence[Judged]) -> tuple[int, int]:
    """Of the three best changes of each path, how many pairs whose truths differ are in order."""
    right = pairs = 0
    for system in judged:
        by_path: dict[tuple[str, str], list[tuple[int, float]]] = defaultdict(list)
        for each in system.effects:
            if each.gain is not None and each.is_reached and each.load < MOST_LOAD:
                by_path[each.path, each.statistic].append((each.gain.size, each.truth))
        for found in by_path.values():
            best = sorted(found, reverse=True)[:3]
            for (_, better), (_, worse) in combinations(best, 2):
                if abs(better - worse) > max(_SHARE * abs(better), _SHARE * abs(worse), _NS):
                    pairs += 1
                    right += better > worse
    return right, pairs


def _share(some: int, every: int) -> str:
    return f"{some:5} of {every:5} ({100 * some / max(1, every):5.1f} %)"


if __name__ == "__main__":
    sys.exit(main())
