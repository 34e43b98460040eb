"""Recordings on other machines and in containers, by ssh, docker or podman."""

from __future__ import annotations

import re
import select
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from msgflow.errors import MsgflowError, RecordingError, UsageError
from msgflow.record.session import NETWORK_EVENTS, Channel, left_out
from msgflow.trace.extraction import unpack

HOSTS = "hosts"
"""Folder of a recording, with a folder for each other place."""

_CONTAINER = "container:"
# What ssh, docker or a shell could take for something else is no name.
_NAME = re.compile(r"(?:[A-Za-z0-9_][\w.-]*@)?[A-Za-z0-9_][\w.:-]*", re.ASCII)
_EVENT = re.compile(r"[!-~]+")
# It does not ask for a password, and notices when a machine goes away.
_SSH = (
    "ssh",
    "-T",
    "-oBatchMode=yes",
    "-oConnectTimeout=10",
    "-oServerAliveInterval=5",
    "-oServerAliveCountMax=3",
)
# Seconds.
_LONGEST_START = 60.0
_LONGEST_END = 20.0


@dataclass(frozen=True, slots=True)
class Place:
    """Where else to record: a machine of ssh, or a container of this machine."""

    name: str  # of the machine, without a user, or of the container
    target: str  # what ssh, docker or podman get
    is_container: bool

    @property
    def command(self) -> list[str]:
        """What runs the script there; the script's text is all that a shell reads."""
        script = Path(__file__).with_name("remote_session.sh").read_text()
        if not self.is_container:
            return [*_SSH, "--", self.target, shlex.join(["sh", "-c", script])]
        return [_engine(self.target), "exec", "--interactive", self.target, "sh", "-c", script]

    @property
    def cure(self) -> str:
        """What to try by hand where it fails."""
        if self.is_container:
            return f"docker exec {self.target} lttng --version has to work"
        return f"ssh {self.target} lttng --version has to work without a password"


def read_places(texts: Sequence[str]) -> list[Place]:
    """Return the places of words like `robot`, `user@robot` and `container:NAME`."""
    places: list[Place] = []
    for text in texts:
        target = text.removeprefix(_CONTAINER)
        if not _NAME.fullmatch(target):
            raise UsageError(
                f"not a machine of ssh, nor a container — {text!r}",
                f"--on robot, --on user@robot, or --on {_CONTAINER}NAME; ports and keys stand in"
                " ~/.ssh/config",
            )
        is_container = text.startswith(_CONTAINER)
        name = target if is_container else target.rpartition("@")[2]
        if any(place.name == name for place in places):
            raise UsageError(f"two places have one name — {name}", "each --on once")
        places.append(Place(name, target, is_container))
    return places


@contextmanager
def sessions_on(
    places: Sequence[Place], name: str, channel: Channel, *, with_network: bool
) -> Iterator[list[RemoteSession]]:
    """Record at all places; whatever ends the block or this process, no session stays there."""
    lines = _instructions(name, channel, with_network=with_network)
    with ExitStack() as stack:
        sessions = [stack.enter_context(_connected(place, lines)) for place in places]
        for session in sessions:
            session.wait_for_start()
        yield sessions


@contextmanager
def fetched(
    sessions: Sequence[RemoteSession], directory: Path, note: Callable[[str], None]
) -> Iterator[Callable[[], list[str]]]:
    """End sessions when the block ends, and write each recording below `hosts` of a directory.

    The function of the block returns the places whose recording is lost, also when the block has
    ended; `note` gets a sentence for each of them at once.
    """

    def lose(name: str, reason: str) -> None:
        lost.append(name)
        note(f"the recording on {name} is lost: {reason}")

    def look() -> list[str]:
        for session in sessions:
            name = session.place.name
            if not is_over and name not in lost and session.process.poll() is not None:
                lose(name, session.reason())
        return lost

    lost: list[str] = []
    is_over = False
    try:
        yield look
    finally:
        is_over = True
        # All at one time, before the first of them is fetched.
        for session in sessions:
            session.say(["stop"])
    for session in sessions:
        name = session.place.name
        if name in lost:
            continue
        try:
            session.fetch(directory / HOSTS / name)
        except MsgflowError as error:
            lose(name, error.message)
        except OSError as error:
            lose(name, (error.strerror or str(error)).lower())
        for sentence in session.notes():
            note(f"{name}: {sentence}")


