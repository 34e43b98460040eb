"""Another run of a recorded system: what chance decides is drawn anew."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from math import isqrt
from random import Random
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from msgflow.replay.system import Callback, Instance, System

# By how much the start of a process differs from run to run [ns].
_START_NS = 500_000


class Lottery:
    """Draws runs of a system.

    A run of a callback is in place of it another one that published the same: neighbours keep each
    other, as far as they may. Executors look in an order of their own in each run, and processes
    start a bit earlier or later.
    """

    def __init__(self, system: System) -> None:
        self._system = system
        self._alike = {key: _alike(each) for key, each in system.callbacks.items()}

    def draw(self, seed: int) -> System:
        """Return a run; the same seed gives the same one."""
        random = Random(seed)
        late = {key: int(random.gauss(0, _START_NS)) for key in sorted(self._system.executors)}
        places: dict[object, float] = defaultdict(random.random)
        callbacks = {}
        for key, each in self._system.callbacks.items():
            shift = late[each.executor] if each.period is not None else 0
            block, place, kind = each.rank
            callbacks[key] = replace(
                each,
                origin=each.origin + shift,
                until=each.until + shift,
                rank=(block, places[each.executor, block, place], kind),
                instances=dict(self._instances(each, random)),
            )
        return replace(self._system, callbacks=callbacks)

    def _instances(self, callback: Callback, random: Random) -> Iterator[tuple[int, Instance]]:
        if callback.period is None and callback.subscription is None:
            # They say when it runs.
            yield from callback.instances.items()
            return
        for keys in self._alike[callback.number]:
            count = len(keys)
            length = isqrt(count)
            for begin in range(0, count, length):
                other = random.randrange(count)
                for number in range(begin, min(begin + length, count)):
                    key = keys[number]
                    source = keys[(other + number - begin) % count]
                    yield key, callback.instances[source]


def _alike(callback: Callback) -> list[list[int]]:
    """Return the keys of the runs of a callback that published the same, in the order of time."""
    alike: dict[tuple[int, ...], list[tuple[int, int]]] = defaultdict(list)
    for key, each in callback.instances.items():
        alike[tuple(sent.publisher for sent in each.sent)].append((each.at, key))
    return [[key for _, key in sorted(each)] for each in alike.values()]
