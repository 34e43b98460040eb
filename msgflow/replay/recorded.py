"""A recorded system as tables have it: what its callbacks did, and what they waited for."""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from statistics import median, median_low
from typing import TYPE_CHECKING, Any

from msgflow.replay.system import (
    EVENTS,
    Callback,
    Executor,
    Instance,
    Link,
    Sent,
    System,
)
from msgflow.sql.statement import internal_sql
from msgflow.text.values import short_symbol

if TYPE_CHECKING:
    import duckdb

    from msgflow.run.choice import Run

Row = Mapping[str, Any]

# Executors look for timers first, then for messages, then for the rest.
_KINDS = {"timer": 0, "subscription": 1, "service": 2}
# How callbacks exclude each other where the recording does not name groups.
NODE_GROUPS, OWN_GROUPS = "node", "callback"
_INSTANCE = "replay_instance"
# To look in vain takes some time, else threads would look without end.
_LOOK_NS = 1_000
# A wait that lasts so many times as long as usual did not find anything when it began.
_MANY = 4
_ROWS = (
    "replay_executor",
    "replay_callback",
    "replay_order",
    "replay_publication",
    "replay_delivery",
    "replay_annotation",
    "replay_path",
    "fleet_flow",
)


def read_tables(
    connection: duckdb.DuckDBPyConnection, run: Run, window: tuple[int, int]
) -> dict[str, list[dict[str, Any]]]:
    """Return the rows that a replay is made of, by the names of the statements.

    `window`: only what began, or was published, from a time on and until another one.
    """
    values = {
        "run_id": run.run_id,
        "runs": [run.run_id],
        "begin_ns": window[0],
        "until_ns": window[1],
        "from": None,
        "to": None,
        "skip_first": 0,
        "max_depth": 32,
        "max_paths": 1000,
    }
    sql = internal_sql()
    sql.keep(connection, _INSTANCE, values)
    try:
        tables = {name: [*sql.rows(connection, name, values)] for name in _ROWS}
        found = connection.sql(f"FROM temp.{_INSTANCE} ORDER BY start_ns, callback_instance_id")
        return tables | {_INSTANCE: found.to_arrow_table().to_pylist()}
    finally:
        connection.execute(f"DROP TABLE temp.{_INSTANCE}")


def recorded_system(
    tables: Mapping[str, Sequence[dict[str, Any]]],
    window: tuple[int, int],
    groups: str = NODE_GROUPS,
    *,
    forgets: bool = False,
    is_in_order: bool = False,
) -> System:
    """Return the system that tables describe.

    `groups` says how callbacks of a node exclude each other where nothing else does: all of them,
    or each only itself. `forgets` is that of executors of several threads. `is_in_order` says that
    those of rclcpp without events of their own are events executors.
    """
    begin, end = window
    instances = tables[_INSTANCE]
    executors = {row["executor_id"]: row for row in tables["replay_executor"]}
    callbacks = _callbacks(tables, groups)
    _estimate(instances, callbacks)
    timed = _timers(instances, callbacks)
    python = {row["executor_id"] for row in tables["replay_callback"] if row["is_python"]}
    system_executors = _executors(
        instances, executors, timed, python, forgets=forgets, is_in_order=is_in_order
    )
    made = _instances(instances, callbacks, system_executors, timed)
    outside = _messages(tables, instances, callbacks, system_executors, timed, made)
    paths = tables["replay_path"]
    names = {row["alike_id"]: row["path"] for row in paths if row["is_path"]}
    recorded: dict[int, list[int]] = defaultdict(list)
    numbers = {name: number for number, name in names.items()}
    for row in tables["fleet_flow"]:
        is_within = begin <= row["root_ns"] and (row["sink_ns"] or end) <= end
        if row["is_first"] and row["latency_ns"] is not None and is_within:
            recorded[numbers[row["path"]]].append(row["latency_ns"])
    return System(
        system_executors,
        callbacks,
        outside,
        [
            Link(row["kind"], frozenset(row["inputs"] or ()), frozenset(row["outputs"] or ()))
            for row in tables["replay_annotation"]
        ],
        {
            (row["parent_path_id"], row["publisher_id"], row["subscription_id"]): row["path_id"]
            for row in paths
        },
        {row["path_id"]: row["alike_id"] for row in paths if row["is_path"]},
        names,
        _passed(paths, callbacks),
        recorded,
        end,
    )