@dataclass(frozen=True, slots=True)
class RemoteSession:
    """A session at a place."""

    place: Place
    process: subprocess.Popen[bytes]
    words: IO[bytes]  # what it says on stderr

    def say(self, lines: Sequence[str]) -> None:
        """Write lines to it; what has ended does not listen."""
        assert self.process.stdin is not None
        with suppress(BrokenPipeError):
            self.process.stdin.write("".join(f"{line}\n" for line in lines).encode())
            self.process.stdin.flush()

    def wait_for_start(self) -> None:
        """Wait until it records."""
        assert self.process.stdout is not None
        ready, _, _ = select.select([self.process.stdout], [], [], _LONGEST_START)
        if ready and self.process.stdout.readline() == b"started\n":
            return
        reason = self.reason() if ready else f"it does not answer after {_LONGEST_START:.0f} s"
        raise RecordingError(f"cannot record on {self.place.name}: {reason}", self.place.cure)

    def fetch(self, directory: Path) -> None:
        """Write the recording into a new directory; none stays if it did not come whole."""
        assert self.process.stdout is not None
        archive = directory.with_name(f"{directory.name}.tar")
        directory.parent.mkdir(exist_ok=True)
        try:
            with archive.open("xb") as file:
                shutil.copyfileobj(self.process.stdout, file)
            if self.process.wait():
                raise RecordingError(self.reason(), self.place.cure)
            directory.mkdir()
            unpack(archive, directory)
            if not any(directory.rglob("metadata")):
                raise RecordingError("no process there has tracepoints", self.place.cure)
        except BaseException:
            shutil.rmtree(directory, ignore_errors=True)
            raise
        finally:
            archive.unlink(missing_ok=True)

    def notes(self) -> list[str]:
        """Return what it says is wrong with the recording."""
        return [line.removeprefix("note: ") for line in self._said() if line.startswith("note: ")]

    def reason(self) -> str:
        """Return why it has ended, or ends."""
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(_LONGEST_END)
        said = self._said()
        errors = [line.removeprefix("Error: ") for line in said if line.startswith("Error: ")]
        return (errors or said[-1:] or ["the connection ended"])[0].strip().rstrip(".").lower()

    def _said(self) -> list[str]:
        self.words.seek(0)
        text = self.words.read().decode(errors="replace")
        return [line for line in text.splitlines() if line.strip()]


@contextmanager
def _connected(place: Place, lines: Sequence[str]) -> Iterator[RemoteSession]:
    """Start the script at a place, and end it afterwards."""
    with tempfile.TemporaryFile() as words:
        try:
            process = subprocess.Popen(
                # It ends with this process, however that ends.
                ["setpriv", "--pdeathsig", "TERM", *place.command],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=words,
                # Ctrl-C of the terminal is not for it.
                start_new_session=True,
            )
        except FileNotFoundError:
            raise RecordingError("setpriv is not installed", "apt-get install util-linux") from None
        session = RemoteSession(place, process, words)
        try:
            session.say(lines)
            yield session
        finally:
            # Where its stdin ends it ends the session, whatever it does.
            for stream in (process.stdin, process.stdout):
                assert stream is not None
                with suppress(BrokenPipeError):
                    stream.close()
            try:
                process.wait(_LONGEST_END)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _instructions(name: str, channel: Channel, *, with_network: bool) -> list[str]:
    """Return the lines that the script reads."""
    for event in (*channel.events, *channel.without):
        if not _EVENT.fullmatch(event):
            raise UsageError(f"not the name of an event — {event!r}", "such as ros2:callback_start")
    return [
        name,
        f"{channel.sub_buffer_size} {channel.sub_buffers}",
        ",".join(NETWORK_EVENTS) if with_network else "-",
        *(f"{event} {','.join(left_out(channel, event))}" for event in channel.events),
        "start",
    ]


def _engine(container: str) -> str:
    """Return the program that knows a container: docker or podman."""
    installed = [name for name in ("docker", "podman") if shutil.which(name)]
    for name in installed:
        known = subprocess.run(
            [name, "container", "inspect", container],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        if not known.returncode:
            return name
    asked = " and ".join(installed)
    raise RecordingError(
        f"there is no such container — {container}"
        if installed
        else "neither docker nor podman is installed",
        f"{asked} were asked: {installed[0]} ps" if installed else "--on HOST records by ssh",
    )
