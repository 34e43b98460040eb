"""What a change would gain: a recorded system is replayed as it was, and changed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.replay.engine import Replay
from msgflow.replay.recorded import (
    NODE_GROUPS,
    OWN_GROUPS,
    may_be_in_order,
    read_tables,
    recorded_system,
)
from msgflow.text.name_suggestions import did_you_mean

if TYPE_CHECKING:
    import duckdb

    from msgflow.replay.system import Callback, Executor, System
    from msgflow.run.choice import Run

# An executor with less to spare than that never forgets the state in which it began.
MOST_LOAD = 0.9
# How far a replay may be from the recording: a share of it, or ns.
_NEAR_MEDIAN, _NEAR_P95, _NEAR_NS = 0.02, 0.05, 100_000


@dataclass(frozen=True)
class Change:
    """Something that is changed.

    Attributes:
        kind: 'executor' (of its own, `value` threads), 'threads' (of its executor), 'duration' (so
            many times as long), 'depth' (of its queue), 'period' or 'phase' (of its timer, ns).
        place: full name of a node; with a space and a label behind it, one of its callbacks; or a
            topic, whose subscriptions are meant.
        value: the new value.
    """

    kind: str
    place: str
    value: float


@dataclass(frozen=True)
class Spread:
    """Median and 95th percentile of the latencies of a path [ns]; `flows`: of so many."""

    median: int
    p95: int
    flows: int


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
    """

    path: str
    recorded: Spread | None
    replayed: Spread | None
    predicted: tuple[Spread, ...]
    load: float
    doubt: str | None


@dataclass(frozen=True)
class _Way:
    """What a recording does not tell; see `recorded_system`."""

    groups: str
    forgets: bool
    is_in_order: bool


def predict(
    connection: duckdb.DuckDBPyConnection, run: Run, changes: Sequence[Change] = ()
) -> list[Prediction]:
    """Replay a run as it was and with changes; return what that does to each path."""
    tables = read_tables(connection, run)
    end = run.end_ns or 0
    executors = tables["replay_executor"]
    has_teams = any(row["threads"] > 1 for row in executors)
    ways = [
        _Way(groups, forgets, is_in_order)
        for is_in_order in ((True, False) if any(map(may_be_in_order, executors)) else (False,))
        for forgets in ((False, True) if has_teams else (False,))
        # Where one thread runs callbacks, only a change may need their groups.
        for groups in ((NODE_GROUPS, OWN_GROUPS) if has_teams or changes else (NODE_GROUPS,))
    ]
    systems = {
        way: recorded_system(
            tables, end, way.groups, forgets=way.forgets, is_in_order=way.is_in_order
        )
        for way in ways
    }
    replayed = {way: _spreads(Replay(system).latencies()) for way, system in systems.items()}
    system = systems[ways[0]]
    recorded = _spreads(system.recorded)

    def near(way: _Way) -> int:
        return sum(is_near(each, replayed[way].get(path)) for path, each in recorded.items())

    best = max(ways, key=near)
    kept = [way for way in ways if replace(way, groups=best.groups) == best]
    predicted = {
        way: _spreads(Replay(changed(systems[way], changes)).latencies())
        if changes
        else replayed[way]
        for way in sorted(kept, key=lambda way: way != best)
    }
    system = systems[best]
    result = []
    for path, name in system.names.items():
        load = max((system.executors[key].load for key in system.executors_of[path]), default=0.0)
        was, again = recorded.get(path), replayed[best].get(path)
        doubt = None
        if was is None:
            doubt = "no flow arrives"
        elif load > MOST_LOAD:
            doubt = f"an executor is busy {100 * load:.0f} % of the time"
        elif not is_near(was, again):
            doubt = "the replay without a change differs from the recording"
        found = dict.fromkeys(
            spreads.get(path)
            for way, spreads in predicted.items()
            if way == best or is_near(was, replayed[way].get(path))
        )
        result.append(
            Prediction(
                name,
                was,
                again,
                tuple(each for each in found if each is not None),
                load,
                doubt,
            )
        )
    return result


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


def changed(system: System, changes: Iterable[Change]) -> System:
    """Return a system with changes; UsageError: it has not what is to be changed."""
    callbacks = {key: replace(each) for key, each in system.callbacks.items()}
    executors = dict(system.executors)
    for change in changes:
        if change.kind not in _CHANGES:
            hint = did_you_mean(change.kind, [*_CHANGES], f"choose {' or '.join(_CHANGES)}")
            raise UsageError(f"nothing of that kind can be changed — {change.kind}", hint)
        least = 0 if change.kind in ("duration", "phase") else 1
        if change.value < least or not change.value:
            raise UsageError(f"it is too little — {change.kind} {change.value:g}")
        chosen = [each for each in callbacks.values() if change.place in _names(each, change.kind)]
        if not chosen:
            known = {name for each in callbacks.values() for name in _names(each, change.kind)}
            raise UsageError(
                f"nothing of that name has a {change.kind} — {change.place}",
                did_you_mean(change.place, sorted(known), "msgflow query callbacks lists them"),
            )
        _CHANGES[change.kind](chosen, executors, change.value)
    return replace(system, callbacks=callbacks, executors=executors)


def _names(callback: Callback, kind: str) -> Iterator[str]:
    """By which names a callback can be changed."""
    if kind in {"period", "phase"} and callback.period is None:
        return
    if kind == "depth" and callback.subscription is None:
        return
    yield callback.node
    yield f"{callback.node} {callback.label}"
    if callback.subscription is not None:
        yield callback.label.removeprefix("Subscription(").removesuffix(")")


def _own_executor(chosen: list[Callback], executors: dict[int, Executor], value: float) -> None:
    number = max(executors) + 1
    executors[number] = replace(executors[chosen[0].executor], threads=int(value))
    for callback in chosen:
        callback.executor = number


def _threads(chosen: list[Callback], executors: dict[int, Executor], value: float) -> None:
    for number in {callback.executor for callback in chosen}:
        executors[number] = replace(executors[number], threads=int(value))


def _duration(chosen: list[Callback], executors: dict[int, Executor], value: float) -> None:
    for callback in chosen:
        callback.factor *= value


def _depth(chosen: list[Callback], executors: dict[int, Executor], value: float) -> None:
    for callback in chosen:
        callback.depth = int(value)


def _period(chosen: list[Callback], executors: dict[int, Executor], value: float) -> None:
    for callback in chosen:
        callback.origin += int(value) - (callback.period or 0)
        callback.period, callback.is_retimed = int(value), True


def _phase(chosen: list[Callback], executors: dict[int, Executor], value: float) -> None:
    for callback in chosen:
        callback.origin, callback.is_retimed = callback.origin + int(value), True


_CHANGES: Mapping[str, Callable[[list[Callback], dict[int, Executor], float], None]] = {
    "executor": _own_executor,
    "threads": _threads,
    "duration": _duration,
    "depth": _depth,
    "period": _period,
    "phase": _phase,
}


def _spreads(latencies: Mapping[int, Sequence[int]]) -> dict[int, Spread]:
    """Return median and 95th percentile by path, as quantile_disc has them."""
    spreads = {}
    for path, each in latencies.items():
        ordered = sorted(each)
        median, p95 = (ordered[max(0, -(-len(ordered) * share // 100) - 1)] for share in (50, 95))
        spreads[path] = Spread(median, p95, len(ordered))
    return spreads
