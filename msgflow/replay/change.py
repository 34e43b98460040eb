"""What is changed in a recorded system before it is replayed, as a value and as text."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, NoReturn

from msgflow.errors import UsageError
from msgflow.replay.system import EVENTS
from msgflow.run.window import duration_ns
from msgflow.text.name_suggestions import did_you_mean

if TYPE_CHECKING:
    from msgflow.replay.system import Callback, Instance, Sent, System

_TEXT = re.compile(r"(?P<kind>\w+)\s*\((?P<place>.+)\)\s*(?P<operator>[=*])\s*(?P<value>\S.*)")
_MODULE, _CLASS = re.compile(r"(?<!:):(?!:)"), re.compile(r"::|[:.]")
# Threads, or messages in a queue; and ns.
_MOST = 10_000
_SHORTEST_PERIOD = 10_000
_UNITS = (("s", 1_000_000_000), ("ms", 1_000_000), ("us", 1_000), ("ns", 1))


@dataclass(frozen=True)
class Change:
    """Something that is changed.

    Attributes:
        kind: 'executor' (of its own, `value` threads), 'threads' (of its executor), 'duration' (so
            many times as long), 'depth' (of its queue), 'period' or 'phase' (of its timer, ns),
            'way' (its messages travel so many times as long), 'awaits' (a share of its time, for
            which its thread is free), or 'reacts' (it runs with the messages of a topic in place of
            its timer).
        place: full name of a node; with a space and a label or a function behind it, one of its
            callbacks; or a topic, whose subscriptions are meant.
        value: the new value.
    """

    kind: str
    place: str
    value: float | str

    def __str__(self) -> str:
        """Return the text that `read_change` reads."""
        kind = _KINDS[self.kind]
        return f"{self.kind}({self.place}){kind.operator}{kind.text(self.value)}"


@dataclass(frozen=True)
class _Kind:
    """How changes of a kind are written, and what they do.

    Attributes:
        operator: stands before the value.
        value: an example of it.
        read: returns the value of a text, and raises a ValueError if the text has none.
        make: changes the callbacks that are chosen.
    """

    operator: str
    value: str
    read: Callable[[str], float | str]
    make: Callable[[System, list[Callback], float | str], None]

    def text(self, value: float | str) -> str:
        if isinstance(value, str) or self.read not in (_time, _period_time):
            return value if isinstance(value, str) else f"{value:.15g}"
        unit, size = next(each for each in _UNITS if int(value) % each[1] == 0)
        return f"{int(value) // size}{unit}"


def read_change(text: str) -> Change:
    """Return the change that a text means, such as 'threads(/perception)=2'."""
    match = _TEXT.fullmatch(text.strip())
    if match is None:
        _refuse(f"cannot read the change — {text}", match)
    kind = _KINDS.get(match["kind"]) or _unknown(match["kind"])
    if match["operator"] != kind.operator:
        _refuse(f"a {match['kind']} is changed with '{kind.operator}' — {text}", match)
    try:
        return Change(match["kind"], match["place"].strip(), kind.read(match["value"]))
    except (ValueError, UsageError):
        _refuse(f"it cannot be the value of a {match['kind']} — {match['value']}", match)


def _refuse(message: str, match: re.Match[str] | None) -> NoReturn:
    kind, place = (match["kind"], match["place"]) if match else ("threads", "/perception")
    known = _KINDS[kind]
    raise UsageError(message, f"write it like {kind}({place}){known.operator}{known.value}")


def _unknown(kind: str) -> NoReturn:
    hint = did_you_mean(kind, [*_KINDS], f"choose one of {', '.join(_KINDS)}")
    raise UsageError(f"nothing of that kind can be changed — {kind}", hint)


def changed(system: System, changes: Iterable[Change]) -> System:
    """Return a system with changes; UsageError: it has not what is to be changed."""
    draft = replace(
        system,
        executors=dict(system.executors),
        callbacks={key: replace(each) for key, each in system.callbacks.items()},
    )
    for change in changes:
        kind = _KINDS.get(change.kind) or _unknown(change.kind)
        read_change(str(change))
        chosen = chosen_by(draft, change)
        if not chosen:
            every = draft.callbacks.values()
            known = {name for each in every for name in _names(each, change.kind)}
            hint = did_you_mean(change.place, sorted(known), "msgflow query callbacks lists them")
            raise UsageError(f"nothing of that name has a {change.kind} — {change.place}", hint)
        kind.make(draft, chosen, change.value)
    return draft


def require_effect(system: System, change: Change) -> None:
    """Raise a UsageError if the system is as a change would have it."""
    other = changed(system, [change])
    if replace(other, names=system.names) == system:
        raise UsageError(f"it is so already — {change}", "msgflow why --fix says what may help")


def chosen_by(system: System, change: Change) -> list[Callback]:
    """Return the callbacks that a change is about."""
    return [each for each in system.callbacks.values() if change.place in _names(each, change.kind)]


def _names(callback: Callback, kind: str) -> Iterator[str]:
    """By which names a callback can be changed."""
    if kind in {"period", "phase", "reacts"} and callback.period is None:
        return
    if kind in {"depth", "way"} and not callback.topic:
        return
    yield callback.node
    yield f"{callback.node} {callback.label}"
    if callback.symbol is not None:
        # As people write it: without its module, and often without its class.
        for parts in (_MODULE, _CLASS):
            yield f"{callback.node} {parts.split(callback.symbol)[-1]}"
    if callback.topic:
        yield callback.topic


def _own_executor(draft: System, chosen: list[Callback], value: float | str) -> None:
    number = max(draft.executors) + 1
    here = {callback.executor for callback in chosen}
    beside = [each for each in draft.callbacks.values() if each.executor in here]
    if len(beside) == len(chosen) and len(here) == 1:
        # It has one: only the threads may be others.
        _threads(draft, chosen, value)
        return
    draft.executors[number] = replace(draft.executors[chosen[0].executor], threads=1, load=0.0)
    for callback in chosen:
        callback.executor = number
    _threads(draft, chosen, value)


def _threads(draft: System, chosen: list[Callback], value: float | str) -> None:
    for callback in chosen:
        if int(value) > 1 and draft.executors[callback.executor].kind == EVENTS:
            raise UsageError(
                f"an events executor has one thread — {callback.node}",
                f"give a callback an executor of its own: executor({callback.node})=1",
            )
    for number in {callback.executor for callback in chosen}:
        draft.executors[number] = replace(draft.executors[number], threads=int(value))


def _duration(_: System, chosen: list[Callback], value: float | str) -> None:
    for callback in chosen:
        callback.factor *= float(value)


def _depth(_: System, chosen: list[Callback], value: float | str) -> None:
    for callback in chosen:
        callback.depth = int(value)


def _period(_: System, chosen: list[Callback], value: float | str) -> None:
    for callback in chosen:
        if callback.period != int(value):
            callback.origin += int(value) - (callback.period or 0)
            callback.period, callback.is_retimed = int(value), True


def _phase(_: System, chosen: list[Callback], value: float | str) -> None:
    for callback in chosen:
        callback.origin, callback.is_retimed = callback.origin + int(value), True


def _awaits(_: System, chosen: list[Callback], value: float | str) -> None:
    for callback in chosen:
        callback.awaited = float(value)


def _way(draft: System, chosen: list[Callback], value: float | str) -> None:
    numbers = {callback.number for callback in chosen}

    def other(sent: Sent) -> Sent:
        if numbers.isdisjoint(sent.delays):
            return sent
        return replace(
            sent,
            delays={
                key: int(delay * float(value)) if key in numbers else delay
                for key, delay in sent.delays.items()
            },
        )

    draft.outside = [(at, other(sent)) for at, sent in draft.outside]
    for callback in draft.callbacks.values():
        _with_instances(
            callback,
            lambda instance: replace(instance, sent=[other(each) for each in instance.sent]),
        )


def _reacts(draft: System, chosen: list[Callback], topic: float | str) -> None:
    """What a timer did is done at the end of each message of a topic, after what that did."""
    for timer in chosen:
        inputs = [
            each
            for each in draft.callbacks.values()
            if each.node == timer.node and each.topic == topic
        ]
        if not inputs:
            near = [each.topic for each in draft.callbacks.values() if each.node == timer.node]
            hint = did_you_mean(str(topic), sorted(filter(None, near)), "msgflow graph shows it")
            raise UsageError(f"{timer.node} has no subscription of that topic — {topic}", hint)
        for each in inputs:
            _with_instances(each, partial(_followed_by, timer))
        del draft.callbacks[timer.number]


def _followed_by(timer: Callback, instance: Instance) -> Instance:
    """Return a run behind which a timer's nearest one follows at once."""
    then = timer.like(instance.at, None, frozenset())
    if then is None:
        return instance
    begin = instance.duration
    sent = [replace(each, offset=begin + each.offset) for each in then.sent]
    return replace(instance, duration=begin + then.duration, sent=[*instance.sent, *sent])


