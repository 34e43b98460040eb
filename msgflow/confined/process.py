"""Confined processes: what others made is read in a child with bounds on memory and time.

DuckDB's memory limit does not count what functions of a query take, an interrupt waits until such
a function returns, and what a bag unpacks to is known only then. The system's bounds hold always:
an allocation beyond them fails (`msgflow.db.memory.bound_process`), and a child that is late is
killed. The connection in the child is in the sandbox of `msgflow.db.sandbox` as any other.

The child is `python -P -m msgflow.confined.process MODULE`. It reads a request per line from stdin,
writes an empty answer (it has begun), calls a function of the module, and writes its answer: parts,
each with its size in front; a size of 0; a part of JSON that says what went wrong, or null. It ends
when its parent has ended.
"""

from __future__ import annotations

import functools
import importlib
import json
import os
import queue
import select
import signal
import subprocess
import sys
import threading
import time
import traceback
import weakref
from contextlib import suppress
from typing import Any

from msgflow import errors
from msgflow.errors import MsgflowError, QueryError

_CHUNK = 1 << 20
_SIZE = 8
_ORPHAN = 1
_CANNOT_START = (
    "the process that runs queries cannot start",
    "is there memory for it (ulimit -v)? does this Python find msgflow (pip show ros2-msgflow)?",
)
_ENDED = (
    "the process that read it has ended",
    "did it take more memory than there is? read one run, a shorter time, or fewer columns",
)


class LateError(QueryError):
    """A call took longer than it may."""


class ConfinedProcess:
    """A child process that calls functions of one module, one call after the other.

    It starts at once, and again when it had to be killed. Use it as a context manager, or call
    `close`. It is not for several threads at a time, except for `kill`.
    """

    def __init__(self, module: str, *, seconds: float | None = None) -> None:
        """Start the child.

        Each function of the module takes a function that writes bytes of the answer, and by name
        values that JSON has. A call may take so many seconds; None sets no bound.
        """
        self._module = module
        self._seconds = seconds
        self._child = self._start()

    def __enter__(self) -> ConfinedProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def call(self, function: str, arguments: dict[str, Any]) -> bytearray:
        """Return what a function of the module writes."""
        request = json.dumps({"function": function, "arguments": arguments}, default=str)
        if self._child.poll() is not None:
            self._restart()
        try:
            try:
                self._begin(request)
            except QueryError:  # it was killed before it began: nothing has run
                self._restart()
                self._begin(request)
            return self._answer(self._seconds, _ENDED)
        except LateError:
            # The next call finds the imports done.
            self._restart()
            raise
        except MsgflowError:
            raise
        except BaseException:
            # What the child still writes belongs to no later call.
            self.close()
            raise

    def kill(self) -> None:
        """End the call that runs in another thread, which raises a QueryError there."""
        self._child.kill()

    def close(self) -> None:
        """End the child."""
        _end(self._child)

    def _restart(self) -> None:
        self.close()
        self._child = self._start()

    def _start(self) -> subprocess.Popen[bytes]:
        child = subprocess.Popen(
            # -P: nothing is imported from the current folder.
            [sys.executable, "-P", "-m", __name__, self._module],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
            # Other allocators reserve memory in large pieces, which would count.
            env={**os.environ, "ARROW_DEFAULT_MEMORY_POOL": "system", "OPENBLAS_NUM_THREADS": "1"},
            # Ctrl-C is for the parent, which then ends the child.
            start_new_session=True,
        )
        weakref.finalize(self, _end, child)
        return child

    def _begin(self, request: str) -> None:
        """Send a request, and wait until the child has begun with it."""
        assert self._child.stdin is not None
        with suppress(BrokenPipeError):  # the answer says that the child has ended
            self._child.stdin.write(f"{request}\n".encode())
        self._answer(None, _CANNOT_START)

    def _answer(self, seconds: float | None, on_end: tuple[str, str]) -> bytearray:
        end = None if seconds is None else time.monotonic() + seconds
        content = bytearray()
        while size := int.from_bytes(self._read(_SIZE, end, on_end), "big"):
            content += self._read(size, end, on_end)
        size = int.from_bytes(self._read(_SIZE, end, on_end), "big")
        said = json.loads(self._read(size, end, on_end))
        if said is None:
            return content
        kind = getattr(errors, said["error"], None)
        if isinstance(kind, type) and issubclass(kind, MsgflowError):
            raise kind(said["message"], said["hint"])
        raise RuntimeError(said["message"])

    def _read(self, size: int, end: float | None, on_end: tuple[str, str]) -> bytearray:
        assert self._child.stdout is not None
        content = bytearray()
        while len(content) < size:
            left = None if end is None else max(0.0, end - time.monotonic())
            if not select.select([self._child.stdout], [], [], left)[0]:
                self._child.kill()
                raise LateError(
                    f"it took longer than {self._seconds:g} s", "read one run, or a shorter time"
                )
            found = os.read(self._child.stdout.fileno(), min(_CHUNK, size - len(content)))
            if not found:
                self._child.kill()
                code = self._child.wait()
                how = signal.Signals(-code).name if code < 0 else f"exit code {code}"
                raise QueryError(f"{on_end[0]} ({how})", on_end[1])
            content += found
        return content


def _end(child: subprocess.Popen[bytes]) -> None:
    child.kill()
    child.wait()
    for stream in (child.stdin, child.stdout):
        assert stream is not None
        stream.close()


def main() -> None:
    """Answer the requests on stdin."""
    answers = os.dup(1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # nothing else writes among the answers
    requests: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_read_requests, args=[requests], daemon=True).start()
    module = importlib.import_module(sys.argv[1])
    while True:
        request = json.loads(requests.get())
        _end_answer(answers, None)
        try:
            function = getattr(module, request["function"])
            function(functools.partial(_write, answers), **request["arguments"])
        except MsgflowError as error:
            _end_answer(
                answers,
                {"error": type(error).__name__, "message": error.message, "hint": error.hint},
            )
        except MemoryError:
            message, hint = _ENDED
            _end_answer(answers, {"error": "QueryError", "message": message, "hint": hint})
        except Exception as error:
            message = f"{type(error).__name__}: {error}\n{traceback.format_exc()}"
            _end_answer(answers, {"error": "unexpected", "message": message})
        else:
            _end_answer(answers, None)


def _read_requests(requests: queue.SimpleQueue[bytes]) -> None:
    for line in sys.stdin.buffer:
        requests.put(line)
    os._exit(_ORPHAN)


def _write(answers: int, content: Any) -> int:
    """Write a part of an answer, its size first; return its size."""
    view = memoryview(content).cast("B")
    if size := len(view):
        for part in (memoryview(size.to_bytes(_SIZE, "big")), view):
            rest = part
            while rest:
                rest = rest[os.write(answers, rest) :]
    return size


def _end_answer(answers: int, error: dict[str, Any] | None) -> None:
    os.write(answers, bytes(_SIZE))
    _write(answers, json.dumps(error).encode())


if __name__ == "__main__":
    main()
