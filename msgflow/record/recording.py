"""Records a ROS 2 system: from the checks before to the last packet on the disk."""

from __future__ import annotations

import os
import shlex
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import IO, TYPE_CHECKING

from msgflow.errors import RecordingError, UsageError
from msgflow.record.cpu_time import DIRECTORY, recorded_cpu_time
from msgflow.record.daemon import session_daemon
from msgflow.record.event_cost import measure_event_cost
from msgflow.record.lttng import (
    has_wheel,
    is_daemon_running,
    process_with_library,
    ros_processes,
    sessions,
)
from msgflow.record.perf import KERNEL_EVENTS, recorded_samples, recorded_with_perf
from msgflow.record.program import (
    Program,
    require_program,
    with_python_functions,
    with_python_nodes,
)
from msgflow.record.remote import HOSTS, Place, fetched, sessions_on
from msgflow.record.session import (
    NETWORK_EVENTS,
    Channel,
    can_trace_kernel,
    record_snapshot,
    recording_session,
    remove_leftovers,
    require_name,
    require_new,
    require_snapshot,
)
from msgflow.record.system_samples import sampled
from msgflow.sql.interrupt import noted_interrupts, until_interrupted
from msgflow.trace.ctf.packet_index import written

if TYPE_CHECKING:
    from msgflow.record.perf import Rate

BYTES_OF_EVENT = 45
"""The usual size of an event of ROS 2 with its contexts."""

_LEAST_FREE_BYTES = 100_000_000
# 100,000 events per second, for ten minutes.
_USUAL_BYTES_PER_SECOND = 100_000 * BYTES_OF_EVENT
_USUAL_SECONDS = 600.0
# Seconds.
_BETWEEN_LOOKS = 0.5
_BETWEEN_LOOKS_FOR_NODES = 5.0


@dataclass(frozen=True, slots=True)
class Status:
    """How a recording goes."""

    seconds: float  # since it began
    # Bytes of all events on the disk, without the clocks of threads; others are still in buffers.
    event_bytes: int
    discarded: int  # events for which the buffers were too small, as far as packets say so
    free_bytes: int  # of the disk


@dataclass(frozen=True, slots=True)
class Recorded:
    """What was recorded."""

    directory: Path
    last: Status  # how it was at the last look
    # Of the program that was recorded, if it ended by itself; None without one.
    exit_code: int | None
    # The session daemon of LTTng ended before the recording did: what was in buffers is missing.
    is_cut: bool
    hosts: dict[str, Path]  # where the recordings of other places are
    lost: tuple[str, ...]  # places whose recording did not come