def _callbacks(tables: Mapping[str, Sequence[Row]], groups: str) -> dict[int, Callback]:
    rows = tables["replay_callback"]
    ranks = _ranks(rows, tables["replay_order"])
    nodes = {row["callback_id"]: row["node"] for row in rows}
    apart = _seen_together(tables[_INSTANCE], nodes)
    callbacks = {}
    for row in rows:
        number = row["callback_id"]
        group: object = number if groups == OWN_GROUPS or number in apart else row["node"]
        if (number, number) in apart or row["is_reentrant"]:
            group = None
        elif row["callback_group_id"] is not None:
            group = (row["callback_group_id"],)
        callbacks[number] = Callback(
            number,
            row["kind"],
            row["node"],
            row["label"],
            row["executor_id"],
            row["subscription_id"],
            row["queue_depth"],
            group,
            (row["period_ns"] or None) if row["created_ns"] is not None else None,
            (row["created_ns"] or 0) + (row["period_ns"] or 0),
            rank=ranks[number],
            symbol=None if row["symbol"] is None else short_symbol(row["symbol"]),
        )
    return callbacks


def _seen_together(instances: Iterable[Row], nodes: Mapping[int, str]) -> set[object]:
    """Callbacks that ran beside others of their node; in pairs those that did beside themselves."""
    apart: set[object] = set()
    running: dict[int, dict[int, tuple[int, int]]] = defaultdict(dict)
    for row in instances:
        others = running[row["executor_id"]]
        for thread, (callback, end) in others.items():
            is_beside = thread != row["thread_id"] and end > row["start_ns"]
            if is_beside and nodes[callback] == nodes[row["callback_id"]]:
                apart |= {callback, row["callback_id"]}
                if callback == row["callback_id"]:
                    apart.add((callback, callback))
        others[row["thread_id"]] = (row["callback_id"], row["end_ns"])
    return apart


def _ranks(rows: Sequence[Row], pairs: Iterable[Row]) -> dict[int, tuple[int, int, int]]:
    """Place of each callback in the order in which executors look: who came first of two tells.

    rclpy goes node by node, rclcpp kind by kind. What was never ready at once is in the order of
    creation.
    """
    units = {
        row["callback_id"]: (row["executor_id"], row["node"] if row["is_python"] else number)
        for number, row in enumerate(rows)
    }
    kinds = {row["callback_id"]: _KINDS.get(row["kind"], len(_KINDS)) for row in rows}
    python = {row["callback_id"] for row in rows if row["is_python"]}
    wins: dict[tuple[object, object], int] = defaultdict(int)
    for row in pairs:
        first, second = row["first_id"], row["second_id"]
        if kinds[first] == kinds[second] or first in python:
            wins[units[first], units[second]] += row["rounds"]
            wins[units[second], units[first]] -= row["rounds"]
    before: dict[object, set[object]] = defaultdict(set)
    for (one, other), number in wins.items():
        if number > 0:
            before[other].add(one)
    places: dict[object, int] = {}
    left = dict.fromkeys(units.values())
    while left:
        # In a circle, the one with the fewest before it is next.
        following = min(left, key=lambda each: sum(other in left for other in before[each]))
        places[following] = len(places)
        del left[following]
    return {
        number: (0 if number in python else kinds[number], places[unit], kinds[number])
        for number, unit in units.items()
    }


def _estimate(instances: Sequence[dict[str, Any]], callbacks: Mapping[int, Callback]) -> None:
    """Where an executor has no events, say when its thread looked for work.

    That is as long before callbacks of a kind as elsewhere, or as where callbacks follow each other
    most closely.
    """
    known: dict[str, list[int]] = defaultdict(list)
    gaps: list[int] = []
    ended: dict[int, int] = {}
    for row in instances:
        if row["looked_ns"] is not None:
            kind = callbacks[row["callback_id"]].kind
            known[kind].append(row["start_ns"] - row["looked_ns"])
        elif row["thread_id"] in ended:
            gaps.append(row["start_ns"] - ended[row["thread_id"]])
        ended[row["thread_id"]] = row["end_ns"]
    usual = {kind: int(median(each)) for kind, each in known.items()}
    least = min(gaps, default=0)
    ended.clear()
    for row in instances:
        if row["looked_ns"] is None:
            looked = row["start_ns"] - usual.get(callbacks[row["callback_id"]].kind, least)
            row["looked_ns"] = max(looked, ended.get(row["thread_id"], looked))
        ended[row["thread_id"]] = row["end_ns"]


