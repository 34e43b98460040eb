"""The states of an executor's thread as its truth has them; the most frequent rows of all."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pyarrow as pa

if TYPE_CHECKING:
    from msgflow.sim.truth import TruthTable

_STATES_AT_ONCE = 8_192


class ExecutorStates:
    """What one thread was doing, each state from its event up to the next one."""

    def __init__(self, table: TruthTable, host: str, pid: int, tid: int) -> None:
        self._table = table
        self._place = (host, pa.scalar(pid, pa.int32()), pa.scalar(tid, pa.int32()))
        self._starts: list[int] = []
        self._states: list[str] = []

    def add(self, start_ns: int, state: str) -> None:
        """A state has begun, and the one before it has ended."""
        self._starts.append(start_ns)
        self._states.append(state)
        if len(self._starts) > _STATES_AT_ONCE:
            self._write(self._starts[1:])
            del self._starts[:-1], self._states[:-1]

    def finish(self) -> None:
        """Write down all; the end of the last one was not seen."""
        if self._starts:
            self._write([*self._starts[1:], None])

    def _write(self, ends: list[int] | list[int | None]) -> None:
        count = len(ends)
        constant = (pa.repeat(value, count) for value in self._place)
        self._table.add_columns(*constant, self._starts[:count], ends, self._states[:count])
