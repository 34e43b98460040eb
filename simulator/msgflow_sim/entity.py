"""Entities of nodes: publishers, subscriptions, timers, services, clients, and what they do.

Data only, no behaviour. All durations are nanoseconds.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from msgflow.errors import UsageError

MICROSECOND = 1_000
MILLISECOND = 1_000_000
SECOND = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Work:
    """How long a callback computes: `typical_ns` plus up to `spread_ns`, at times `slow_ns` more.

    Attributes:
        typical_ns: shortest duration.
        spread_ns: width of the even spread above it.
        slow_probability: share of the runs (0..1) that take up to `slow_ns` longer.
        slow_ns: greatest additional duration of a slow run; it is at least half of that.
        percent_before: how much is done before the first publication, the rest after the last.
        paces: from these times on, after the begin of tracing, all of it takes so many times as
            long, until the next of them.
        sleep_ns: how long the thread sleeps before the first publication. This and all below
            happens only where the kernel is traced.
        page_fault_ns: how long it then waits for a page from the disk.
        mutex: what is locked meanwhile; nothing if empty. A name that begins with a slash is one
            of all processes of the host, others are of the process.
        waits_for: a condition that it waits for first, without the mutex; named like a mutex.
        signals: a condition that it signals after the last publication; named like a mutex.
    """

    typical_ns: int = 20 * MICROSECOND
    spread_ns: int = 30 * MICROSECOND
    slow_probability: float = 0.0
    slow_ns: int = 0
    percent_before: int = 80
    paces: tuple[tuple[int, float], ...] = field(default=(), repr=False)
    sleep_ns: int = field(default=0, repr=False)
    page_fault_ns: int = field(default=0, repr=False)
    mutex: str = field(default="", repr=False)
    waits_for: str = field(default="", repr=False)
    signals: str = field(default="", repr=False)


@dataclass(frozen=True, slots=True)
class Call:
    """Send a request to a service.

    Attributes:
        service: name of the service; the node has a client of it.
        spins: number of the executor that is spun in the callback until the response is there;
            None if the callback does not wait for it.
    """

    service: str
    spins: int | None = None


@dataclass(frozen=True, slots=True)
class SendGoal:
    """Send a goal to an action; the node has an action client of it."""

    action: str


@dataclass(frozen=True, slots=True)
class Spin:
    """Spin an executor of the process inside the callback for `duration_ns`.

    Callbacks that it executes run nested; one that spins itself does so up to `depth` times.
    """

    executor: int
    duration_ns: int
    depth: int = 2


@dataclass(frozen=True, slots=True)
class Poll:
    """Take one message of a polled subscription of the node, if there is one."""

    topic: str


@dataclass(frozen=True, slots=True)
class Publish:
    """Publish on a topic of the node, after what was done before."""

    topic: str


@dataclass(frozen=True, slots=True)
class Answer:
    """Send the response to the oldest request of a service of the node that waits for one."""

    service: str


@dataclass(frozen=True, slots=True)
class Transition:
    """Take a managed node to its next state: configured, active, inactive, active, and so on."""


@dataclass(frozen=True, slots=True)
class Record:
    """Record an event of a tracepoint of the user's own, `my_pkg:frame_done`."""


@dataclass(frozen=True, slots=True)
class TellTime:
    """Record the time of a simulation, as CARET's clock recorder does.

    `pace`: it runs so fast, from 0 at the begin of tracing.
    """

    pace: float = 1.0


Action = Call | SendGoal | Spin | Poll | Publish | Answer | Transition | Record | TellTime


@dataclass(frozen=True, slots=True)
class Publisher:
    """A publisher of a node.

    Attributes:
        topic: topic, fully expanded.
        depth: history depth.
        size_bytes: size of its messages.
        kind: 'typed', 'generic', 'serialized', 'loaned' or 'rcl' (of an action server), which pass
            different layers.
        intra_process: subscriptions of the process that want it get messages without DDS.
        transient_local: the last `depth` messages are kept for subscriptions that come late.
        lifespan_ns: a message that waits for longer cannot be taken any more.
        is_agnocast: its messages go through the shared memory of Agnocast.
        is_buffer_aware: its messages go to the channels of its subscriptions, in releases that
            have these, unless one of them has no channel.
    """

    topic: str
    depth: int = 10
    size_bytes: int = 0
    kind: str = "typed"
    intra_process: bool = False
    transient_local: bool = False
    lifespan_ns: int | None = None
    is_buffer_aware: bool = False
    is_agnocast: bool = False


