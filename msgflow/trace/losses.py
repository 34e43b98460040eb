"""How many events each packet lost, when the tracer counts them over the whole recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.trace.lttng_index import first_discard_counters

if TYPE_CHECKING:
    from collections.abc import Sequence

    from msgflow.trace.model import TraceInfo

Recording = tuple[str, int, int]
"""Trace uuid (or path), stream class and stream instance: one counter, through all chunks."""


class DiscardCounters:
    """Keeps the tracer's counters, of which Babeltrace tells only rises within one directory.

    A recording may be rotated into several directories; the counter goes on in the next one, and
    the first packet there shows all that was lost so far.
    """

    def __init__(self, traces: Sequence[TraceInfo]) -> None:
        self._traces = traces
        self._counters: dict[Recording, int] = {}
        self._first: dict[int, dict[tuple[int, int], int]] = {}

    def rise(
        self, trace_index: int, class_id: int, instance_id: int, reported: int | None
    ) -> int | None:
        """Return the number of events that the packet lost.

        Args:
            trace_index: the trace of the packet.
            class_id: its stream class.
            instance_id: its stream instance.
            reported: the rise that Babeltrace reports, None for the first packet of a directory.

        Returns:
            None if the trace has no index that tells.
        """
        trace = self._traces[trace_index]
        recording = (trace.uuid or str(trace.path), class_id, instance_id)
        before = self._counters.get(recording, 0)
        if reported is not None:
            self._counters[recording] = before + reported
            return reported
        if trace_index not in self._first:
            self._first[trace_index] = first_discard_counters(trace.path)
        counter = self._first[trace_index].get((class_id, instance_id))
        if counter is None:
            return None
        self._counters[recording] = counter
        return counter - before if counter >= before else counter
