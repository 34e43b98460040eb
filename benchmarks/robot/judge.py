"""Whether a verdict of `msgflow why` names what was planted: who, the kind, and a true number."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from msgflow.backports import StrEnum

NOTHING = "nothing stands out"
"""What the only headline says of a healthy robot."""


class Kind(StrEnum):
    """Kinds of culprits, as `why` calls them."""

    COMPUTES = "computes"
    SLEEPS = "sleeps"
    AWAITS = "awaits"
    ACTION = "action"
    OVERLOAD = "overload"
    BURST = "burst"
    QUEUE = "queue"
    STALE = "stale"
    PROCESS_THREAD = "process_thread"
    GARBAGE_COLLECTION = "garbage_collection"
    NO_CPU = "no_cpu"
    LOCK = "lock"
    DISK = "disk"
    RESTART = "restart"
    NEVER_MATCHED = "never_matched"
    LATE_START = "late_start"
    RECORDING = "recording"
    CALLBACK = "callback"


@dataclass(frozen=True)
class Limits:
    """What a number of a headline may be.

    Attributes:
        unit: 'ms' of any duration, '%', or 'count' of a number without a unit.
        least, most: what it may be.
    """

    unit: str
    least: float
    most: float


@dataclass(frozen=True)
class Culprit:
    """What a verdict has to say of a planted problem. Texts are patterns of all of a field.

    Attributes:
        kinds: any of them is right.
        who: the node, or the process.
        limits: the headline has a number within any of them.
        callback: as in `Timer(250 ms)`; None: any, or none.
        function: the last name of its symbol; None: likewise.
        names: what headline and evidence have to name besides.
        sufferer: whom it has to name instead, with a number, where the kind is not known without
            CPU time; None: `why` knows it all the same.
    """

    kinds: tuple[Kind, ...]
    who: str
    limits: tuple[Limits, ...]
    callback: str | None = None
    function: str | None = None
    names: tuple[str, ...] = ()
    sufferer: str | None = None


@dataclass(frozen=True)
class Told:
    """A row of a verdict, with what the judge reads of it."""

    who: str | None
    callback: str | None
    function: str | None
    kind: str | None
    # Without it, the row is a note.
    has_harm: bool
    headline: str
    evidence: tuple[str, ...]


# What is only known of a callback that takes long where it is known what its thread did.
_OF_CALLBACKS = {
    Kind.COMPUTES, Kind.SLEEPS, Kind.LOCK, Kind.DISK, Kind.GARBAGE_COLLECTION,
}  # fmt: skip
# Kinds of `why` that are finer than what is planted.
_KINDS = {
    "interpreter": Kind.PROCESS_THREAD,
    "service": Kind.AWAITS,
    "waits": Kind.QUEUE,
}


def told(verdict: Sequence[Mapping[str, Any]]) -> list[Told]:
    """Return the rows of a verdict: the only place that knows its columns."""
    return [
        Told(
            who=row["node"],
            callback=row["callback"],
            function=row["function"],
            kind=_KINDS.get(row["kind"], row["kind"]),
            has_harm=row["harm_ns"] is not None,
            headline=row["headline"],
            evidence=tuple(row["evidence"]),
        )
        for row in verdict
    ]


def missed(
    planted: Sequence[Culprit], verdict: Sequence[Told], *, knows_cpu: bool
) -> Iterator[str]:
    """Yield what a verdict does not say of the culprits at their places, the worst first.

    `knows_cpu`: events of the kernel, or CPU times and samples, tell what threads did.
    """
    accused = [row for row in verdict if row.has_harm]
    if not planted:
        if accused:
            yield f"{accused[0].who} is accused of {accused[0].kind}"
        if not any(NOTHING in row.headline for row in verdict):
            yield f"no headline says that {NOTHING}"
    for place, culprit in enumerate(planted):
        if place < len(accused):
            for fault in faults(culprit, accused[place], knows_cpu=knows_cpu):
                yield f"headline {place + 1}: {fault}"
        else:
            yield f"no headline {place + 1} of {culprit.who}"


def faults(culprit: Culprit, row: Told, *, knows_cpu: bool) -> Iterator[str]:
    """Yield what is wrong or missing in what is said of a culprit."""
    is_guess = not knows_cpu and culprit.sufferer is not None
    who = culprit.who if not is_guess else f"{culprit.who}|{culprit.sufferer}"
    if not _is(who, row.who):
        yield f"{row.who} is blamed, not {who}"
    if culprit.callback is not None and not _is(culprit.callback, row.callback):
        yield f"the callback is {row.callback}, not {culprit.callback}"
    if not any(_is_within(limits, row.headline) for limits in culprit.limits):
        yield "no true number of " + " or ".join(
            f"{limits.least:g} to {limits.most:g} {limits.unit}" for limits in culprit.limits
        )
    if is_guess:
        return
    kinds = set(culprit.kinds)
    if not knows_cpu and kinds & _OF_CALLBACKS:
        # It takes long, and no more is known.
        kinds.add(Kind.CALLBACK)
    if row.kind not in kinds:
        yield f"the kind is {row.kind}, not {' or '.join(culprit.kinds)}"
    function = culprit.function
    if function is not None and not _is(function, (row.function or "").rpartition(".")[2]):
        yield f"the function is {row.function}, not {function}"
    said = "\n".join((row.headline, *row.evidence))
    for name in culprit.names:
        if re.search(name, said) is None:
            yield f"{name} is not named"


def _is(pattern: str, text: str | None) -> bool:
    return text is not None and re.fullmatch(pattern, text) is not None


_MILLISECONDS = {"µs": 1e-3, "ms": 1.0, "s": 1e3}
_NUMBER = re.compile(r"(?<![\w./])(\d+(?:[.,]\d+)*)(?: ?(µs|ms|s|%|Hz)(?!\w))?")


def _is_within(limits: Limits, text: str) -> bool:
    for digits, unit in _NUMBER.findall(text):
        number = float(digits.replace(",", ""))
        if unit in _MILLISECONDS:
            number, unit = number * _MILLISECONDS[unit], "ms"
        if (unit or "count") == limits.unit and limits.least <= number <= limits.most:
            return True
    return False
