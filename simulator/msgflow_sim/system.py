"""Systems to simulate: hosts, processes, nodes and executors, as data without behaviour.

All durations are nanoseconds. A scenario is immutable; `dataclasses.replace` makes variants of one.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from msgflow.errors import UsageError
from msgflow_sim.entity import (
    SECOND,
    Action,
    ActionClient,
    ActionServer,
    Answer,
    Call,
    Client,
    MessageLink,
    Publish,
    Publisher,
    Record,
    SendGoal,
    Service,
    Subscription,
    Timer,
)
from msgflow_sim.recording import PERFECT, Recording

# Threads of a process are numbered from its id on; the middleware's has the last number.
_THREADS_PER_PROCESS = 9


@dataclass(frozen=True, slots=True)
class Group:
    """A callback group of a node.

    Attributes:
        name: what entities call it.
        is_reentrant: its callbacks may run at the same time, also the same one twice.
        executor: number of the executor that spins it; None: that of the node.
    """

    name: str
    is_reentrant: bool = False
    executor: int | None = None


@dataclass(frozen=True, slots=True)
class Executor:
    """An executor of a process.

    Attributes:
        kind: 'single_threaded', 'multi_threaded', 'static_single_threaded' (without executor
            events), 'events' (likewise; its one thread serves what came first first), 'agnocast'
            (likewise, and names itself), 'wait_set' (user code that waits and takes by itself:
            neither executor events nor callbacks), 'nested' (only callbacks spin it, which wait
            for something).
        thread_count: its threads; the first one of the first executor is the main thread.
        polled_ns: the main thread executes what is ready, and then does something else for so long
            (spin_some); None: it spins.
        timeout_ns: how long a wait lasts at most (spin_once in a loop); None: for ever. For each,
            rclpy makes a timer.
        waits_busily: what is ready ends a wait although its group is busy, so that it may not be
            executed.
    """

    kind: str = "single_threaded"
    thread_count: int = 1
    polled_ns: int | None = None
    timeout_ns: int | None = None
    waits_busily: bool = False


@dataclass(frozen=True, slots=True)
class Node:
    """A node: its objects are created in the order publishers, subscriptions, timers.

    Attributes:
        name: name without namespace.
        namespace: its namespace.
        publishers: its publishers; likewise subscriptions, timers, services, clients,
            action_servers, action_clients.
        links: what its messages have to do with each other beyond single callbacks.
        groups: its callback groups besides the default one.
        executor: number of the executor that spins it.
        has_parameters: parameter services and events, which helper nodes do without.
        is_managed: it has a lifecycle (`Transition`).
        is_agnocast: it is a node of Agnocast, not of rcl, and so are its timers.
    """

    name: str
    namespace: str = "/"
    publishers: tuple[Publisher, ...] = ()
    subscriptions: tuple[Subscription, ...] = ()
    timers: tuple[Timer, ...] = ()
    services: tuple[Service, ...] = ()
    clients: tuple[Client, ...] = ()
    action_servers: tuple[ActionServer, ...] = ()
    action_clients: tuple[ActionClient, ...] = ()
    links: tuple[MessageLink, ...] = ()
    groups: tuple[Group, ...] = ()
    executor: int = 0
    has_parameters: bool = True
    is_managed: bool = False
    is_agnocast: bool = False

    @property
    def full_name(self) -> str:
        """Namespace and name, as in `/camera/driver`."""
        return f"{self.namespace.rstrip('/')}/{self.name}"

    @property
    def uses_intra_process(self) -> bool:
        """Whether the node uses ring buffers. Then its parameter events use them, too."""
        return any(publisher.intra_process for publisher in self.publishers) or any(
            subscription.intra_process for subscription in self.subscriptions
        )


@dataclass(frozen=True, slots=True)
class Process:
    """A process: executors spin its nodes, by default a single-threaded one in the main thread.

    Attributes:
        name: name of the executable; the trace shows its first 15 characters.
        hostname: the host it runs on.
        pid: process id, also the id of the main thread; at least 10 apart in one container or host
            for processes that run at the same time, since threads have the ids that follow.
        nodes: created in this order.
        start_ns: when it starts, after the begin of tracing.
        executors: its executors.
        stop_ns: when it ends; None: after the end of tracing. A process that ends frees its id,
            so that another life of it may follow, at the same addresses.
        is_killed: it ends at once, in the middle of whatever it does.
        client_library: 'rclcpp', 'rclpy', which has no events of its own, or 'traced_rclpy': its
            callbacks and executors have those of rclcpp (msgflow record).
        starved_ns: period, and how long at its end none of its threads gets a CPU; one that runs
            already goes on.
        threads_from: threads other than the main one have ids above this; the process id if None.
        container: the container of its host that it runs in, which numbers processes by itself.
        priority: of its threads, as the kernel has it: 0 to 99 real-time (less is more urgent), 100
            to 139 nice -20 to 19. It counts where the kernel is traced; likewise `cpus`.
        cpus: on which its threads may run; on all if there are none.
        readers: topics of ROS that it reads with DDS alone, where it has no nodes.
    """

    name: str
    hostname: str
    pid: int
    nodes: tuple[Node, ...]
    start_ns: int = 0
    executors: tuple[Executor, ...] = (Executor(),)
    stop_ns: int | None = None
    is_killed: bool = False
    client_library: str = "rclcpp"
    starved_ns: tuple[int, int] = (0, 0)
    threads_from: int | None = None
    container: str = ""
    priority: int = field(default=120, repr=False)
    cpus: tuple[int, ...] = field(default=(), repr=False)
    readers: tuple[str, ...] = field(default=(), repr=False)

    def tid(self, number: int) -> int:
        """Id of a thread; number 0 is the main one."""
        if number == 0 or self.threads_from is None:
            return self.pid + number
        return self.threads_from + number


@dataclass(frozen=True, slots=True)
class Load:
    """A thread of a process without ROS that computes for `busy_ns`, every `period_ns`.

    Attributes:
        name: of it, 15 characters at most.
        tid: its number.
        priority: as of a process; likewise `cpus`.
        start_ns: when it does so first.
    """

    name: str
    tid: int
    period_ns: int
    busy_ns: int
    priority: int = 120
    cpus: tuple[int, ...] = ()
    start_ns: int = 0


@dataclass(frozen=True, slots=True)
class KernelTrace:
    """A trace of the kernel's scheduling, beside that of ROS.

    Attributes:
        loads: what else runs on the host.
        has_ids: it tells the ids of threads when they are created.
        losses: all CPUs lose what the kernel does between these times, and count it.
    """

    loads: tuple[Load, ...] = ()
    has_ids: bool = True
    losses: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True, slots=True)
class Host:
    """A machine with a boot of its own, and a clock.

    Attributes:
        hostname: its name.
        cpu_count: how many threads run at the same time.
        clock_offset_ns: how far ahead its clock is at the begin.
        clock_drift_ppm: by how many parts per million it runs too fast.
        boot: name of the machine, where this is one of several containers on it: they share its
            clock, so that offset and drift are those of the first of them.
        stamp_resolution_ns: what source stamps are a multiple of: a coarse clock gives messages
            that follow each other closely the same stamp.
        recording: how it is recorded; None: as the scenario says.
        publish_pace: how long a publication takes from layer to layer, as a share of the usual.
        recorded_as: hostname that its trace shows, and the truth; its own if empty.
        kernel: its kernel is traced as well; None: it is not.
    """

    hostname: str
    cpu_count: int = 4
    clock_offset_ns: int = 0
    clock_drift_ppm: float = 0.0
    boot: str = ""
    stamp_resolution_ns: int = 1
    recording: Recording | None = None
    publish_pace: float = 1.0
    recorded_as: str = ""
    kernel: KernelTrace | None = field(default=None, repr=False)


@dataclass(frozen=True, slots=True)
class Scenario:
    """A whole system and how long it is traced.

    Attributes:
        name: name by which it is asked for.
        description: one sentence.
        hosts: its hosts.
        processes: its processes, on these hosts.
        duration_ns: length of the trace for factor 1.
        layout: name of the trace layout, see `msgflow_sim.layout`.
        overwrites: a full queue drops its oldest message (keep last); when false, queues hold
            whatever comes, so that every message is delivered.
        recording: how its traces are recorded.
        draws_like: name of the scenario that it is a change of: both have the same random numbers.
    """

    name: str
    description: str
    hosts: tuple[Host, ...]
    processes: tuple[Process, ...]
    duration_ns: int = 10 * SECOND
    layout: str = "jazzy"
    overwrites: bool = False
    recording: Recording = PERFECT
    draws_like: str = field(default="", repr=False)

    def __post_init__(self) -> None:
        hostnames = {host.hostname for host in self.hosts}
        if not self.hosts or len(hostnames) != len(self.hosts):
            raise UsageError(f"hosts need distinct names — scenario {self.name}")
        if bad := [name for name in hostnames if name in {"", ".", "..", "truth"} or "/" in name]:
            raise UsageError(f"cannot be the name of a host's folder — {bad[0]}")
        for process in self.processes:
            if process.hostname not in hostnames:
                raise UsageError(f"unknown host {process.hostname} — process {process.name}")
            for node in process.nodes:
                _check_topics(node)
                _check_links(node, process)
            _check_executors(process)
        _check_ids(self)

    @property
    def has_own_events(self) -> bool:
        """Whether callbacks record events of tracepoints of the user's own."""
        nodes = (node for process in self.processes for node in process.nodes)
        return any(isinstance(action, Record) for node in nodes for action in _actions(node))