def _with_instances(callback: Callback, other: Callable[[Instance], Instance]) -> None:
    callback.instances = {key: other(each) for key, each in callback.instances.items()}


def _count(text: str) -> float:
    number = int(text)
    # More threads than any machine runs would take all memory of a replay.
    if not 1 <= number <= _MOST:
        raise ValueError(text)
    return number


def _factor(text: str) -> float:
    number = float(text)
    if not 0 < number < float("inf"):
        raise ValueError(text)
    return number


def _share(text: str) -> float:
    number = _factor(text)
    if number > 1:
        raise ValueError(text)
    return number


def _time(text: str) -> float:
    return duration_ns(text, "a change")


def _period_time(text: str) -> float:
    number = _time(text)
    if number < _SHORTEST_PERIOD:
        raise ValueError(text)
    return number


_KINDS: Mapping[str, _Kind] = {
    "executor": _Kind("=", "1", _count, _own_executor),
    "threads": _Kind("=", "2", _count, _threads),
    "duration": _Kind("*", "0.7", _factor, _duration),
    "depth": _Kind("=", "1", _count, _depth),
    "period": _Kind("=", "20ms", _period_time, _period),
    "phase": _Kind("=", "5ms", _time, _phase),
    "way": _Kind("*", "0.5", _factor, _way),
    "awaits": _Kind("=", "0.9", _share, _awaits),
    "reacts": _Kind("=", "/scan", str, _reacts),
}
