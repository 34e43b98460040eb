"""Engine of the simulation: builds hosts and processes, lets time pass, writes traces and truth."""

from __future__ import annotations

import json
import shutil
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING
from uuid import UUID

from msgflow.errors import UsageError
from msgflow_sim.creation import PARAMETER_EVENTS
from msgflow_sim.ctf import TraceIdentity
from msgflow_sim.discovery import Discovery
from msgflow_sim.entity import SECOND
from msgflow_sim.host_clock import HostClock
from msgflow_sim.kernel import Kernel
from msgflow_sim.layout import layouts
from msgflow_sim.load_thread import LoadThread
from msgflow_sim.machine import Machine, RunningProcess
from msgflow_sim.recorder import Recorder
from msgflow_sim.scenario import scenarios
from msgflow_sim.scheduler import Scheduler
from msgflow_sim.services import ServiceNetwork
from msgflow_sim.startup import Startup
from msgflow_sim.system import Process
from msgflow_sim.transport import Middleware
from msgflow_sim.truth import Truth

if TYPE_CHECKING:
    from msgflow_sim.layout import Layout
    from msgflow_sim.recording import Recording
    from msgflow_sim.system import Host, Scenario

# 2025-03-14 09:26:53.589793238 UTC: when every simulated trace begins.
_EPOCH_NS = 1_741_944_413_589_793_238
_SHORTEST_UPTIME_NS = 3600 * SECOND
_STOP_DELAY_NS = 2_000_000
_FASTEST_DRIFT_PPM = 1_000


@dataclass(frozen=True, slots=True)
class Simulation:
    """What a simulation has written.

    Attributes:
        directory: holds one folder per host and `truth`.
        trace_directories: the CTF traces in the order of the scenario's hosts, as a rule one of
            each.
        event_count: events in all traces.
        truth: name of each truth table and its Parquet file.
        meta: JSON file with what was simulated, and counts.
    """

    directory: Path
    trace_directories: tuple[Path, ...]
    event_count: int
    truth: Mapping[str, Path]
    meta: Path


def simulate(
    scenario: str | Scenario,
    directory: Path | str,
    *,
    factor: float = 1.0,
    seed: int = 0,
    clock_offset_ns: int = 0,
    clock_drift_ppm: float = 0.0,
    layout: str | None = None,
    recording: Recording | None = None,
) -> Simulation:
    """Simulate a ROS 2 system and write its traces and the truth about them.

    The same arguments give the same bytes.

    Args:
        scenario: name of a built-in one, or one of your own.
        directory: where to write; it may exist if it is empty.
        factor: multiplies the scenario's duration.
        seed: of everything that is random.
        clock_offset_ns: each host's clock is this much ahead of that of the host before it, in
            addition to what the scenario says.
        clock_drift_ppm: each host's clock runs this much faster than that of the host before it,
            likewise.
        layout: name of a layout, see `layouts()`; that of the scenario if None.
        recording: how it is recorded; as the scenario says if None.

    Raises:
        UsageError: unknown scenario or layout, factor not positive, directory not empty, or one
            that cannot be written: it is then as it was before.
    """
    chosen = _choose(scenario, layout, recording)
    if not 0 < factor < float("inf"):
        raise UsageError(f"the factor must be a positive number — {factor}")
    with _filled(Path(directory)) as target:
        return _simulate(chosen, target, factor, seed, clock_offset_ns, clock_drift_ppm)