def _actions(node: Node) -> list[Action]:
    callbacks: tuple[Subscription | Timer | Service | Client, ...] = (
        *node.subscriptions,
        *node.timers,
        *node.services,
        *node.clients,
    )
    return [action for each in callbacks for action in each.does]


def _check_ids(scenario: Scenario) -> None:
    """No thread has an id that another one has at the same time."""
    latest: dict[tuple[str, str, int], int | None] = {}
    for process in sorted(scenario.processes, key=lambda each: each.start_ns):
        for number in range(_THREADS_PER_PROCESS + 1):
            key = (process.hostname, process.container, process.tid(number))
            if key in latest:
                end = latest[key]
                if end is None or end >= process.start_ns:
                    raise UsageError(
                        f"process ids are too close on one host — scenario {scenario.name}"
                    )
            latest[key] = process.stop_ns


def _check_executors(process: Process) -> None:
    count = len(process.executors)
    used = {node.executor for node in process.nodes}
    used |= {group.executor or 0 for node in process.nodes for group in node.groups}
    if bad := sorted(number for number in used if not 0 <= number < count):
        raise UsageError(f"no executor {bad[0]} — process {process.name}")
    threads = sum(each.thread_count for each in process.executors if each.kind != "nested")
    if not 1 <= threads < _THREADS_PER_PROCESS:
        raise UsageError(f"a process has 1 to 8 threads of executors — process {process.name}")


