"""What a change would gain: a recorded system is replayed as it was, and changed."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from statistics import mean, stdev
from typing import TYPE_CHECKING

from msgflow.replay.change import Change, changed
from msgflow.replay.draw import Lottery
from msgflow.replay.engine import Replay
from msgflow.replay.recorded import (
    NODE_GROUPS,
    OWN_GROUPS,
    may_be_in_order,
    read_tables,
    recorded_system,
)

if TYPE_CHECKING:
    import duckdb

    from msgflow.replay.system import System
    from msgflow.run.choice import Run

    _Spreads = Mapping[int, "Spread"]

# An executor with less to spare than that never forgets the state in which it began.
MOST_LOAD = 0.9
# How far a replay may be from the recording: a share of it, or ns.
_NEAR_MEDIAN, _NEAR_P95, _NEAR_NS = 0.02, 0.05, 100_000
# Of a longer run, its middle is replayed.
_LONGEST_NS = 30_000_000_000
# So many further runs are drawn.
ROUNDS = 20
# 90 % of what is normally distributed is nearer to its mean than so many standard deviations.
_MARGIN = 1.645
# What a thread needs to go on differs by that; a replay always has the same.
_LEAST_NS = 10_000


@dataclass(frozen=True)
class Spread:
    """Median and 95th percentile of the latencies of a path [ns]; `flows`: of so many."""

    median: int
    p95: int
    flows: int


@dataclass(frozen=True)
class Gain:
    """By how much a statistic of a path is shorter than without the changes [ns].

    Attributes:
        size: the mean over what runs of the system may be like, without the best and the worst.
        low: nine of ten runs gain no less than this, and no more than `high`.
    """

    size: int
    low: int
    high: int


@dataclass(frozen=True)
class Prediction:
    """What is said of a path.

    Attributes:
        path: as `e2e-latency` names it.
        recorded: as recorded; None: no flow arrived. Likewise `replayed`, without any change.
        predicted: with the changes, for each way in which callbacks may exclude each other: one
            where that is known or makes no difference.
        load: share of the time of its threads that callbacks of the busiest executor of the path
            need.
        doubt: why no size can be said; None: it can.
        is_reached: whether a change can reach it: what happens on its executors, or before them.
        median: what its median gains; None: no size can be said. Likewise `p95`.
    """

    path: str
    recorded: Spread | None
    replayed: Spread | None
    predicted: tuple[Spread, ...]
    load: float
    doubt: str | None
    is_reached: bool = False
    median: Gain | None = None
    p95: Gain | None = None


@dataclass(frozen=True)
class _Way:
    """What a recording does not tell; see `recorded_system`."""

    groups: str
    forgets: bool
    is_in_order: bool


class Predictor:
    """Replays a run once as it was, and then with any changes.

    Attributes:
        system: the recorded system.
        window: from when until when the run is replayed, epoch ns; None: all of it.
    """

    def __init__(
        self, connection: duckdb.DuckDBPyConnection, run: Run, longest_ns: int = _LONGEST_NS
    ) -> None:
        begin, end = run.start_ns or 0, run.end_ns or 0
        spare = (end - begin - longest_ns) // 2
        self.window = (begin + spare, end - spare) if spare > 0 else None
        window = self.window or (begin, end)
        tables = read_tables(connection, run, window)
        executors = tables["replay_executor"]
        has_teams = any(row["threads"] > 1 for row in executors)

        @cache
        def system(way: _Way) -> System:
            return recorded_system(
                tables, window, way.groups, forgets=way.forgets, is_in_order=way.is_in_order
            )

        self._system = system
        # Where one thread runs callbacks, only a change may need their groups.
        ways = [
            _Way(groups, forgets, is_in_order)
            for is_in_order in ((True, False) if any(map(may_be_in_order, executors)) else (False,))
            for forgets in ((False, True) if has_teams else (False,))
            for groups in ((NODE_GROUPS, OWN_GROUPS) if has_teams else (NODE_GROUPS,))
        ]
        self._replayed: dict[_Way, _Spreads] = {
            way: _spreads(Replay(system(way)).latencies()) for way in ways
        }
        self._recorded = _spreads(system(ways[0]).recorded)
        self._best = max(ways, key=self._near)
        self.system = system(self._best)
        self._lottery = cache(lambda way: Lottery(system(way)))
        self._drawn: dict[tuple[_Way, int], _Spreads] = {}

    def _near(self, way: _Way) -> int:
        """How many paths a way reproduces."""
        replayed = self._replayed[way]
        return sum(is_near(each, replayed.get(path)) for path, each in self._recorded.items())

    def predict(self, changes: Sequence[Change] = (), rounds: int = ROUNDS) -> list[Prediction]:
        """Return what changes do to each path.

        `rounds`: so many further runs are drawn, replayed with the changes and without them.
        """
        best = self._best
        ends = {best: changed(self.system, changes)}
        if changes and any(each.threads > 1 for each in ends[best].executors.values()):
            for groups in (NODE_GROUPS, OWN_GROUPS):
                way = replace(best, groups=groups)
                if way not in self._replayed:
                    self._replayed[way] = self._replayed[best]
                ends[way] = changed(self._system(way), changes)
        ways = [*ends]
        replays = {way: Replay(each) for way, each in ends.items()} if changes else {}
        predicted: dict[_Way, _Spreads] = {
            way: _spreads(each.latencies()) for way, each in replays.items()
        }
        predicted = predicted or {best: self._replayed[best]}
        loads: dict[int, float] = {}
        for replay in replays.values():
            for key, load in replay.loads().items():
                loads[key] = max(load, loads.get(key, 0.0))
        reached = _reached(self.system, ends[best]) if changes else frozenset()
        gains = self._gains(ways, changes, predicted, rounds) if changes else {}
        result = []
        for path, name in self.system.names.items():
            was, again = self._recorded.get(path), self._replayed[best].get(path)
            before, after = self.system.executors_of(path), ends[best].executors_of(path)
            load = max((self.system.executors[key].load for key in before), default=0.0)
            later = max((loads.get(key, 0.0) for key in after & reached), default=0.0)
            known = [
                way for way in ways if way == best or is_near(was, self._replayed[way].get(path))
            ]
            is_reached = not reached.isdisjoint(before | after)
            sizes: tuple[Gain, Gain] | None = (Gain(0, 0, 0), Gain(0, 0, 0))
            if is_reached:
                sizes = _united([gains[way].get(path) for way in known])
            doubt = None
            if was is None:
                doubt = "no flow arrives"
            elif load > MOST_LOAD:
                doubt = f"an executor is busy {100 * load:.0f} % of the time"
            elif not self._reproduces(path, rounds):
                doubt = "the replay without a change differs from the recording"
            elif is_reached and later > max(MOST_LOAD, load):
                doubt = f"with the change an executor is busy {100 * later:.0f} % of the time"
            elif sizes is None:
                doubt = "no flow arrives with the change"
            found = dict.fromkeys(predicted[way].get(path) for way in known if way in predicted)
            median, p95 = sizes if sizes and doubt is None and changes else (None, None)
            result.append(
                Prediction(
                    name,
                    was,
                    again,
                    tuple(each for each in found if each is not None),
                    load,
                    doubt,
                    is_reached,
                    median,
                    p95,
                )
            )
        return result

    def _gains(
        self,
        ways: Sequence[_Way],
        changes: Sequence[Change],
        predicted: Mapping[_Way, _Spreads],
        rounds: int,
    ) -> dict[_Way, dict[int, tuple[Gain, Gain]]]:
        """Return by way and path what median and 95th percentile gain."""
        gains: dict[_Way, dict[int, tuple[Gain, Gain]]] = {}
        for way in ways:
            pairs = [(self._replayed[way], predicted[way])]
            if rounds and gains and pairs == [(self._replayed[ways[0]], predicted[ways[0]])]:
                # They do not differ.
                gains[way] = gains[ways[0]]
                continue
            if rounds:
                pairs = [self._round(way, changes, seed) for seed in range(rounds)]
            each = gains[way] = {}
            for path in self.system.names:
                found = [
                    (before[path], after[path])
                    for before, after in pairs
                    if path in before and path in after
                ]
                if found:
                    each[path] = (
                        gain_of([one.median - other.median for one, other in found]),
                        gain_of([one.p95 - other.p95 for one, other in found]),
                    )
        return gains

    def _round(self, way: _Way, changes: Sequence[Change], seed: int) -> tuple[_Spreads, _Spreads]:
        """Replay a drawn run without changes and with them."""
        system = changed(self._lottery(way).draw(seed), changes)
        return self._unchanged(way, seed), _spreads(Replay(system).latencies())

    def _unchanged(self, way: _Way, seed: int) -> _Spreads:
        """Replay a drawn run without changes."""
        if (way, seed) not in self._drawn:
            system = self._lottery(way).draw(seed)
            self._drawn[way, seed] = _spreads(Replay(system).latencies())
        return self._drawn[way, seed]

    def _reproduces(self, path: int, rounds: int) -> bool:
        """Whether the recording of a path is as its replay, or as one of the drawn runs may be."""
        was = self._recorded[path]
        if is_near(was, self._replayed[self._best].get(path)):
            return True
        runs = [self._unchanged(self._best, seed) for seed in range(rounds)]
        found = [each[path] for each in runs if path in each]
        if len(found) <= rounds // 2 + 1:
            return False
        return all(
            abs(one - mean(others)) <= _MARGIN * stdev(others)
            for one, others in (
                (was.median, [each.median for each in found]),
                (was.p95, [each.p95 for each in found]),
            )
        )


def gain_of(gains: Sequence[int]) -> Gain:
    """Return what is said where drawn runs have these gains."""
    # One drawn run alone does not move it.
    size = mean(sorted(gains)[1:-1] or gains)
    margin = max(_MARGIN * stdev(gains), _LEAST_NS) if len(gains) > 1 else 0
    return Gain(round(size), round(size - margin), round(size + margin))


def _united(gains: Sequence[tuple[Gain, Gain] | None]) -> tuple[Gain, Gain] | None:
    """What is said where several ways are possible: the sizes of the first, and all bounds."""
    every = [each for each in gains if each is not None]
    if not every or gains[0] is None:
        return None
    median, p95 = (
        Gain(each[0].size, min(one.low for one in each), max(one.high for one in each))
        for each in zip(*every, strict=True)
    )
    return median, p95


def _reached(system: System, other: System) -> frozenset[int]:
    """The executors that a change can reach: of what is changed, and of what hears of that."""
    listeners: dict[int, set[int]] = defaultdict(set)
    reached = {key for key, each in other.executors.items() if system.executors.get(key) != each}
    # Of what is published outside of callbacks, those that hear it at other times.
    for (_, before), (_, after) in zip(system.outside, other.outside, strict=False):
        if before != after:
            heard = other.callbacks.keys() & after.delays.keys()
            reached |= {other.callbacks[key].executor for key in heard}
    for one in (system, other):
        for key, each in one.callbacks.items():
            twin = other.callbacks.get(key) if one is system else system.callbacks.get(key)
            if each != twin:
                reached.add(each.executor)
            for instance in each.instances.values():
                for sent in instance.sent:
                    listeners[each.executor].update(
                        one.callbacks[heard].executor
                        for heard in sent.delays
                        if heard in one.callbacks
                    )
    left = [*reached]
    while left:
        following = listeners[left.pop()] - reached
        reached |= following
        left += following
    return frozenset(reached)


def is_near(recorded: Spread | None, replayed: Spread | None) -> bool:
    """Whether a replay gives what was recorded."""
    if recorded is None or replayed is None:
        return recorded is replayed
    return all(
        abs(one - other) <= max(share * one, _NEAR_NS)
        for one, other, share in (
            (recorded.median, replayed.median, _NEAR_MEDIAN),
            (recorded.p95, replayed.p95, _NEAR_P95),
        )
    )


def _spreads(latencies: Mapping[int, Sequence[int]]) -> dict[int, Spread]:
    """Return median and 95th percentile by path, as quantile_disc has them."""
    spreads = {}
    for path, each in latencies.items():
        ordered = sorted(each)
        median, p95 = (ordered[max(0, -(-len(ordered) * share // 100) - 1)] for share in (50, 95))
        spreads[path] = Spread(median, p95, len(ordered))
    return spreads