def _timers(
    instances: Iterable[Row], callbacks: Mapping[int, Callback]
) -> dict[int, tuple[int, int]]:
    """Return for each run of a timer how often it was due before, and when it was due.

    As rcl does it: when it is called, instants that have passed meanwhile are left out. It is due
    first before its first run.
    """
    timed = {}
    due: dict[int, int] = {}
    for row in instances:
        callback = callbacks[row["callback_id"]]
        period = callback.period
        if not period:
            continue
        seen = row["round_ns"] or row["looked_ns"]
        on_grid = callback.origin + (seen - callback.origin) // period * period
        if callback.number not in due:
            callback.origin = on_grid
        at = min(due.get(callback.number, on_grid), on_grid)
        timed[row["callback_instance_id"]] = (at - callback.origin) // period, at
        callback.until = at
        passed = max(0, row["looked_ns"] - at - 1) // period
        due[callback.number] = at + max(1, passed + 1) * period
    return timed


def _executors(
    instances: Iterable[Row],
    executors: Mapping[int, Row],
    timed: Mapping[int, tuple[int, int]],
    python: Collection[int],
    *,
    forgets: bool,
    is_in_order: bool,
) -> dict[int, Executor]:
    """Return the executors, with what a wait needs to end: timers show it, that are due in one."""
    wakings: dict[int, list[int]] = defaultdict(list)
    waits: dict[int, list[int]] = defaultdict(list)
    first: dict[int, int] = {}
    for row in instances:
        key = row["executor_id"]
        first.setdefault(key, row["looked_ns"])
        if row["round_ns"] is not None:
            waits[key].append(row["round_ns"] - row["wait_ns"])
        if row["callback_instance_id"] in timed and row["round_ns"] is not None:
            due = timed[row["callback_instance_id"]][1]
            if row["wait_ns"] < due < row["round_ns"]:
                wakings[key].append(row["round_ns"] - due)
    every = [each for found in wakings.values() for each in found]
    usual = _short(every)
    woken = {key: _short(wakings[key]) or usual for key in executors}
    return {
        key: Executor(
            EVENTS if is_in_order and may_be_in_order(row, python) else row["kind"],
            key in python,
            forgets or key in python,
            row["threads"],
            first.get(key, 0) if row["start_ns"] is None else row["start_ns"],
            max(_LOOK_NS, row["falling_ns"] or 0),
            woken[key] if row["has_rounds"] else 0,
            min(woken[key], _short(waits[key])),
        )
        for key, row in executors.items()
    }


