"""Turns of questions: several at a time, and one alone that had too little memory."""

from __future__ import annotations

import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING

import duckdb

from msgflow.errors import QueryError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


class Turns:
    """Turns of questions: several at a time, and one alone that had too little memory."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._running = 0
        self._is_alone = False

    def ask(self, question: Callable[[], bytes]) -> bytes:
        """Return the answer."""
        with self._turn(alone=False):
            answer = _if_memory_suffices(question)
        if answer is not None:
            return answer
        with self._turn(alone=True):
            answer = _if_memory_suffices(question)
        if answer is None:
            raise QueryError(
                "this takes more memory than the server may use",
                "start it with more: msgflow ui --memory-limit 8GB",
            )
        return answer

    @contextmanager
    def _turn(self, *, alone: bool) -> Iterator[None]:
        with self._changed:
            self._changed.wait_for(lambda: not self._is_alone and not (alone and self._running))
            self._running += 1
            self._is_alone = alone
        try:
            yield
        finally:
            with self._changed:
                self._running -= 1
                self._is_alone = False
                self._changed.notify_all()


def _if_memory_suffices(question: Callable[[], bytes]) -> bytes | None:
    try:
        return question()
    except (duckdb.OutOfMemoryException, QueryError) as error:
        if not isinstance(error.__cause__ or error, duckdb.OutOfMemoryException):
            raise
    return None
