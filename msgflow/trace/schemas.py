"""Schemas of the batches that every reader delivers."""

from __future__ import annotations

from typing import Final

import pyarrow as pa

COMMON_SCHEMA: Final = pa.schema(
    [
        pa.field("event_id", pa.int64(), nullable=False),
        pa.field("ts_ns", pa.int64(), nullable=False),
        pa.field("trace_index", pa.int32(), nullable=False),
        pa.field("cpu_id", pa.int32()),
        pa.field("vpid", pa.int32(), nullable=False),
        pa.field("vtid", pa.int32(), nullable=False),
        pa.field("procname", pa.dictionary(pa.int32(), pa.string())),
        pa.field("pid_ns", pa.int64()),
    ]
)
"""First columns of every batch of events.

`event_id` counts all events of the set from 0 in the order (time, trace, stream, position in
stream), wanted or not. `vpid` and `vtid` are -1 where the trace has no such context, the nullable
columns are NULL there.
"""

PACKET_SCHEMA: Final = pa.schema(
    [
        pa.field("trace_index", pa.int32(), nullable=False),
        pa.field("stream_index", pa.int32(), nullable=False),
        pa.field("stream_class_id", pa.int64(), nullable=False),
        pa.field("stream_instance_id", pa.int64(), nullable=False),
        pa.field("cpu_id", pa.int32()),
        pa.field("position", pa.int64(), nullable=False),
        pa.field("begin_ns", pa.int64()),
        pa.field("end_ns", pa.int64()),
        pa.field("last_event_ns", pa.int64()),
        pa.field("event_count", pa.int64(), nullable=False),
        pa.field("discarded_event_count", pa.int64()),
        pa.field("lost_packet_count", pa.int64()),
        pa.field("is_numbered", pa.bool_(), nullable=False),
    ]
)
"""Columns of the batches of packets, one row per packet.

`stream_index` is dense within the trace, in the order (stream class, stream instance); `position`
is the place of the packet in its stream. `discarded_event_count` events were lost after
`last_event_ns` and before `end_ns`; `lost_packet_count` packets are missing right before this
one. Both are NULL where something was lost but the trace does not say how much. Where
`is_numbered`, packets have numbers that go on from one directory of a recording to the next. Else
nothing says how many packets are missing before the first one of a directory.
"""