def record(
    directory: Path,
    *,
    name: str,
    channel: Channel,
    program: Sequence[str] = (),
    log: Path | None = None,
    seconds: float | None = None,
    kernel: bool = False,
    snapshot: str | None = None,
    python: bool = True,
    profile: Rate | None = None,
    cpu_time: bool = True,
    places: Sequence[Place] = (),
    network: bool = False,
    note: Callable[[str], None],
    show: Callable[[Status], None],
) -> Recorded:
    """Record until Ctrl-C, until the program ends, or for some seconds; see `Database.record`.

    The directory must not exist, or be empty. `log` is a new file that gets what the program
    prints, if it prints anything; None is our stderr. `snapshot` is a snapshot session that has the
    initialisation of nodes that run already; what it has is written too. `python` also traces
    callbacks and executors of the program's nodes of rclpy. `cpu_time` also records the clocks of
    threads. `places` are where else to record. `network` also records when packets come and go.
    `note` gets sentences about what is wrong with the recording. `show` gets the status twice a
    second; what it raises ends the recording. After Ctrl-C or SIGTERM nothing of the
    recording stays but what is written.
    """
    if program:
        require_program(program[0])
    if not all(map(str.strip, (*channel.events, *channel.without))):
        raise UsageError("an event has no name", "--events 'my_pkg:*'")
    require_name(name)
    _require_room(directory, note, seconds)
    with noted_interrupts() as interrupts, ExitStack() as stack:
        stack.enter_context(session_daemon(with_kernel=kernel or network, note=note))
        for left in remove_leftovers():
            note(f"the session of a recording that was killed is removed: {left}")
        require_new(name)
        if snapshot is None:
            _note_running(note)
        else:
            require_snapshot(snapshot)
        elsewhere = stack.enter_context(sessions_on(places, name, channel, with_network=network))
        directory.mkdir(parents=True, exist_ok=True)
        if snapshot is not None:
            record_snapshot(snapshot, directory / "snapshot")
        # What is measured are events: other sessions would have them, too.
        if not sessions():
            measure_event_cost(directory, channel)
        of_kernel: list[str] = []
        if kernel or network:
            by_lttng = can_trace_kernel()
            if by_lttng:
                of_kernel = [
                    *(KERNEL_EVENTS if kernel else ()),
                    *(NETWORK_EVENTS if network else ()),
                ]
            elif network:
                note("network packets are not recorded here: they need LTTng's kernel modules")
            if kernel and not by_lttng:
                stack.enter_context(recorded_with_perf(directory, note))
        if profile is not None:
            samples = recorded_samples(directory, profile, is_ours=bool(program), note=note)
            stack.enter_context(samples)
        # A window of `watch` reads no samples, and goes on for as long as it likes.
        if channel.rotation_ns is None:
            stack.enter_context(sampled(directory, note))
        output = None
        if log is not None:
            output = stack.enter_context(_written(log))
            note(f"what {program[0]} prints goes to {log}")
        watch = _Watch(name, directory, channel, note, show, expects_nodes=bool(program))
        with ExitStack() as running:
            started = None
            clocks = recorded_cpu_time(name, directory, channel, note)
            with (
                # Clocks of all events: they begin before these, and end after them.
                clocks if cpu_time else nullcontext(),
                fetched(elsewhere, directory, note) as lost_places,
                recording_session(name, directory, channel, of_kernel=of_kernel),
            ):
                interrupts.check()
                if program:
                    environment = with_python_nodes(note) if python else dict(os.environ)
                    if profile is not None:
                        environment = with_python_functions(program, environment, note)
                    started = Program(program, output, environment)
                    # Behind the session: what happens while nodes end is not recorded.
                    running.callback(started.end, note)
                with until_interrupted():
                    while not watch.is_over(started, seconds):
                        interrupts.check()
                        lost_places()
                        time.sleep(_BETWEEN_LOOKS)
            ended_with = None if started is None else started.exit_code
        # All buffers are written now.
        if not directory.exists():
            raise _removed(directory)
        size, discarded = recorded_packets(directory)
        last = replace(watch.status, event_bytes=size, discarded=discarded)
    lost = lost_places()
    come = [place.name for place in places if place.name not in lost]
    hosts = {host: directory / HOSTS / host for host in come}
    return Recorded(directory, last, ended_with, watch.is_cut, hosts, tuple(lost))


@contextmanager
def _written(log: Path) -> Iterator[IO[bytes]]:
    """Yield the file while a program may write to it; an empty one does not stay."""
    try:
        # Nothing that is there is touched, also not what a link leads to.
        stream = log.open("xb")
    except OSError as error:
        raise RecordingError(
            f"cannot write {log}: {(error.strerror or str(error)).lower()}", "another place: -o DIR"
        ) from None
    with stream:
        try:
            yield stream
        finally:
            # The program may have moved it, and put something else there.
            with suppress(OSError):
                found = log.lstat()
                is_ours = os.path.samestat(found, os.fstat(stream.fileno()))
                if is_ours and not found.st_size:
                    log.unlink()


