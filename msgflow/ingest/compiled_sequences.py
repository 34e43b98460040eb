"""Threads and predecessors by the compiled kernel, one event after the other."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from msgflow import kernel
from msgflow.ingest.catalogue import Origin

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

_NONE = -1
_ORIGINS = {Origin.EVENT_ID: 0, Origin.TS_NS: 1, Origin.LABEL: 2}
_FIRST_ROOM = 1 << 10

_EXTENTS = ("first_id", "last_id", "first_time", "last_time")
_STRETCH = np.dtype([(name, np.int64) for name in ("thread", "name", *_EXTENTS)])


@dataclass(frozen=True)
class Stretches:
    """Stretches of events of a thread under one name, by thread and time.

    Attributes:
        threads: numbers of the threads.
        names: numbers of the names, -1 for none.
        extents: ids of the first and the last event, times of the first and the last.
    """

    threads: NDArray[np.int32]
    names: NDArray[np.int32]
    extents: Sequence[NDArray[np.int64]]


@dataclass(frozen=True)
class OfTracepoint:
    """Events of one tracepoint in order of their ids.

    Attributes:
        ids: their numbers.
        times: in nanoseconds.
        threads: numbers of their threads.
        names: numbers of the threads' names, -1 for none.
        sequences: bits of the sequences that they belong to.
        label: number of what successors call them, -1 for none.
        wanted: (place of the sequence, origin) of what is wanted of their predecessors.
    """

    ids: NDArray[np.int64]
    times: NDArray[np.int64]
    threads: NDArray[np.int32]
    names: NDArray[np.int32]
    sequences: int
    label: int
    wanted: Sequence[tuple[int, Origin]]


class Latest:
    """What is known of the latest event of each sequence on each thread."""

    def __init__(self, sequence_count: int) -> None:
        self._values = np.empty((0, sequence_count, len(_ORIGINS)), np.int64)

    def place(
        self, library: ctypes.CDLL, batches: Sequence[OfTracepoint], thread_count: int
    ) -> tuple[list[list[NDArray[Any]]], Stretches]:
        """Go through the events of a round in the order of their ids.

        Args:
            library: the kernel.
            batches: all events.
            thread_count: numbers of threads are below it.

        Returns:
            what is wanted of each batch, -1 where there is no predecessor, and names of threads.
        """
        fresh = thread_count - len(self._values)
        if fresh:
            more = np.full((fresh, *self._values.shape[1:]), _NONE, np.int64)
            self._values = np.concatenate([self._values, more])
        found = [
            [
                np.empty(batch.ids.size, np.int8 if origin is Origin.LABEL else np.int64)
                for _, origin in batch.wanted
            ]
            for batch in batches
        ]
        wanted = [
            (kernel.Wanted * len(values))(
                *(
                    kernel.Wanted(sequence, _ORIGINS[origin], column.ctypes.data)
                    for (sequence, origin), column in zip(batch.wanted, values, strict=True)
                )
            )
            for batch, values in zip(batches, found, strict=True)
        ]
        described = (kernel.Events * len(batches))(
            *(
                kernel.Events(
                    batch.ids.ctypes.data,
                    batch.times.ctypes.data,
                    batch.threads.ctypes.data,
                    batch.names.ctypes.data,
                    batch.ids.size,
                    batch.sequences,
                    batch.label,
                    ctypes.addressof(of_batch),
                    len(of_batch),
                )
                for batch, of_batch in zip(batches, wanted, strict=True)
            )
        )
        first = min(int(batch.ids[0]) for batch in batches)
        id_count = max(int(batch.ids[-1]) for batch in batches) + 1 - first
        # Kept until the kernel is done: it gets addresses alone.
        owners, following = np.zeros(id_count, np.int32), np.zeros(len(batches), np.int64)
        stretch_of = np.full(thread_count, _NONE, np.int64)
        stretches = np.empty(sum(batch.ids.size for batch in batches), _STRETCH)
        count = library.msgflow_place(
            ctypes.addressof(described),
            len(batches),
            first,
            id_count,
            owners.ctypes.data,
            following.ctypes.data,
            thread_count,
            self._values.shape[1],
            self._values.ctypes.data,
            stretch_of.ctypes.data,
            stretches.ctypes.data,
        )
        assert count >= 0, "events are not in order"
        stretches = stretches[:count]
        stretches = stretches[np.argsort(stretches["thread"], kind="stable")]
        return found, Stretches(
            stretches["thread"].astype(np.int32),
            stretches["name"].astype(np.int32),
            [stretches[name] for name in _EXTENTS],
        )


class Numbers:
    """Numbers values from 0 as they are first seen."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self._library = library
        self._known = np.empty(0, np.int64)
        self._slots = np.empty(0, np.int32)
        self._count = ctypes.c_int64(0)

    @property
    def count(self) -> int:
        """How many there are."""
        return self._count.value

    def of(self, given: NDArray[Any]) -> NDArray[np.int32]:
        """Return the numbers of values."""
        values = np.ascontiguousarray(given, np.int64)
        numbers = np.empty(values.size, np.int32)
        done = 0
        while done < values.size:
            done += self._number(values[done:], numbers[done:])
            if done < values.size:
                self._grow()
        return numbers

    def _number(self, values: NDArray[np.int64], numbers: NDArray[np.int32]) -> int:
        if not self._slots.size:
            return 0
        count: int = self._library.msgflow_numbers(
            values.ctypes.data,
            values.size,
            self._known.ctypes.data,
            self._known.size,
            ctypes.byref(self._count),
            self._slots.ctypes.data,
            self._slots.size,
            numbers.ctypes.data,
        )
        return count

    def _grow(self) -> None:
        known = self._known[: self.count]
        room = max(2 * known.size, _FIRST_ROOM)
        self._known = np.empty(room, np.int64)
        self._slots = np.full(2 * room, _NONE, np.int32)
        self._count.value = 0
        self._number(known, np.empty(known.size, np.int32))
