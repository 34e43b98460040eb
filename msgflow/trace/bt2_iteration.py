"""One pass over the messages of a graph: from messages to batches."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

from msgflow.errors import TraceError
from msgflow.trace.bt2_duplicates import DuplicateFilter
from msgflow.trace.bt2_fields import FieldReader
from msgflow.trace.bt2_graph import Bt2Graph
from msgflow.trace.bt2_plan import ClassPlan, Planner
from msgflow.trace.bt2_streams import PacketRow, StreamTable
from msgflow.trace.columns import complete_schemas, in_hexadecimal, merged_schema, record_batch
from msgflow.trace.losses import DiscardCounters
from msgflow.trace.model import EventBatch, Progress
from msgflow.trace.order import Entry, new_numbers
from msgflow.trace.schemas import PACKET, PACKET_SCHEMA

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    import pyarrow as pa

    from msgflow.trace.bt2_fields import Member
    from msgflow.trace.bt2_library import Bt2Library
    from msgflow.trace.model import TraceInfo

_PROGRESS_EVENTS = 10_000


class Iteration:
    """Reads a set of traces once.

    Attributes:
        event_count: events read so far, duplicates left out.
    """

    def __init__(
        self,
        library: Bt2Library,
        traces: Sequence[TraceInfo],
        wanted: Mapping[str, pa.Schema | None] | None,
        progress: Callable[[Progress], None] | None,
        batch_rows: int,
    ) -> None:
        self._library = library
        self._traces = traces
        self._wanted = wanted
        self._progress = progress
        self._batch_rows = batch_rows
        self._graph = Bt2Graph(library, traces)
        self._fields = FieldReader(library)
        self._streams = StreamTable(library)
        self._duplicates: DuplicateFilter | None = None
        uuids = Counter(trace.uuid for trace in traces)
        repeated = {
            trace.index: trace.uuid
            for trace in traces
            if trace.uuid is not None and uuids[trace.uuid] > 1
        }
        if repeated:
            self._duplicates = DuplicateFilter(library, self._streams, repeated)
        self._counters = DiscardCounters(traces)
        self._planner: Planner | None = None
        self._plans: dict[int, ClassPlan] = {}
        self._packets: list[PacketRow] = []
        self._ties: list[list[Entry]] = []
        self._round = 0
        self.event_count = 0

    @property
    def duplicate_packet_count(self) -> int:
        """Packets left out so far because the set holds them twice."""
        return 0 if self._duplicates is None else self._duplicates.skipped

    def event_counts(self) -> dict[tuple[int, str], int]:
        """Return (trace index, event name) to the number of events read so far."""
        counts: Counter[tuple[int, str]] = Counter()
        for plan in self._plans.values():
            counts[plan.trace_index, plan.name] += plan.count
        return dict(sorted((key, count) for key, count in counts.items() if count))

    def close(self) -> None:
        """Give the graph back."""
        if self._duplicates is not None:
            self._duplicates.close()
        self._graph.close()

    def run(self) -> Iterator[EventBatch]:
        """Yield all batches."""
        try:
            yield from self._read()
        except TraceError as error:
            yield from self._flush()
            raise TraceError(
                f"{error.message}; {self.event_count} events were read before", error.hint
            ) from error
        yield from self._flush()
        self._report(1.0, max((trace.end_ns or 0 for trace in self._traces), default=0))

    def _steps(self) -> Iterator[list[Any]]:
        for step in self._graph.steps():
            if self._planner is None:
                self._add_streams(step)
            # Taken from the end, so that what is left in the list is what is not yet done.
            step.reverse()
            yield step

    def _add_streams(self, step: list[Any]) -> None:
        """Add the streams that begin; the muxer lets all begin before anything that has a time."""
        native = self._library.native
        for message in step:
            if native.message_get_type(message) == native.MESSAGE_TYPE_STREAM_BEGINNING:
                self._streams.add(native.message_stream_beginning_borrow_stream_const(message))
        if len(self._streams.by_address) == self._graph.stream_count:
            self._streams.number()
            self._planner = self._new_planner()

    def _read(self) -> Iterator[EventBatch]:
        """The loop over all messages, the one place where every event costs Python time."""
        native = self._library.native
        message_type = native.message_get_type
        event_type = native.MESSAGE_TYPE_EVENT
        put_message = native.message_put_ref
        borrow_event = native.message_event_borrow_event_const
        borrow_snapshot = native.message_event_borrow_default_clock_snapshot_const
        clock_value = native.clock_snapshot_get_value
        borrow_class = native.event_borrow_class_const
        borrow_stream = native.event_borrow_stream_const
        borrow_common = native.event_borrow_common_context_field_const
        borrow_specific = native.event_borrow_specific_context_field_const
        borrow_payload = native.event_borrow_payload_field_const
        borrow_member = native.field_structure_borrow_member_field_by_index_const
        plans = self._plans
        streams = self._streams.by_address
        ties = self._ties
        batch_rows = self._batch_rows
        event_id = -1
        row_count = 0
        time_ns = horizon = previous_ns = -(1 << 63)
        previous_rank = 0
        slack = 0
        in_tie = False
        next_report = _PROGRESS_EVENTS

        steps = self._steps()
        if self._duplicates is not None:
            steps = self._duplicates.filter(steps)
        for step in steps:
            while step:
                message = step.pop()
                if message_type(message) != event_type:
                    self._other_message(message)
                    put_message(message)
                    slack = self._streams.slack_ns
                    continue
                event = borrow_event(message)
                stream = streams[int(borrow_stream(event))]
                value = clock_value(borrow_snapshot(message))
                offset_ns = stream.clock.offset_ns
                time_ns = stream.clock.to_ns(value) if offset_ns is None else value + offset_ns
                if time_ns > horizon:
                    if row_count >= batch_rows:
                        step.append(message)
                        yield from self._flush()
                        row_count = 0
                        continue
                    horizon = time_ns + slack
                    in_tie = False
                    event_id += 1
                else:
                    if not in_tie:
                        in_tie = True
                        ties.append([(previous_ns, previous_rank, event_id)])
                    event_id += 1
                    row_count += 1
                    ties[-1].append((time_ns, stream.rank, event_id))
                    horizon = max(horizon, time_ns + slack)
                previous_ns = time_ns
                previous_rank = stream.rank
                stream.event_count += 1
                stream.last_event_ns = time_ns
                event_class = borrow_class(event)
                plan = plans.get(int(event_class))
                if plan is None:
                    plan = self._plan(event_class, stream.trace_index)
                plan.count += 1
                if plan.append is not None:
                    row_count += 1
                    common = borrow_common(event)
                    payload = borrow_payload(event)
                    row = [event_id, time_ns, stream.trace_index, stream.cpu_id]
                    row += [get(borrow_member(common, i)) for i, get in plan.common]
                    if plan.specific:
                        specific = borrow_specific(event)
                        row += [get(borrow_member(specific, i)) for i, get in plan.specific]
                    row += [get(borrow_member(payload, i)) for i, get in plan.payload]
                    plan.append(row)
                put_message(message)
            self.event_count = event_id + 1
            if self.event_count >= next_report:
                next_report = self.event_count + _PROGRESS_EVENTS
                self._report(self._fraction(time_ns), time_ns)

    def _other_message(self, message: Any) -> None:
        native = self._library.native
        kind = native.message_get_type(message)
        if kind == native.MESSAGE_TYPE_PACKET_BEGINNING:
            self._begin_packet(message)
        elif kind == native.MESSAGE_TYPE_PACKET_END:
            self._end_packet(message)
        elif kind == native.MESSAGE_TYPE_DISCARDED_EVENTS:
            pointer = native.message_discarded_events_borrow_stream_const(message)
            stream = self._streams.by_address[int(pointer)]
            count = self._known(native.message_discarded_events_get_count(message))
            stream.discarded_event_count = self._counters.rise(
                stream.trace_index, stream.class_id, stream.instance_id, count
            )
        elif kind == native.MESSAGE_TYPE_DISCARDED_PACKETS:
            pointer = native.message_discarded_packets_borrow_stream_const(message)
            count = self._known(native.message_discarded_packets_get_count(message))
            self._streams.by_address[int(pointer)].lost_packet_count = count

    def _begin_packet(self, message: Any) -> None:
        native = self._library.native
        packet = native.message_packet_beginning_borrow_packet_const(message)
        stream = self._streams.by_address[int(native.packet_borrow_stream_const(packet))]
        begin_ns = None
        if stream.packets_have_begin:
            snapshot = native.message_packet_beginning_borrow_default_clock_snapshot_const(message)
            begin_ns = stream.clock.to_ns(native.clock_snapshot_get_value(snapshot))
        stream.begin_packet(self._streams.cpu_of(packet), begin_ns)

    def _end_packet(self, message: Any) -> None:
        native = self._library.native
        packet = native.message_packet_end_borrow_packet_const(message)
        stream = self._streams.by_address[int(native.packet_borrow_stream_const(packet))]
        end_ns = None
        if stream.packets_have_end:
            snapshot = native.message_packet_end_borrow_default_clock_snapshot_const(message)
            end_ns = stream.clock.to_ns(native.clock_snapshot_get_value(snapshot))
        self._packets.append(stream.end_packet(end_ns))

    def _known(self, availability_and_count: tuple[int, int]) -> int | None:
        availability, count = availability_and_count
        return (
            count if availability == self._library.native.PROPERTY_AVAILABILITY_AVAILABLE else None
        )

    def _new_planner(self) -> Planner:
        schemas = complete_schemas(self._wanted, self._declared_schemas())
        return Planner(self._library, self._fields, schemas)

    def _declared_schemas(self) -> dict[str, pa.Schema]:
        native = self._library.native
        declared: dict[str, list[tuple[Member, ...]]] = {}
        for event_class in self._streams.event_classes():
            name = native.event_class_get_name(event_class) or ""
            payload = native.event_class_borrow_payload_field_class_const(event_class)
            declared.setdefault(name, []).append(self._fields.members(payload))
        return {
            name: in_hexadecimal(
                merged_schema(classes),
                {member.name for members in classes for member in members if member.is_hexadecimal},
            )
            for name, classes in declared.items()
        }

    def _plan(self, event_class: Any, trace_index: int) -> ClassPlan:
        assert self._planner is not None
        plan = self._planner.plan(event_class, trace_index)
        self._plans[int(event_class)] = plan
        return plan

    def _flush(self) -> Iterator[EventBatch]:
        """Hand over everything that is held; no group of simultaneous events may be open."""
        new_ids = new_numbers(self._ties)
        self._ties.clear()
        if self._planner is not None:
            for name, batch in self._planner.take(new_ids):
                yield EventBatch(name, batch, self._round)
        if self._packets:
            columns = dict(zip(PACKET_SCHEMA.names, zip(*self._packets, strict=True), strict=True))
            batch = record_batch(PACKET_SCHEMA, columns, {}, len(self._packets))
            self._packets.clear()
            yield EventBatch(PACKET, batch, self._round)
        self._round += 1

    def _fraction(self, time_ns: int) -> float:
        begin = min((trace.begin_ns for trace in self._traces if trace.begin_ns), default=0)
        end = max((trace.end_ns for trace in self._traces if trace.end_ns), default=0)
        return min(max((time_ns - begin) / (end - begin), 0.0), 1.0) if end > begin else 0.0

    def _report(self, fraction: float, time_ns: int) -> None:
        if self._progress is not None:
            self._progress(Progress(self.event_count, fraction, time_ns))