def _short(each: Sequence[int]) -> int:
    """What a tenth is shorter than: nothing that ended a wait came later than so long before."""
    return sorted(each)[len(each) // 10] if each else 0


def may_be_in_order(executor: Row, python: Collection[int] = ()) -> bool:
    """Whether it may be an events executor, though it was not seen to serve what came first."""
    return (
        not executor["has_rounds"]
        and executor["kind"] != EVENTS
        and (executor["executor_id"] not in python)
    )


def _instances(
    instances: Sequence[Row],
    callbacks: Mapping[int, Callback],
    executors: Mapping[int, Executor],
    timed: Mapping[int, tuple[int, int]],
) -> dict[int, Instance]:
    """Return what each callback instance did but publish, and give it to its callback.

    Executors learn how much of the time of their threads that is.
    """
    made = {}
    ended: dict[int, int] = {}
    for row in instances:
        callback, number = callbacks[row["callback_id"]], row["callback_instance_id"]
        turn, due = timed.get(number, (0, row["looked_ns"]))
        waking = None
        # Without events of the executor, a wait began when the callback before had ended.
        since = row["wait_ns"] or ended.get(row["thread_id"], due)
        if number in timed and since < due:
            waking = max(0, (row["round_ns"] or row["looked_ns"]) - due)
        ended[row["thread_id"]] = row["end_ns"]
        after = 0 if row["next_ns"] is None else row["next_ns"] - row["end_ns"]
        instance = made[number] = Instance(
            due,
            row["start_ns"] - row["looked_ns"],
            row["end_ns"] - row["start_ns"],
            after,
            waking,
        )
        key = turn if number in timed else row["publication_id"]
        callback.instances[number if key is None else key] = instance
    of_executor: dict[int, list[Row]] = defaultdict(list)
    for row in instances:
        of_executor[row["executor_id"]].append(row)
    alone = [
        made[row["callback_instance_id"]].after
        for row in instances
        if executors[row["executor_id"]].threads == 1
    ]
    usual = int(median(alone)) if alone else 0
    for key, rows in of_executor.items():
        executor = executors[key]
        # One thread needs so much of its time, or a group that only one thread may serve.
        needed: dict[object, float] = defaultdict(float)
        for row in rows:
            instance = made[row["callback_instance_id"]]
            if executor.threads > 1:
                # Behind a callback, it has to wait while another one looks, or waits.
                instance.after = min(instance.after, usual)
            lasted = instance.before + instance.duration + instance.after
            needed[None] += lasted / executor.threads
            if (group := callbacks[row["callback_id"]].group) is not None:
                needed[group] += lasted
        executor.load = max(needed.values()) / max(1, rows[-1]["end_ns"] - rows[0]["looked_ns"])
    return made


def _messages(
    tables: Mapping[str, Sequence[Row]],
    instances: Sequence[Row],
    callbacks: Mapping[int, Callback],
    executors: Mapping[int, Executor],
    timed: Mapping[int, tuple[int, int]],
    made: Mapping[int, Instance],
) -> list[tuple[int, Sent]]:
    """Give callbacks what they published; return what was published in none of them."""
    outside = []
    sent_by: dict[int, Sent] = {}
    sent_at: dict[int, int] = {}
    starts = {row["callback_instance_id"]: row["start_ns"] for row in instances}
    for row in tables["replay_publication"]:
        number, cause = row["publication_id"], row["callback_instance_id"]
        sent = sent_by[number] = Sent(0, row["publisher_id"], number)
        sent_at[number] = row["end_ns"]
        if cause in made:
            sent.offset = row["end_ns"] - starts[cause]
            made[cause].sent.append(sent)
        else:
            outside.append((row["end_ns"], sent))
    heard = {each.subscription: each.number for each in callbacks.values() if each.subscription}
    callback_of = {row["callback_instance_id"]: row["callback_id"] for row in instances}
    by_instance: dict[int, tuple[int, int]] = {}
    untaken = []
    arrived: dict[int, int] = {}
    for row in tables["replay_delivery"]:
        number, key = row["publication_id"], heard.get(row["subscription_id"])
        if number not in sent_by:
            continue
        if row["callback_instance_id"] in made:
            instance = row["callback_instance_id"]
            by_instance[instance] = number, callback_of[instance]
            if row["arrived_ns"] is not None:
                arrived[row["callback_instance_id"]] = row["arrived_ns"]
        elif key is not None:
            untaken.append((number, key))
    is_busy = _busy(instances, callbacks)
    found = _arrivals(instances, executors, is_busy, by_instance, sent_by, sent_at, timed, arrived)
    delays: dict[tuple[int, int], list[int]] = defaultdict(list)
    for instance, (number, key) in by_instance.items():
        delay = found[instance] - sent_at[number]
        sent_by[number].delays[key] = delay
        made[instance].at = sent_at[number]
        delays[sent_by[number].publisher, key].append(delay)
    for number, key in untaken:
        known = delays.get((sent_by[number].publisher, key))
        if known:
            sent_by[number].delays[key] = int(median(known))
    return outside


def _busy(
    instances: Iterable[Row], callbacks: Mapping[int, Callback]
) -> Callable[[int, int], bool]:
    """Return what says whether others of its group kept a callback from running at a time."""
    runs: dict[object, list[tuple[int, int]]] = defaultdict(list)
    for row in instances:
        callback = callbacks[row["callback_id"]]
        if callback.group is not None:
            runs[callback.executor, callback.group].append((row["looked_ns"], row["end_ns"]))

    def is_busy(number: int, time: int) -> bool:
        known = runs.get((callbacks[number].executor, callbacks[number].group), [])
        place = bisect_left(known, (time, 0)) - 1
        return place >= 0 and known[place][1] >= time

    return is_busy


def _arrivals(
    instances: Sequence[Row],
    executors: Mapping[int, Executor],
    is_busy: Callable[[int, int], bool],
    by_instance: Mapping[int, tuple[int, int]],
    sent_by: Mapping[int, Sent],
    sent_at: Mapping[int, int],
    timed: Mapping[int, tuple[int, int]],
    known: Mapping[int, int],
) -> dict[int, int]:
    """When messages came.

    One that ended a wait came right before its end. Any other came before the wait that found it,
    and after the one before it, if that would have found it: there, as long after its publication
    as is usual.
    """
    rounds: dict[tuple[int, int], list[Row]] = defaultdict(list)
    for row in instances:
        rounds[row["executor_id"], row["round_ns"] or row["looked_ns"]].append(row)
    usual = _usual_delays(rounds, executors, by_instance, sent_by, sent_at)
    found: dict[int, int] = {}
    last_round: dict[int, int] = {}
    last_arrival: dict[int, int] = {}
    for (key, end), rows in sorted(rounds.items(), key=lambda item: item[0][1]):
        executor = executors[key]
        # Not so near to a wait's end that a replay some ns earlier would find another one.
        margin = executor.waking // 2
        came: list[tuple[int, int]] = []
        wait = rows[0]["wait_ns"]
        dues = [
            timed[row["callback_instance_id"]][1]
            for row in rows
            if row["callback_instance_id"] in timed
        ]
        # So long that nothing can have been there when it began.
        is_long = (
            wait is not None
            and end - wait > max(executor.waking, _MANY * executor.polling)
            and min(dues, default=end) > wait
        )
        for row in rows:
            number = row["callback_instance_id"]
            if number not in by_instance:
                continue
            publication, callback = by_instance[number]
            at = sent_at[publication]
            guess = at + usual.get((sent_by[publication].publisher, callback), 0)
            least = max(at, last_arrival.get(callback, 0) + 1)
            before = row["before_ns"]
            # While a group is busy, no wait of several threads finds its messages.
            is_alone = executor.threads == 1
            if is_alone and before is not None and last_round.get(callback) != before:
                least = max(least, before + margin)
            if is_long and not is_busy(callback, wait):
                # It would have ended that wait at once.
                least = max(least, wait + 1)
            if executor.kind == EVENTS:
                least = max(least, last_arrival.get(-key, 0) + 1)
            guess = known.get(number, min(max(guess, least), max(at, end - margin)))
            came.append((guess, number))
            last_round[callback] = end
            last_arrival[callback] = last_arrival[-key] = guess
        if came and wait is not None and min([*dues, *(each[0] for each in came)]) > wait:
            first, number = min(came)
            if not dues or first < min(dues):
                # It was what ended the wait; the others came later.
                at = sent_at[by_instance[number][0]]
                woke = max(end - executor.waking, at)
                came = [
                    (woke if each == number else max(guess, woke), each) for guess, each in came
                ]
        for guess, number in came:
            found[number] = guess
            last_arrival[by_instance[number][1]] = guess
    return found


def _usual_delays(
    rounds: Mapping[tuple[int, int], Sequence[Row]],
    executors: Mapping[int, Executor],
    by_instance: Mapping[int, tuple[int, int]],
    sent_by: Mapping[int, Sent],
    sent_at: Mapping[int, int],
) -> dict[tuple[int, int], int]:
    """How long messages travel as a rule, by publisher and callback: those that ended a wait."""
    alone: dict[tuple[int, int], list[int]] = defaultdict(list)
    ended: dict[int, int] = {}
    for (key, end), rows in sorted(rounds.items(), key=lambda item: item[0][1]):
        row = rows[0]
        waited_since = row["wait_ns"] or ended.get(row["thread_id"], 0)
        ended[row["thread_id"]] = rows[-1]["end_ns"]
        if len(rows) == 1 and row["callback_instance_id"] in by_instance:
            publication, callback = by_instance[row["callback_instance_id"]]
            at = sent_at[publication]
            if at > waited_since:
                pair = sent_by[publication].publisher, callback
                alone[pair].append(max(0, end - executors[key].waking - at))
    usual = {pair: int(median_low(each)) for pair, each in alone.items()}
    every = int(median(usual.values())) if usual else 0
    for publication, callback in by_instance.values():
        usual.setdefault((sent_by[publication].publisher, callback), every)
    return usual


def _passed(paths: Sequence[Row], callbacks: Mapping[int, Callback]) -> dict[int, frozenset[int]]:
    """The callbacks that each path passes."""
    heard = {each.subscription: each.number for each in callbacks.values() if each.subscription}
    publishing: dict[int, set[int]] = defaultdict(set)
    for callback in callbacks.values():
        for instance in callback.instances.values():
            for sent in instance.sent:
                publishing[sent.publisher].add(callback.number)
    by_chain: dict[int, frozenset[int]] = {}
    passed: dict[int, frozenset[int]] = defaultdict(frozenset)
    for row in paths:
        own = publishing[row["publisher_id"]] | {heard.get(row["subscription_id"])}
        before = by_chain.get(row["parent_path_id"], frozenset())
        by_chain[row["path_id"]] = before | frozenset(each for each in own if each is not None)
        if row["is_path"]:
            passed[row["alike_id"]] |= by_chain[row["path_id"]]
    return dict(passed)