@dataclass
class _Watch:
    """Looks at a recording that runs, and says what goes wrong as soon as it does."""

    name: str
    directory: Path
    channel: Channel
    note: Callable[[str], None]
    show: Callable[[Status], None]
    expects_nodes: bool
    has_failed: bool = False
    is_cut: bool = False
    begin: float = field(default_factory=time.monotonic)
    # Seconds after which nodes are looked for.
    next_look: float = _BETWEEN_LOOKS_FOR_NODES
    loaded_by: int | None = None  # process with the library of tracepoints at the latest look

    def __post_init__(self) -> None:
        self.status = Status(0.0, 0, 0, shutil.disk_usage(self.directory).free)

    def is_over(self, program: Program | None, seconds: float | None) -> bool:
        """Look, and tell whether the recording has to end."""
        try:
            if not is_daemon_running():
                self.is_cut = True
                self.note(
                    "the session daemon of LTTng ended: the recording ends here, and what was in"
                    " buffers is missing"
                )
                return True
            if all(session.name != self.name for session in sessions()):
                self.note(
                    f"the session {self.name} was destroyed by another program: the recording ends"
                    " here"
                )
                return True
            self._look()
        except FileNotFoundError:
            raise _removed(self.directory) from None
        except RecordingError as error:
            # The recording goes on all the same: LTTng writes it.
            if not self.has_failed:
                self.note(f"not everything about the recording is known: {error.message}")
            self.has_failed = True
        if self.status.free_bytes < _LEAST_FREE_BYTES:
            self.note("the disk is full: the recording ends here; remove files, or use -o DIR")
            return True
        if program is not None and program.exit_code is not None:
            return True
        return seconds is not None and self.status.seconds >= seconds

    def _look(self) -> None:
        before = self.status
        passed = time.monotonic() - self.begin
        free = shutil.disk_usage(self.directory).free
        # Not by lttng list NAME: LTTng 2.13 dies of that where a session leaves events out.
        size, discarded = recorded_packets(self.directory)
        self.status = Status(passed, size, discarded, free)
        self.show(self.status)
        if self.status.discarded and not before.discarded:
            self.note(
                "events are being discarded, the buffers are too small: record again with a"
                f" --subbuf-size several times as large as {self.channel.sub_buffer_size}"
            )
        if self.expects_nodes and passed >= self.next_look:
            self._look_for_nodes(passed)
            self.next_look += _BETWEEN_LOOKS_FOR_NODES

    def _look_for_nodes(self, passed: float) -> None:
        """Tell nodes that are starting, which may take long, from nodes without tracepoints."""
        before, self.loaded_by = self.loaded_by, process_with_library()
        if ros_processes():
            self.expects_nodes = False
        elif self.loaded_by is None:
            if self.next_look == _BETWEEN_LOOKS_FOR_NODES:
                self.note(
                    f"after {passed:.0f} s no process has the tracepoints of ROS 2: nodes are still"
                    " starting, or none is"
                )
        # One that has just loaded it has not told LTTng yet.
        elif self.loaded_by == before:
            self.expects_nodes = False
            self.note(
                f"process {before} has tracepoints of a wheel of PyPI, which cannot be recorded: in"
                " a checkout of msgflow, python benchmarks/recording/tracetools.py DIR builds"
                " others, for LD_PRELOAD=DIR/libtracetools.so (docs/record.md)"
                if has_wheel(before)
                else f"process {before} uses ROS 2 without tracepoints: is tracing built in (ros2"
                " run tracetools status)?"
            )


def recorded_packets(directory: Path) -> tuple[int, int]:
    """Return the bytes of all packets of events, without what only fills them up, and losses."""
    clocks = directory / DIRECTORY
    # A chunk of it may go away meanwhile: unlike others, this walk goes on.
    found = [
        written(Path(folder, name))
        for folder, _, names in os.walk(directory)
        for name in names
        if name.endswith(".idx") and not Path(folder).is_relative_to(clocks)
    ]
    return sum(size for size, _ in found), sum(lost for _, lost in found)


def _removed(directory: Path) -> RecordingError:
    return RecordingError(
        f"the directory of the recording was removed — {directory}",
        "record into another one (-o DIR), which no program removes",
    )


def _require_room(directory: Path, note: Callable[[str], None], seconds: float | None) -> None:
    try:
        if os.path.lexists(directory) and (not directory.is_dir() or any(directory.iterdir())):
            raise RecordingError(f"the directory is in use — {directory}", "another one: -o DIR")
        existing = next(
            path for path in (directory, *directory.absolute().parents) if path.exists()
        )
    except PermissionError as error:
        raise RecordingError(
            f"cannot write to {directory}: permission denied: {error.filename}",
            "another directory: -o DIR",
        ) from None
    if not existing.is_dir() or not os.access(existing, os.W_OK | os.X_OK):
        reason = "permission denied" if existing.is_dir() else "no directory"
        raise RecordingError(
            f"cannot write to {directory}: {reason}: {existing}", "another directory: -o DIR"
        )
    free = shutil.disk_usage(existing).free
    if free < _LEAST_FREE_BYTES:
        raise RecordingError(
            f"the disk of {existing} is full: {free / 1e6:.0f} MB are free",
            "remove files, or name a directory on another disk: -o DIR",
        )
    needed = _USUAL_BYTES_PER_SECOND * (_USUAL_SECONDS if seconds is None else seconds)
    if free < needed:
        note(
            f"{free / 1e9:.1f} GB are free on the disk of {existing}: a robot with 100,000 events"
            f" per second fills them in {free / _USUAL_BYTES_PER_SECOND / 60:.0f} min"
        )


def _note_running(note: Callable[[str], None]) -> None:
    try:
        running = ros_processes()
    except RecordingError as error:
        note(f"it is not known what runs already: {error.message}")
        return
    if running:
        command, pid = running[0]
        others = f" and {len(running) - 1} more" if len(running) > 1 else ""
        kept = next((session.name for session in sessions() if session.is_snapshot), None)
        cure = (
            "begin to record before they start"
            if kept is None
            else f"--dual {shlex.quote(kept)} has them"
        )
        note(
            f"{command} ({pid}){others} of ROS 2 run already: the names of their nodes and topics"
            f" are not recorded; {cure}"
        )