def _simulate(
    chosen: Scenario,
    target: Path,
    factor: float,
    seed: int,
    clock_offset_ns: int,
    clock_drift_ppm: float,
) -> Simulation:
    # The course of events depends on that name and the seed only: a longer run begins like a
    # shorter one. Yet traces that differ in anything never pass for the same.
    course = f"{chosen.draws_like or chosen.name}/{seed}"
    identity = f"{chosen!r}/{seed}/{factor!r}/{clock_offset_ns}/{clock_drift_ppm!r}"
    identity += "".join(f"/{host.kernel!r}" for host in chosen.hosts if host.kernel is not None)
    length = int(chosen.duration_ns * factor)
    truth = Truth(target / "truth")
    for event in _layout(chosen).events:
        for field in event.fields or (None,):
            truth.declared.add(event.name, None if field is None else field.name)
    scheduler = Scheduler(course, truth)
    machines = {
        host.hostname: _machine(chosen, host, clock, target, identity, truth, length)
        for host, clock in zip(
            chosen.hosts, _clocks(chosen.hosts, clock_offset_ns, clock_drift_ppm), strict=True
        )
    }
    middleware = Middleware(
        scheduler, overwrites=chosen.overwrites, expected=_subscriptions(chosen)
    )
    network = ServiceNetwork(scheduler)
    processes = _start(chosen, scheduler, machines, middleware, network, course)
    loads = [*_loads(chosen, scheduler, machines, course)]
    scheduler.run(length, middleware.arrive)

    for process in processes:
        for thread in process.threads:
            thread.finish()
    for load in loads:
        load.finish()
    network.finish()
    middleware.finish()
    end = scheduler.end + _STOP_DELAY_NS
    for machine in machines.values():
        machine.recorder.close(end)
        if machine.kernel is not None:
            machine.recorder.write_kernel(machine.kernel, end)
    truth.close()
    meta = target / "truth" / "meta.json"
    _write_meta(
        meta,
        chosen,
        {
            "seed": seed,
            "factor": factor,
            "clock_offset_ns": clock_offset_ns,
            "clock_drift_ppm": clock_drift_ppm,
        },
        machines,
        truth,
        {
            "length_ns": end,
            "failed_takes": middleware.failed_takes,
            "full_queues": middleware.full_queues,
            "undelivered": middleware.undelivered,
        },
    )
    return Simulation(
        directory=target,
        trace_directories=tuple(
            path for machine in machines.values() for path in machine.recorder.directories
        ),
        event_count=sum(
            sum(machine.tracepoints.counts().values()) for machine in machines.values()
        ),
        truth={name: table.path for name, table in truth.tables.items()},
        meta=meta,
    )


def _choose(scenario: str | Scenario, layout: str | None, recording: Recording | None) -> Scenario:
    known = scenarios()
    if isinstance(scenario, str):
        if scenario not in known:
            raise UsageError(f"unknown scenario — {scenario}", f"choose one of {', '.join(known)}")
        scenario = known[scenario]
    if layout is not None:
        scenario = replace(scenario, layout=layout)
    if recording is not None:
        scenario = replace(scenario, recording=recording)
    if scenario.layout not in layouts():
        raise UsageError(
            f"unknown layout — {scenario.layout}", f"choose one of {', '.join(layouts())}"
        )
    return scenario


def _layout(scenario: Scenario) -> Layout:
    """The layout of its traces, which have the user's own events only where there are any."""
    layout = layouts()[scenario.layout]
    return layout.with_own_events() if scenario.has_own_events else layout


def _start(
    scenario: Scenario,
    scheduler: Scheduler,
    machines: Mapping[str, Machine],
    middleware: Middleware,
    network: ServiceNetwork,
    course: str,
) -> list[RunningProcess]:
    """Plan the start and the end of every process."""
    discovery = Discovery()
    version = layouts()[scenario.layout].version
    processes = []
    lives: Counter[tuple[str, str, int]] = Counter()
    for number, description in enumerate(scenario.processes):
        machine = machines[description.hostname]
        place = (description.hostname, description.container, description.pid)
        # Processes with equal ids in containers of one machine have addresses of their own.
        name = description.hostname if machine.hostname != description.hostname else ""
        seed = f"{course}{name}{description.container}"
        process = RunningProcess(scheduler, machine, description, number, seed, lives[place])
        lives[place] += 1
        startup = Startup(process, middleware, discovery, network, version)
        scheduler.at(description.start_ns, startup.begin)
        if description.stop_ns is not None:
            scheduler.at(description.stop_ns, startup.end)
        processes.append(process)
    return processes


def _loads(
    scenario: Scenario, scheduler: Scheduler, machines: Mapping[str, Machine], course: str
) -> Iterator[LoadThread]:
    """Let everything else that is to run on the hosts do so."""
    for host in scenario.hosts:
        for load in () if host.kernel is None else host.kernel.loads:
            description = Process(
                load.name, host.hostname, load.tid, (), priority=load.priority, cpus=load.cpus
            )
            process = RunningProcess(
                scheduler, machines[host.hostname], description, load.tid, course
            )
            thread = LoadThread(process, load)
            thread.begin(load.start_ns, thread.work())
            yield thread


