"""A recording session of LTTng that is ours: from its first event to its last packet."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path

from msgflow.errors import RecordingError, UsageError
from msgflow.files.temporary_owner import is_abandoned, mark, remove_abandoned_directories
from msgflow.record.lttng import is_daemon_running, lttng, sessions
from msgflow.trace.regular_file import read_regular

# Of ROS 2; of an instrumented DDS; of CARET; of Agnocast.
EVENTS = ("ros2:*", "dds:*", "ros2_caret:*", "agnocast:*")
"""The events that a recording has."""
CONTEXTS = ("vpid", "vtid", "procname")
NETWORK_EVENTS = ("net_dev_queue", "net_if_receive_skb")
"""Events of the kernel that tell when packets come and go."""
_CHANNEL = "ros2"
# In the directory of a recording while it is made: the mark of its process.
_OWNER = ".msgflow-record"
_MOST_BYTES = 100
TEMPORARY = "msgflow-watch-"
"""Begins the names of temporary directories beside recordings."""


@dataclass(frozen=True, slots=True)
class Channel:
    """How a session records events of programs."""

    events: tuple[str, ...] = EVENTS  # names, or patterns of them, such as `ros2:*`
    sub_buffer_size: str = "1M"  # of each CPU, in the words of LTTng, such as `1M`
    sub_buffers: int = 4  # their number
    # Length of the chunks that the recording is cut into; None: it is not.
    rotation_ns: int | None = None
    without: tuple[str, ...] = ()  # names of events, or patterns of them, that are left out
    contexts: tuple[str, ...] = CONTEXTS  # what each event has besides, in the words of LTTng
    is_per_process: bool = False  # each process has buffers of its own, else each user


@contextmanager
def recording_session(
    name: str, directory: Path, channel: Channel, *, of_kernel: Sequence[str] = ()
) -> Iterator[None]:
    """Record into a directory during the block; afterwards everything is written.

    `of_kernel` are events of the kernel.
    """
    owner = directory / _OWNER
    try:
        owner.write_text(mark())
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise RecordingError(
            f"cannot write to {directory}: {reason}", "another directory: -o DIR"
        ) from None
    try:
        lttng("create", name, f"--output={directory}")
    except RecordingError:
        owner.unlink()
        raise
    try:
        _set_up("--userspace", name, channel)
        contexts = [f"--type={context}" for context in channel.contexts]
        lttng("add-context", *_to_channel("--userspace", name), *contexts)
        if of_kernel:
            # All in one call.
            events = (",".join(of_kernel),)
            _set_up("--kernel", name, replace(channel, events=events, without=()))
        if channel.rotation_ns is not None:
            _rotate(name, channel.rotation_ns)
        lttng("start", name)
        yield
    finally:
        # It stops the session, and waits until all is written. Where it fails, the owner stays
        # named: the next recording removes the session.
        if is_there(name):
            lttng("destroy", name)
        owner.unlink(missing_ok=True)


@contextmanager
def rotated(name: str, length_ns: int) -> Iterator[Callable[[], None]]:
    """Let a session cut its recording into chunks during the block; one that does so goes on.

    The function of the block is to be called now and then: it starts the rotation anew if another
    program ended it. A session with a live connection and a snapshot session cannot rotate.
    """
    is_ours = _is_first_to_rotate(name, length_ns)

    def go_on() -> None:
        nonlocal is_ours
        # It may have ended.
        with suppress(RecordingError):
            is_ours = _is_first_to_rotate(name, length_ns) or is_ours

    try:
        yield go_on
    finally:
        if is_ours:
            with suppress(RecordingError):
                lttng("disable-rotation", f"--session={name}", "--timer")


def require_snapshot(name: str) -> None:
    """Refuse a name that no snapshot session has."""
    known = [session.name for session in sessions() if session.is_snapshot]
    if name not in known:
        raise RecordingError(
            f"LTTng has no snapshot session of this name — {name}",
            f"one of: {', '.join(known)}" if known else "lttng create --snapshot makes one",
        )


def record_snapshot(name: str, directory: Path) -> None:
    """Write what a snapshot session has in its buffers into a new directory."""
    lttng("snapshot", "record", f"--session={name}", f"file://{directory}")


def remove_leftovers() -> list[str]:
    """Remove directories and sessions that killed recordings left; return the sessions' names."""
    left = [session for session in sessions() if _is_left(session.directory)]
    for session in left:
        lttng("destroy", session.name)
        assert session.directory is not None
        (session.directory / _OWNER).unlink()
    remove_abandoned_directories(TEMPORARY)
    return [session.name for session in left]


def is_there(name: str) -> bool:
    """Tell whether a session daemon runs that has a session of this name."""
    return is_daemon_running() and any(session.name == name for session in sessions())


def require_name(name: str) -> None:
    """Refuse a name that LTTng does not take."""
    if "/" in name or name.startswith("-"):
        raise UsageError(
            f"a session cannot have a name with a slash, or with - in front — {name}",
            "another --name; -o DIR names the directory",
        )
    # LTTng writes it as it is, and what it says is no XML then.
    if not name.isprintable():
        raise UsageError(
            f"a session cannot have a name with a control character — {name!r}", "another --name"
        )


def require_new(name: str) -> None:
    """Refuse the name of a session that exists."""
    if is_there(name):
        raise RecordingError(
            f"LTTng has a session of this name — {name}",
            f"choose another --name, or end that session: lttng destroy {shlex.quote(name)}",
        )


def can_trace_kernel() -> bool:
    """Tell whether the session daemon can trace the kernel."""
    try:
        lttng("list", "--kernel")
    except RecordingError:
        return False
    return True


def _set_up(domain: str, name: str, channel: Channel) -> None:
    sizes = (f"--subbuf-size={channel.sub_buffer_size}", f"--num-subbuf={channel.sub_buffers}")
    buffers = ("--buffers-pid",) if channel.is_per_process else ()
    lttng("enable-channel", domain, f"--session={name}", *sizes, *buffers, _CHANNEL)
    for event in channel.events:
        out = left_out(channel, event)
        without = [f"--exclude={','.join(out)}"] if out else []
        lttng("enable-event", *_to_channel(domain, name), *without, event)


def left_out(channel: Channel, event: str) -> list[str]:
    """Return what a channel leaves out of an event: LTTng refuses what that does not have."""
    return [each for each in channel.without if fnmatchcase(each, event)]


def _to_channel(domain: str, name: str) -> tuple[str, ...]:
    return domain, f"--session={name}", f"--channel={_CHANNEL}"


def _rotate(name: str, length_ns: int) -> None:
    lttng("enable-rotation", f"--session={name}", f"--timer={length_ns // 1000}us")


def _is_first_to_rotate(name: str, length_ns: int) -> bool:
    """Let a session rotate; return False if it rotates already."""
    try:
        _rotate(name, length_ns)
    except RecordingError as error:
        if "already set" not in error.message:
            raise
        return False
    return True


def _is_left(directory: Path | None) -> bool:
    if directory is None:
        return False
    try:
        # Sessions of others may write where a pipe of this name is.
        return is_abandoned(read_regular(directory / _OWNER, _MOST_BYTES).decode())
    except (OSError, UnicodeDecodeError):
        return False
