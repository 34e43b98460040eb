"""The program `lttng`: what it says, through its machine interface."""

from __future__ import annotations

import re
import shlex
import subprocess
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from msgflow.errors import RecordingError

# What lttng says where no session daemon runs.
_NO_DAEMON = "No session daemon is available"
# Seconds.
_LONGEST = 60.0
_NOT_XML = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


@dataclass(frozen=True, slots=True)
class Session:
    """A recording session of the session daemon."""

    name: str  # unique in the daemon
    # Where it writes; None where it writes over the network or keeps a snapshot.
    directory: Path | None
    is_snapshot: bool  # it keeps the last events in memory, and writes them when asked


def lttng(*arguments: str) -> ElementTree.Element:
    """Run `lttng` with the arguments and return what it says; it never starts a daemon."""
    command = ["lttng", "--no-sessiond", "--mi", "xml", *arguments]
    try:
        # Ctrl-C of the terminal must not end it: what it began would stay.
        run = subprocess.run(
            command,
            capture_output=True,
            text=True,
            errors="replace",
            start_new_session=True,
            timeout=_LONGEST,
        )
    except subprocess.TimeoutExpired:
        raise RecordingError(
            f"lttng {arguments[0]} does not end: a process with tracepoints does not answer",
            "lttng list --userspace shows these processes",
        ) from None
    except FileNotFoundError:
        raise RecordingError("lttng is not installed", "apt-get install lttng-tools") from None
    if run.returncode:
        text = (run.stderr or run.stdout).strip().splitlines()
        reason = next((line for line in text if "Error" in line), "no reason given")
        raise RecordingError(
            f"lttng {arguments[0]} failed: {reason.removeprefix('Error: ').rstrip('.')}",
            shlex.join(["lttng", *arguments]),
        )
    try:
        # A process may have any name, and lttng writes it as it is.
        return ElementTree.fromstring(_NOT_XML.sub("\ufffd", run.stdout))
    except ElementTree.ParseError as error:
        raise RecordingError(
            f"cannot read what lttng {arguments[0]} says: {error}",
            shlex.join(["lttng", *arguments]),
        ) from None


def is_daemon_running() -> bool:
    """Tell whether a session daemon answers; it may be that of the root user."""
    try:
        lttng("list")
    except RecordingError as error:
        if _NO_DAEMON in error.message:
            return False
        raise
    return True


def sessions() -> list[Session]:
    """Return all recording sessions of the daemon."""
    return [
        Session(
            _text(session, "name"),
            Path(path) if (path := _text(session, "path")).startswith("/") else None,
            _text(session, "snapshot_mode") == "1",
        )
        for session in lttng("list").iterfind(".//{*}session")
    ]


def ros_processes() -> list[tuple[str, int]]:
    """Return the processes with tracepoints of ROS 2: command line and pid of each."""
    found = []
    for process in lttng("list", "--userspace").iterfind(".//{*}pid"):
        names = [_text(event, "name") for event in process.iterfind(".//{*}event")]
        name = _text(process, "name")
        # LTTng's own programs have what a user preloads for the nodes.
        if not name.startswith("lttng-") and any(each.startswith("ros2:") for each in names):
            found.append((name, int(_text(process, "id"))))
    return found


def process_with_library() -> int | None:
    """Return a process that has loaded the library with the tracepoints of ROS 2, if any has."""
    for maps in Path("/proc").glob("[0-9]*/maps"):
        # It ends meanwhile, or belongs to another user.
        with suppress(OSError):
            if "/libtracetools.so" in maps.read_text(errors="replace"):
                return int(maps.parent.name)
    return None


def has_wheel(process: int) -> bool:
    """Tell whether the tracepoints of a process are of a wheel of PyPI.

    It brings an LTTng of its own, whose name has a hash: no session daemon of today knows it.
    """
    with suppress(OSError):
        maps = Path(f"/proc/{process}/maps").read_text(errors="replace")
        return re.search(r"/liblttng-ust-[0-9a-f]{8}\.so", maps) is not None
    return False


def _text(element: ElementTree.Element, name: str) -> str:
    found = element.find(f"{{*}}{name}")
    return "" if found is None else found.text or ""
