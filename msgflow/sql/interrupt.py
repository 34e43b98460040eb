"""Interrupts: Ctrl-C, SIGTERM and SIGHUP, which are never lost and leave nothing half done.

Python raises KeyboardInterrupt wherever the main thread happens to be. Inside a callback of the
garbage collector it is printed and forgotten; inside DuckDB it becomes another exception. Hence the
signal handler only notes the signal, and the code that can stop asks for it.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import duckdb

_T = TypeVar("_T")
_SECONDS_BETWEEN_ATTEMPTS = 0.05
_SECONDS_TO_ANSWER = 1


class Terminated(KeyboardInterrupt):
    """SIGTERM or SIGHUP, which the command line treats as Ctrl-C."""


class Interrupts:
    """The state of Ctrl-C: whether it came, and still counts; `end_process` where that is ours."""

    def __init__(
        self, end_process: Callable[[type[KeyboardInterrupt]], None] | None = None
    ) -> None:
        self._end_process = end_process
        self._is_noted = False
        self._is_final = False
        self._is_answered = False
        self._kind: type[KeyboardInterrupt] = KeyboardInterrupt
        self._lock = threading.Lock()

    def on_signal(self, number: int, frame: FrameType | None) -> None:
        """Note Ctrl-C; raise the second one at once, as the work may not ask for a long time."""
        if number != signal.SIGINT:
            self._kind = Terminated
        if self._is_noted and not self._is_final:
            raise self._kind
        self._is_noted = True

    def note(self) -> None:
        """Note a Ctrl-C that came as an exception."""
        self._is_noted = True

    def check(self) -> None:
        """Raise KeyboardInterrupt if Ctrl-C came in time."""
        if self._is_noted and not self._is_final and not self._is_answered:
            raise self._kind

    def answer(self) -> None:
        """Count the Ctrl-C that came as what the work waited for; another one is raised at once."""
        self._is_answered = True

    def end_process(self) -> None:
        """End the process, if Ctrl-C came and the process is the command line."""
        if self._is_noted and self._end_process is not None:
            self._end_process(self._kind)

    def make_final(self) -> None:
        """Raise KeyboardInterrupt if Ctrl-C came before; from now on it comes too late.

        Any thread calls this before the step that cannot be undone.
        """
        with self._lock:
            self.check()
            self._is_final = True

    def forward(self, connection: duckdb.DuckDBPyConnection) -> bool:
        """Interrupt what `connection` runs if Ctrl-C came in time, and say whether it did."""
        with self._lock:
            is_in_time = self._is_noted and not self._is_final
            if is_in_time:
                connection.interrupt()
            return is_in_time


SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""The signals that end a command cleanly."""


@contextmanager
def noted_interrupts() -> Iterator[Interrupts]:
    """Note Ctrl-C instead of raising it; an inner block shares the state of the outer one.

    Only the main thread receives signals. A program that uses msgflow keeps its own handling of
    Ctrl-C. SIGTERM and SIGHUP are noted in the command line only.
    """
    if threading.current_thread() is not threading.main_thread():
        yield Interrupts()
        return
    before = {number: signal.getsignal(number) for number in SIGNALS}
    for handler in before.values():
        outer = getattr(handler, "__self__", None)
        if isinstance(outer, Interrupts):
            yield outer
            return
    ends = (getattr(handler, "end_process", None) for handler in before.values())
    interrupts = Interrupts(next(filter(None, ends), None))
    # Python's own handler, and that of the command line (msgflow.cli.signals), are replaced.
    ours = [
        number
        for number, handler in before.items()
        if handler is signal.default_int_handler or getattr(handler, "raises_interrupts", False)
    ]
    try:
        for number in ours:
            signal.signal(number, interrupts.on_signal)
        yield interrupts
    except Exception:
        # After Ctrl-C the failure is only its consequence.
        interrupts.check()
        raise
    finally:
        for number in ours:
            signal.signal(number, before[number])


@contextmanager
def until_interrupted() -> Iterator[Interrupts]:
    """Do what is in the block until Ctrl-C, which is how it ends; Terminated is raised."""
    with noted_interrupts() as interrupts:
        try:
            yield interrupts
        except Terminated:
            raise
        except KeyboardInterrupt:
            interrupts.answer()


def interruptible(
    connection: duckdb.DuckDBPyConnection, work: Callable[[], _T], *, only_reads: bool = False
) -> _T:
    """Return what `work` returns; Ctrl-C interrupts the statement that it runs on `connection`.

    DuckDB looks for signals only while the main thread computes a part of the statement, and might
    never notice Ctrl-C. Hence another thread does the work; KeyboardInterrupt comes when the
    statement has ended. Some functions of DuckDB do not notice an interrupt either. Where nothing
    is written (`only_reads`), the command line ends without them after a second.
    """
    if threading.current_thread() is not threading.main_thread():
        return work()
    from concurrent.futures import ThreadPoolExecutor, wait

    is_watched = threading.Event()

    def work_once_watched() -> _T:
        is_watched.wait()
        interrupts.check()
        return work()

    with noted_interrupts() as interrupts, ThreadPoolExecutor(max_workers=1) as pool:
        try:
            future = pool.submit(work_once_watched)
        except KeyboardInterrupt:
            interrupts.note()
            is_watched.set()
            raise
        # Repeatedly: between two statements of the work there is nothing to interrupt.
        attempts = 0
        while not future.done():
            try:
                is_watched.set()
                wait((future,), timeout=_SECONDS_BETWEEN_ATTEMPTS)
                attempts += interrupts.forward(connection)
                if only_reads and attempts * _SECONDS_BETWEEN_ATTEMPTS > _SECONDS_TO_ANSWER:
                    interrupts.end_process()
            except KeyboardInterrupt:
                interrupts.note()
        interrupts.check()
        return future.result()
