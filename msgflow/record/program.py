"""The program that a user records: its environment, in which Python is traced, and its life."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO

from msgflow.errors import UsageError

# Seconds after each signal; `ros2 launch` itself waits so long for its nodes.
_PATIENCE = ((signal.SIGINT, 10.0), (signal.SIGTERM, 5.0), (signal.SIGKILL, 5.0))
_BETWEEN_LOOKS = 0.05
PYTHON_NODES = Path(__file__).resolve().with_name("python_nodes")
"""The folder of what traces nodes of rclpy; Python runs its `sitecustomize` when it starts."""

# The exit code of a Python whose functions have no names for perf.
_TOO_OLD = 12
# `python3.12`, and no program whose name only begins so: it is executed to learn its version.
_PYTHON = re.compile(r"(^|/)python[\d.]*$")
_LONGEST_LINE = 256
_LONGEST_SECONDS = 10
_PYTHON_NAMES = (
    f"import sys; sys.exit(0 if hasattr(sys, 'activate_stack_trampoline') else {_TOO_OLD})"
)


class Program:
    """A program with all that it starts, as a group of processes.

    The group is its own, so that Ctrl-C of the terminal reaches it after the recording has stopped.
    """

    def __init__(
        self,
        words: Sequence[str],
        output: IO[bytes] | None,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        """Start it, with our environment if that is None.

        `output` gets what it prints. If that is None, our stderr does, since our stdout is for
        data.
        """
        self._name = words[0]
        require_program(words[0])
        # A stderr that is closed is None.
        stream = output or sys.__stderr__ or subprocess.DEVNULL
        # While its output goes to a file, the terminal has a screen, which has the keys.
        keys = None if output is None else subprocess.DEVNULL
        try:
            self._process = subprocess.Popen(
                list(words),
                stdin=keys,
                stdout=stream,
                stderr=stream,
                start_new_session=True,
                env=environment,
            )
        except OSError as error:
            raise UsageError(
                f"cannot execute {words[0]}: {(error.strerror or str(error)).lower()}",
                f"msgflow record -- sh {shlex.quote(words[0])}, if it is a script without a first"
                " line #!",
            ) from None

    @property
    def exit_code(self) -> int | None:
        """Exit code; negative: the signal that ended it; None while it runs."""
        return self._process.poll()

    def end(self, note: Callable[[str], None]) -> None:
        """Ask the group to end, as Ctrl-C does, then with more force; KeyboardInterrupt kills it.

        A shell starts its background processes so that they ignore Ctrl-C: they need the force.
        """
        try:
            for number, seconds in _PATIENCE:
                end = time.monotonic() + seconds
                if not self._send(number):
                    return
                while time.monotonic() < end:
                    # Collects the first process: a group has it until then.
                    self._process.poll()
                    if not self._send(0):
                        return
                    time.sleep(_BETWEEN_LOOKS)
        except PermissionError:
            note(
                f"{self._name} runs on, as it belongs to another user: sudo kill -INT --"
                f" -{self._process.pid}"
            )
        except KeyboardInterrupt:
            with suppress(PermissionError):
                self._send(signal.SIGKILL)
            raise

    def _send(self, number: int) -> bool:
        """Send a signal, 0 for none, to all of the group, and tell whether there is one."""
        try:
            os.killpg(self._process.pid, number)
        except ProcessLookupError:
            return False
        return True


def require_program(name: str) -> None:
    """Refuse a program that the shell would not find."""
    if shutil.which(name) is None:
        raise UsageError(
            f"there is no such program — {name}", "name it as in a shell, with its path"
        )


def with_python_nodes(note: Callable[[str], None]) -> dict[str, str]:
    """Return an environment like ours, in which callbacks of rclpy are traced.

    `note` says where the folder cannot be used; then the environment is ours.
    """
    environment = dict(os.environ)
    if (reason := _why_not(PYTHON_NODES)) is not None:
        note(f"callbacks of Python nodes are not traced: {reason}")
        return environment
    # An empty entry would be the current directory: none is added, and those of others stay.
    others = environment.get("PYTHONPATH")
    environment["PYTHONPATH"] = os.pathsep.join([str(PYTHON_NODES), *([others] if others else [])])
    return environment


def _why_not(folder: Path) -> str | None:
    if os.pathsep in str(folder):
        return f"PYTHONPATH cannot have a folder with a {os.pathsep!r} — {folder}"
    # What others may write would run in the processes of this user; so would compiled files.
    for path in (*folder.rglob("*"), folder, *folder.parents):
        try:
            status = path.stat()
        # Python writes compiled files under names that go again.
        except FileNotFoundError:
            continue
        is_shared = status.st_mode & stat.S_IWOTH and not (
            path.is_dir() and status.st_mode & stat.S_ISVTX
        )
        if is_shared or status.st_uid not in (0, os.geteuid()):
            return f"others may write to {path}"
    return None


def with_python_functions(
    words: Sequence[str], environment: dict[str, str], note: Callable[[str], None]
) -> dict[str, str]:
    """Return an environment in which perf sees the functions of Python, from 3.12 on.

    What a command runs is known if it is Python, or a script of Python, such as `ros2`.
    """
    python = _python_of(words[0], environment)
    code = 0
    # One that cannot be asked hinders no recording.
    with suppress(OSError, subprocess.TimeoutExpired):
        if python is not None:
            code = subprocess.run(
                [python, "-c", _PYTHON_NAMES],
                env=environment,
                stdin=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=_LONGEST_SECONDS,
            ).returncode
    if code:
        why = "is older than 3.12" if code == _TOO_OLD else f"does not run (exit code {code})"
        note(
            f"functions of Python have no names in the samples: {python} {why}; those of C and C++"
            " have"
        )
    return {**environment, "PYTHONPERFSUPPORT": "1"}


def _python_of(program: str, environment: Mapping[str, str]) -> str | None:
    """Return the Python that a program is, or that runs it by its first line."""
    path = environment.get("PATH")
    found = shutil.which(program, path=path)
    if found is None or _PYTHON.search(found):
        return found
    line = ""
    with suppress(OSError), open(found, "rb") as file:
        line = os.fsdecode(file.readline(_LONGEST_LINE))
    words = line[2:].split() if line.startswith("#!") else []
    return next((shutil.which(word, path=path) for word in words if _PYTHON.search(word)), None)
