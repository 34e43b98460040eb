"""LTTng sessions that are watched: which ones, and that they rotate until they end."""

from __future__ import annotations

import shlex
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from msgflow.errors import RecordingError, UsageError
from msgflow.record.lttng import Session, sessions
from msgflow.record.session import rotated
from msgflow.text.name_suggestions import did_you_mean

# Seconds between two looks which sessions are there.
_BETWEEN_LOOKS = 1.0
# A session that was not seen so often has ended: its last chunk may come half a second later.
_MOST_ABSENCES = 2


def watched_place(word: str | None) -> Path:
    """Return the directory to watch: that of a session with this name, or the directory itself.

    Without a word, the only session is meant.
    """
    try:
        found, reason = sessions(), None
    except RecordingError as error:
        # LTTng may be on another machine.
        found, reason = [], error.message
    places = {each.name: each.directory for each in found if each.directory is not None}
    if word is None:
        return _only(places, reason)
    if word in places:
        return places[word]
    path = Path(word).expanduser().absolute()
    if path.is_dir():
        return path
    for session in found:
        if session.name == word:
            raise _cannot_rotate(session)
    known = ", ".join(places)
    problem = f" ({reason})" if reason else ""
    there = f"LTTng has the sessions {known}" if known else "lttng list shows the sessions"
    raise UsageError(
        f"there is no session and no directory of this name — {word}{problem}",
        f"{did_you_mean(word, list(places), there)}; msgflow watch -- {shlex.quote(word)} starts,"
        " records and watches a program",
    )


def _only(places: dict[str, Path], reason: str | None) -> Path:
    # What a session writes below another one belongs to that recording.
    recordings = set(places.values())
    places = {name: place for name, place in places.items() if recordings.isdisjoint(place.parents)}
    if len(places) == 1:
        return next(iter(places.values()))
    if places:
        raise UsageError(
            f"LTTng has several sessions — {', '.join(places)}",
            f"name one: msgflow watch {shlex.quote(next(iter(places)))}",
        )
    raise UsageError(
        f"there is no session that can be watched{f': {reason}' if reason else ''}",
        "msgflow watch DIR, or msgflow watch -- COMMAND to start, record and watch a program",
    )


def _cannot_rotate(session: Session) -> UsageError:
    if session.is_snapshot:
        return UsageError(
            f"a snapshot session is not written while it runs — {session.name}",
            "create another session: lttng create, without --snapshot",
        )
    return UsageError(
        f"the session writes over the network, or has --live — {session.name}",
        "msgflow watch DIR there, with the directory of lttng-relayd; LTTng cannot rotate a session"
        " with --live",
    )


class WatchedSessions:
    """The sessions that write below a directory: in a `with` block, LTTng rotates them.

    A session that comes later rotates from then on, too.
    """

    def __init__(self, place: Path, step_ns: int, note: Callable[[str], None]) -> None:
        """Nothing rotates before the block; `note` gets sentences about what goes wrong."""
        self._place = place
        self._step_ns = step_ns
        self._note = note
        self._stack = ExitStack()
        self._last_look = time.monotonic()
        # What keeps each of them rotating; None of one that cannot.
        self._go_on: dict[Session, Callable[[], None] | None] = {}
        self._absences: dict[Session, int] = {}

    def __enter__(self) -> WatchedSessions:
        """Let the sessions rotate that are there; one with `--live` cannot."""
        try:
            found = sessions()
        except RecordingError:
            # LTTng may be on another machine.
            found = []
        for session in self._below(found):
            self._begin(session)
        return self

    def __exit__(self, *_: object) -> None:
        """End the rotations that began here."""
        self._stack.close()

    def are_over(self) -> bool:
        """Tell whether all sessions have ended; where there was none, nothing tells."""
        if time.monotonic() - self._last_look < _BETWEEN_LOOKS:
            return False
        self._last_look = time.monotonic()
        found: list[Session] = []
        reason = None
        try:
            found = sessions()
        except RecordingError as error:
            reason = error.message
        here = self._below(found)
        for session in here:
            if session not in self._go_on:
                try:
                    self._begin(session)
                except RecordingError as error:
                    self._go_on[session] = None
                    self._note(f"session {session.name} cannot be watched: {error.message}")
            elif (go_on := self._go_on[session]) is not None:
                go_on()
        for session in self._absences:
            self._absences[session] = 0 if session in here else self._absences[session] + 1
        if not self._absences or min(self._absences.values()) < _MOST_ABSENCES:
            return False
        self._say_why(found, reason)
        return True

    def _below(self, found: list[Session]) -> list[Session]:
        return [
            session
            for session in found
            if session.directory is not None and session.directory.is_relative_to(self._place)
        ]

    def _begin(self, session: Session) -> None:
        self._go_on[session] = self._stack.enter_context(rotated(session.name, self._step_ns))
        self._absences[session] = 0

    def _say_why(self, found: list[Session], reason: str | None) -> None:
        """Say why the view ends, unless the sessions have just ended."""
        if reason is not None:
            self._note(f"the view ends: {reason}; what was not rotated yet is not shown")
        names = {session.name for session in self._absences}
        for session in found:
            if session.name in names and session.directory is not None:
                self._note(
                    f"the view ends: session {session.name} was created anew and writes into"
                    f" {session.directory}: msgflow watch {shlex.quote(session.name)}"
                )
