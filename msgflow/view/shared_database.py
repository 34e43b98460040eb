"""The database of `msgflow ui`, which all requests share.

It is open while questions are asked. When none was asked for some seconds it is closed, so that
other commands can write to it. The next question opens it again.
"""

from __future__ import annotations

import hashlib
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import duckdb

from msgflow.db.connection import connect
from msgflow.db.memory import default_limit
from msgflow.errors import DatabaseError, DatabaseInUseError, MsgflowError, QueryError
from msgflow.version import __version__
from msgflow.view.pages import Pages

# More than the questions of one page are apart, less than it takes to type a command.
SECONDS_UNTIL_FREE = 3.0
_SECONDS_BETWEEN_LOOKS = 0.1
_MOST_SECONDS_TO_END = 5.0


class Turns:
    """Turns of questions: several at a time, and one alone that had too little memory."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._running = 0
        self._is_alone = False

    def ask(self, question: Callable[[], bytes]) -> bytes:
        """Return the answer."""
        for alone in (False, True):
            with self._turn(alone):
                try:
                    return question()
                except (duckdb.OutOfMemoryException, QueryError) as error:
                    if not isinstance(error.__cause__ or error, duckdb.OutOfMemoryException):
                        raise
        raise QueryError(
            "this takes more memory than the server may use",
            "start it with more: msgflow ui --memory-limit 8GB",
        )

    @contextmanager
    def _turn(self, alone: bool) -> Iterator[None]:
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


class ReplacedError(DatabaseError):
    """The database is not the one that the page was made of."""


class UnopenedError(DatabaseError):
    """The database cannot be opened, or not yet."""


@dataclass
class Answers:
    """Answers from one state of the database, which are kept while it is closed."""

    generation: str  # of that state, see `generation_of`
    pages: Pages  # answer questions


class SharedDatabase:
    """The database that all requests share, open while questions are asked."""

    def __init__(self, path: Path, memory_limit: str | None) -> None:
        self.path = path
        self._memory_limit = memory_limit
        self._changed = threading.Condition()
        self._turns = Turns()
        self._cursors: set[duckdb.DuckDBPyConnection] = set()
        self._answers: Answers | None = None
        # A connection, which those of questions are made of; None while it is closed.
        self._base: duckdb.DuckDBPyConnection | None = None
        self._is_over = False
        self._open()
        threading.Thread(target=self._free_when_idle, daemon=True).start()

    def generation(self) -> str:
        """Return the generation of the database as it is now, which is opened for it."""
        with self._changed:
            return self._current()[0].generation

    def require(self, generation: str | None) -> None:
        """Raise unless the database is still that of a page."""
        if generation is not None and not self._is(generation):
            raise ReplacedError(
                f"the database was changed while the page was open — {self.path}",
                "reload the page to see it as it is now",
            )

    def answer(
        self,
        name: str,
        params: dict[str, Any],
        generation: str | None,
        started: Callable[[Callable[[], None]], None],
    ) -> bytes:
        """Return the answer to a question of a page; `started` gets the function that ends it."""
        with self._changed:
            answers, base = self._current()
            self.require(generation)
            cursor = base.cursor()
            self._cursors.add(cursor)
        try:
            started(cursor.interrupt)
            content = self._turns.ask(lambda: answers.pages.answer(cursor, name, params))
        except (MsgflowError, duckdb.Error):
            self.require(answers.generation)  # else it was interrupted, or read another file
            raise
        finally:
            with self._changed:
                cursor.close()
                self._cursors.discard(cursor)
                self._changed.notify_all()
        self.require(answers.generation)  # written in its place, it can be a part of each
        return content

    def _current(self) -> tuple[Answers, duckdb.DuckDBPyConnection]:
        # A process has a file of one name open once: the old one is closed before the new one.
        end = time.monotonic() + _MOST_SECONDS_TO_END
        while self._answers is None or self._base is None or not self._is(self._answers.generation):
            if self._cursors:
                if time.monotonic() > end:
                    raise UnopenedError(
                        "a question to the database as it was before does not end",
                        "end msgflow ui with Ctrl-C, and start it again",
                    )
                self._end_questions()
                continue
            self._free()
            try:
                self._open()
            except DatabaseInUseError as error:
                raise UnopenedError(
                    error.message, "wait until it has ended, then reload the page"
                ) from None
            except DatabaseError as error:
                if not self.path.exists():
                    raise ReplacedError(
                        f"the database is no longer there — {self.path}", "msgflow ui --db FILE"
                    ) from None
                raise UnopenedError(error.message, error.hint) from None
        return self._answers, self._base

    def _open(self) -> None:
        # First: if the file is changed meanwhile, the next request sees another generation.
        generation = generation_of(self.path)
        self._base = connect(
            self.path, read_only=True, memory_limit=self._memory_limit or default_limit()
        )
        if self._answers is None or self._answers.generation != generation:
            self._forget()
            self._answers = Answers(generation, Pages())

    def _free_when_idle(self) -> None:
        """Close the database whenever no question was answered for a while."""
        with self._changed:
            while not self._is_over:
                if not self._changed.wait(SECONDS_UNTIL_FREE) and not self._cursors:
                    self._free()

    def _free(self) -> None:
        if self._base is not None:
            self._base.close()
            self._base = None

    def _forget(self) -> None:
        if self._answers is not None:
            self._answers.pages.close()
            self._answers = None

    def _is(self, generation: str) -> bool:
        try:
            return generation == generation_of(self.path)
        except (OSError, DatabaseError):
            return False

    def _end_questions(self) -> None:
        for cursor in self._cursors:
            cursor.interrupt()
        self._changed.wait(_SECONDS_BETWEEN_LOOKS)

    def close(self) -> None:
        """Close the database."""
        end = time.monotonic() + _MOST_SECONDS_TO_END
        with self._changed:
            while self._cursors and time.monotonic() < end:
                self._end_questions()
            self._is_over = True
            self._changed.notify_all()
            # Now and then an interrupt leaves a query of DuckDB that only the process ends.
            if not self._cursors:
                self._free()
            self._forget()


def generation_of(path: Path) -> str:
    """Return what tells the state of a database from others, also after a restart of the server.

    It follows from the file, its log, and the version of msgflow, whose pages ask otherwise.
    """
    try:
        parts: list[object] = [__version__, *_state(path)]
    except FileNotFoundError:
        raise DatabaseError(f"no database — {path}", "msgflow ingest TRACE") from None
    with suppress(FileNotFoundError):
        parts += _state(path.with_name(f"{path.name}.wal"))
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def _state(path: Path) -> list[int]:
    stat = path.stat()
    return [stat.st_dev, stat.st_ino, stat.st_mtime_ns, stat.st_size]