@dataclass(frozen=True, slots=True)
class Subscription:
    """A subscription of a node and what its callback does.

    Attributes:
        topic: topic, fully expanded.
        publishes: topics that each run of the callback publishes on, in this order.
        work: how long the callback computes.
        depth: history depth (keep last).
        message_type: C++ name of the message, part of the callback's symbol.
        logs: each run of the callback logs once, which publishes on /rosout.
        does: what each run does after it has published.
        first: what each run does before anything else.
        group: name of its callback group; the node's default one if empty.
        kind: 'typed', 'serialized' or 'loaned', which pass different layers.
        intra_process: see `Publisher`.
        transient_local: messages from before its creation are wanted, where publishers keep them.
        loss: share of the messages (0..1) that get lost on their way (best effort).
        loss_from_ns: it begins then, after the begin of tracing.
        discovery_ns: how much longer than usual its discovery takes.
        polled: no executor takes its messages, but `Poll` does.
        created_ns: when a thread of the user creates it, after the begin of tracing; None: with
            the other objects of the node.
        destroyed_ns: when that thread destroys it; its addresses are free then.
        is_agnocast: see `Publisher`.
        channel: of publishers that are aware of buffers: 'own', 'shared' with the other
            subscriptions of the topic that say so, or none.
    """

    topic: str
    publishes: tuple[str, ...] = ()
    work: Work = Work()
    depth: int = 10
    message_type: str = "std_msgs::msg::String"
    logs: bool = False
    does: tuple[Action, ...] = ()
    group: str = ""
    kind: str = "typed"
    intra_process: bool = False
    transient_local: bool = False
    loss: float = 0.0
    loss_from_ns: int = field(default=0, repr=False)
    discovery_ns: int = 0
    polled: bool = False
    created_ns: int | None = None
    destroyed_ns: int | None = None
    first: tuple[Action, ...] = ()
    channel: str = ""
    is_agnocast: bool = False

    @property
    def route(self) -> str:
        """What its messages go through: a topic, or one of Agnocast."""
        return f"agnocast {self.topic}" if self.is_agnocast else self.topic


@dataclass(frozen=True, slots=True)
class MessageLink:
    """What the messages of a node have to do with each other, declared in its trace (annotation).

    Attributes:
        kind: 'periodic_async': each input is kept until a newer one comes, and what is published
            is made of what is kept; 'partial_sync': callbacks of inputs publish only once there is
            a message of every input, and use each up; 'approximate_sync': they do so with the sets
            that `ApproximateTime` makes, once for each.
        inputs: topics of subscriptions of the node, or of the one that `inputs_of` names.
        outputs: topics of its publishers.
        is_late: a callback puts its message into the cache, and looks at the others, only when it
            has computed; a timer when it publishes. Else both do when they begin.
        inputs_of: full name of another node of the process, created before: its callbacks fill the
            caches (periodic_async only), as those of a transform listener do.
    """

    kind: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    is_late: bool = False
    inputs_of: str = ""

    def __post_init__(self) -> None:
        if self.kind not in {"periodic_async", "partial_sync", "approximate_sync"}:
            raise UsageError(
                f"no such kind of link — {self.kind}",
                "choose periodic_async, partial_sync or approximate_sync",
            )
        if not self.inputs or not self.outputs:
            raise UsageError("a link has inputs and outputs — one of them is missing")


@dataclass(frozen=True, slots=True)
class Timer:
    """A timer of a node and what its callback does; see `Subscription`.

    Attributes:
        reset_ns: when user code resets it, after the begin of tracing: periods count from then on.
        rate: how fast its clock runs, as a multiple of that of the host (simulated time).
        periods: user code gives it another period at these times, after the begin of tracing; with
            a period of 0 it cancels the timer.
    """

    period_ns: int
    publishes: tuple[str, ...] = ()
    work: Work = Work()
    logs: bool = False
    does: tuple[Action, ...] = ()
    group: str = ""
    reset_ns: int | None = None
    rate: float = 1.0
    periods: tuple[tuple[int, int], ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        if self.period_ns <= 0:
            raise UsageError(f"the period of a timer must be positive — {self.period_ns} ns")


@dataclass(frozen=True, slots=True)
class Service:
    """A service of a node and what its callback does; see `Subscription`.

    Attributes:
        is_action: it is of an action server, whose callbacks are not traced.
        is_deferred: the callback does not return the response, which is sent on its own.
        is_answered_later: not even the callback sends it, but `Answer` does.
    """

    name: str
    publishes: tuple[str, ...] = ()
    work: Work = Work()
    logs: bool = False
    does: tuple[Action, ...] = ()
    group: str = ""
    is_action: bool = False
    is_deferred: bool = False
    is_answered_later: bool = False


@dataclass(frozen=True, slots=True)
class Client:
    """A client of a service, and what the thread does that took a response; see `Subscription`.

    It does so in no callback that is traced.
    """

    service: str
    publishes: tuple[str, ...] = ()
    does: tuple[Action, ...] = ()
    group: str = ""


@dataclass(frozen=True, slots=True)
class ActionServer:
    """An action server of a node.

    Attributes:
        action: name of the action.
        feedback: messages that it publishes while it executes a goal.
        period_ns: time between them; up to half of it more or less.
        threads: goals that it executes side by side; others wait.
        rejects: it rejects every so many goals of a client; 0: none.
        group: see `Subscription`.
    """

    action: str
    feedback: int = 3
    period_ns: int = 5 * MILLISECOND
    threads: int = 1
    rejects: int = 0
    group: str = ""


@dataclass(frozen=True, slots=True)
class ActionClient:
    """An action client of a node.

    Attributes:
        action: name of the action.
        asks_at_once: it asks for the result once a goal is accepted; else before it sends the next.
        cancels: it cancels every so many goals as soon as they are accepted; 0: none.
        group: see `Subscription`.
    """

    action: str
    asks_at_once: bool = True
    cancels: int = 0
    group: str = ""
