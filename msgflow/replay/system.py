"""What a replay is made of: executors, callbacks, and what each run of a callback did."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass, field

# Executors that serve what came first first, in place of what a wait found.
EVENTS = "events"


@dataclass(slots=True)
class Sent:
    """A message that a callback publishes; times in ns.

    Attributes:
        offset: when, since the begin of the callback.
        publisher: its publisher.
        number: its identity in the recording.
        delays: by callback, how long the message takes to get there.
    """

    offset: int
    publisher: int
    number: int
    delays: dict[int, int] = field(default_factory=dict)


@dataclass(slots=True)
class Instance:
    """A recorded run of a callback, which a replayed run repeats.

    Attributes:
        at: when the message that led to it was published, or its timer was due.
        before: from when its thread looked for work until it began.
        duration: how long it ran.
        after: from its end until its thread looked again.
        waking: of a timer, from when it was due until a wait ended; None: it did not end one.
        sent: what it published, in order.
    """

    at: int
    before: int
    duration: int
    after: int
    waking: int | None = None
    sent: list[Sent] = field(default_factory=list)


@dataclass(slots=True)
class Callback:
    """A callback of the system.

    Attributes:
        number: its identity in the recording; `subscription` and `executor` likewise. What comes to
            a service or a client comes to a subscription of a negative number.
        group: callbacks of a group exclude each other; None: it runs beside all others.
        rank: its place in the order in which its executor looks: of the kind that comes first, of
            what the recording alone tells, and of its kind among that.
        period: of its timer; None: it has none. `origin`: when it is due first.
        until: when it is due for the last time.
        is_retimed: it is due at other times than it was.
        factor: how many times as long as recorded it takes.
        instances: what it did, by the message that led to it, or by how often its timer was due
            before. Of other callbacks, when they are to run.
        symbol: name of its function; None: not known.
        awaited: share of its time for which its thread is free.
    """

    number: int
    kind: str
    node: str
    label: str
    executor: int
    subscription: int | None
    depth: int
    group: object
    period: int | None = None
    origin: int = 0
    until: int = 0
    rank: tuple[int, float, int] = (0, 0, 0)
    is_retimed: bool = False
    factor: float = 1.0
    instances: dict[int, Instance] = field(default_factory=dict)
    symbol: str | None = None
    awaited: float = 0.0
    _known: list[tuple[int, int]] = field(default_factory=list)

    @property
    def topic(self) -> str:
        """The topic of its subscription; '': it has none."""
        # Behind it a label may have the function.
        label = self.label.partition(")")[0]
        return label.removeprefix("Subscription(") if self.kind == "subscription" else ""

    def like(self, at: int, fires: bool | None, outputs: frozenset[int]) -> Instance | None:
        """The run whose message was published nearest to a time.

        `fires`: of those that publish on one of the outputs, or on none of them.
        """
        if not self._known:
            self._known = sorted((each.at, key) for key, each in self.instances.items())
        known = self._known
        place = bisect_left(known, (at, 0))
        below, above = place - 1, place
        while below >= 0 or above < len(known):
            if above >= len(known) or (below >= 0 and at - known[below][0] <= known[above][0] - at):
                number, below = below, below - 1
            else:
                number, above = above, above + 1
            found = self.instances[known[number][1]]
            if fires is None or fires == any(each.publisher in outputs for each in found.sent):
                return found
        return None


@dataclass(slots=True)
class Executor:
    """An executor of the system; times in ns.

    Attributes:
        kind: as of `main.executor`.
        is_python: it is one of rclpy.
        forgets: something that is ready while its group is busy waits for another wait; of rclcpp
            but timers.
        threads: how many spin it.
        start: when it begins to look for work.
        falling: from when a thread looks in vain until it waits.
        waking: from when something comes until a wait ends.
        polling: how long a wait lasts if there is something already.
        load: share of the time of its threads that callbacks need.
    """

    kind: str
    is_python: bool
    forgets: bool
    threads: int
    start: int
    falling: int
    waking: int
    polling: int
    load: float = 0.0


@dataclass(slots=True)
class Link:
    """A declared link: callbacks of `inputs` keep messages, which `outputs` are made of."""

    kind: str
    inputs: frozenset[int]
    outputs: frozenset[int]


@dataclass(slots=True)
class System:
    """A recorded system.

    Attributes:
        executors: by identity; `callbacks` likewise.
        outside: what was published in no callback that is replayed: when, and the message.
        links: declared links.
        steps: the chain that a step leads to, from the chain before (None: none), a publisher and
            a subscription.
        paths: by the chain that ends a path, the path that it looks like.
        names: of paths.
        passed: the callbacks that a path passes.
        recorded: by path, how long its flows took.
        end: of the recording.
    """

    executors: dict[int, Executor]
    callbacks: dict[int, Callback]
    outside: list[tuple[int, Sent]]
    links: list[Link]
    steps: Mapping[tuple[int | None, int, int], int]
    paths: Mapping[int, int]
    names: Mapping[int, str]
    passed: Mapping[int, frozenset[int]]
    recorded: Mapping[int, list[int]]
    end: int

    def executors_of(self, path: int) -> frozenset[int]:
        """The executors that a path passes."""
        return frozenset(
            self.callbacks[key].executor for key in self.passed[path] if key in self.callbacks
        )