def _subscriptions(scenario: Scenario) -> Counter[str]:
    """How many subscriptions of each topic there will be."""
    expected: Counter[str] = Counter()
    for process in scenario.processes:
        for node in process.nodes:
            expected.update(subscription.route for subscription in node.subscriptions)
            expected[PARAMETER_EVENTS] += process.client_library == "rclcpp"
    return expected


@contextmanager
def _filled(directory: Path) -> Iterator[Path]:
    """Make an empty directory to write to; what did not become complete is removed again."""
    is_new = not directory.exists()
    if not is_new and (not directory.is_dir() or any(directory.iterdir())):
        raise UsageError(
            f"not an empty directory — {directory}", "name a directory that does not exist yet"
        )
    try:
        directory.mkdir(parents=True, exist_ok=True)
        yield directory
    except BaseException as error:
        for entry in [directory] if is_new else [*directory.iterdir()]:
            shutil.rmtree(entry, ignore_errors=True)
        if isinstance(error, OSError):
            raise UsageError(
                f"cannot write the trace ({error.strerror or error}) — {directory}",
                "name a directory on a disk with room: -o DIR",
            ) from error
        raise


def _clocks(hosts: Sequence[Host], offset_ns: int, drift_ppm: float) -> list[HostClock]:
    """The clock of each host; containers of one machine have the same."""
    clocks: dict[str, HostClock] = {}
    for index, host in enumerate(hosts):
        drift = host.clock_drift_ppm + index * drift_ppm
        if not abs(drift) < _FASTEST_DRIFT_PPM:
            raise UsageError(f"no clock runs {drift} ppm too fast", "give less than 1000 ppm")
        clocks.setdefault(
            host.boot or f"host {host.hostname}",
            HostClock(_EPOCH_NS + host.clock_offset_ns + index * offset_ns, round(drift * 1000)),
        )
    return [clocks[host.boot or f"host {host.hostname}"] for host in hosts]


def _machine(
    scenario: Scenario,
    host: Host,
    clock: HostClock,
    target: Path,
    identity_key: str,
    truth: Truth,
    length: int,
) -> Machine:
    recording = host.recording or scenario.recording
    digest = sha256(f"{identity_key}/{host.hostname}".encode()).digest()
    boot = sha256(f"{identity_key}/{host.boot}".encode()).digest() if host.boot else digest
    identity = TraceIdentity(
        session=scenario.name,
        hostname=host.recorded_as or host.hostname,
        uuid=UUID(bytes=digest[:16], version=4),
        boot_uuid=UUID(bytes=boot[16:], version=4),
        epoch_ns=clock.epoch_ns,
        # Up to about thirteen days, so that hosts count from quite different values.
        uptime_ns=_SHORTEST_UPTIME_NS + int.from_bytes(boot[:7], "little") % 2**50,
    )
    recorder = Recorder(
        target / host.hostname,
        _layout(scenario),
        identity,
        host.cpu_count,
        recording,
        truth,
        clock,
        length,
    )
    return Machine(
        identity.hostname,
        clock,
        recorder,
        recording,
        host.stamp_resolution_ns,
        host.publish_pace,
        None if host.kernel is None else Kernel(host.kernel, host.cpu_count),
    )


def _write_meta(
    path: Path,
    scenario: Scenario,
    arguments: Mapping[str, object],
    machines: Mapping[str, Machine],
    truth: Truth,
    outcome: Mapping[str, object],
) -> None:
    """Write `meta.json`; see the docstring of `msgflow_sim`."""
    content = {
        "scenario": scenario.name,
        "description": scenario.description,
        "layout": scenario.layout,
        **arguments,
        "hosts": {
            name: {
                "traces": [
                    str(directory.relative_to(path.parent.parent))
                    for directory in machine.recorder.directories
                ],
                "begin_of_tracing_ns": 0 + machine.epoch,
                "clock_drift_ppb": machine.epoch.drift_ppb,
                "cpu_count": machine.recorder.cpu_count,
                "events": dict(machine.tracepoints.counts()),
            }
            for name, machine in machines.items()
        },
        "processes": [
            {
                "host": process.hostname,
                "pid": process.pid,
                "name": process.name,
                "nodes": [node.full_name for node in process.nodes],
            }
            for process in scenario.processes
        ],
        "rows": {name: table.count for name, table in truth.tables.items()},
        **outcome,
    }
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