def _check_links(node: Node, process: Process) -> None:
    publishers = {publisher.topic for publisher in node.publishers}
    created = {each.full_name: each for each in process.nodes[: process.nodes.index(node)]}
    for link in node.links:
        source = created.get(link.inputs_of) if link.inputs_of else node
        if source is None or (link.inputs_of and link.kind != "periodic_async"):
            raise UsageError(
                f"no node before {node.full_name} that fills its caches — {link.inputs_of}"
            )
        subscriptions = {each.topic: each for each in source.subscriptions}
        if missing := sorted({*link.inputs} - {*subscriptions}):
            raise UsageError(f"no subscription of {missing[0]} — node {source.full_name}")
        if missing := sorted({*link.outputs} - publishers):
            raise UsageError(f"no publisher of {missing[0]} — node {node.full_name}")
        if link.kind == "periodic_async":
            continue
        inputs = [subscriptions[topic] for topic in link.inputs]
        if any({*link.outputs} - {*each.publishes} for each in inputs):
            raise UsageError(
                f"whatever input comes last has to publish — {link.kind} of {node.full_name}"
            )


def _check_topics(node: Node) -> None:
    own = {publisher.topic for publisher in node.publishers}
    callbacks: tuple[Subscription | Timer | Service, ...] = (
        *node.subscriptions,
        *node.timers,
        *node.services,
    )
    actions = _actions(node)
    actions += [action for each in node.subscriptions for action in each.first]
    used = {topic for each in (*callbacks, *node.clients) for topic in each.publishes}
    used |= {action.topic for action in actions if isinstance(action, Publish)}
    if missing := sorted(used - own):
        raise UsageError(f"no publisher of {', '.join(missing)} — node {node.full_name}")
    clients = {client.service for client in node.clients}
    calls = {action.service for action in actions if isinstance(action, Call)}
    if missing := sorted(calls - clients):
        raise UsageError(f"no client of {', '.join(missing)} — node {node.full_name}")
    services = {service.name for service in node.services if service.is_answered_later}
    answers = {action.service for action in actions if isinstance(action, Answer)}
    if missing := sorted(answers ^ services):
        raise UsageError(f"a service that is answered later has one answer — {missing[0]}")
    known = {client.action for client in node.action_clients}
    goals = {action.action for action in actions if isinstance(action, SendGoal)}
    if missing := sorted(goals - known):
        raise UsageError(f"no action client of {', '.join(missing)} — node {node.full_name}")
    groups = {"", *(group.name for group in node.groups)}
    if missing := sorted({each.group for each in (*callbacks, *node.clients)} - groups):
        raise UsageError(f"no callback group {missing[0]} — node {node.full_name}")
