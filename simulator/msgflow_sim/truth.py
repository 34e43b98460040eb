"""Truth about a simulation, written as it happens: one Parquet file per table.

See the docstring of `msgflow_sim` for the columns.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.parquet as pq

_ROWS_PER_GROUP = 8_192


def _schema(**types: pa.DataType) -> pa.Schema:
    return pa.schema([pa.field(name, data_type) for name, data_type in types.items()])


_ID, _TIME, _COUNT = pa.int64(), pa.int64(), pa.int64()
_TEXT, _NUMBER, _HANDLE, _FLAG = pa.string(), pa.int32(), pa.uint64(), pa.bool_()
_GID = pa.binary(16)

_SCHEMAS: Mapping[str, pa.Schema] = {
    "publication": _schema(
        publication_id=_ID, host=_TEXT, pid=_NUMBER, tid=_NUMBER, node=_TEXT, topic_name=_TEXT,
        publisher_handle=_HANDLE, rmw_publisher_handle=_HANDLE, rclcpp_ns=_TIME, rcl_ns=_TIME,
        rmw_ns=_TIME, source_timestamp_ns=_TIME, callback_instance_id=_ID, is_internal=_FLAG,
        intra_ns=_TIME, agnocast_ns=_TIME,
    ),
    "take": _schema(
        take_id=_ID, host=_TEXT, pid=_NUMBER, tid=_NUMBER, node=_TEXT, topic_name=_TEXT,
        subscription_handle=_HANDLE, rmw_ns=_TIME, rcl_ns=_TIME, rclcpp_ns=_TIME,
        source_timestamp_ns=_TIME, publication_id=_ID, callback_instance_id=_ID,
        is_internal=_FLAG, method=_TEXT, dequeue_ns=_TIME, subscription_id=_ID,
        agnocast_ns=_TIME,
    ),
    "callback_instance": _schema(
        callback_instance_id=_ID, host=_TEXT, pid=_NUMBER, tid=_NUMBER, node=_TEXT, kind=_TEXT,
        callback_handle=_HANDLE, start_ns=_TIME, end_ns=_TIME, take_id=_ID,
        is_intra_process=_FLAG, parent_id=_ID,
    ),
    "transport": _schema(
        publication_id=_ID, take_id=_ID, topic_name=_TEXT,
        publication_host=_TEXT, publication_pid=_NUMBER, publication_tid=_NUMBER,
        publication_rclcpp_ns=_TIME, publication_rcl_ns=_TIME, publication_rmw_ns=_TIME,
        source_timestamp_ns=_TIME,
        take_host=_TEXT, take_pid=_NUMBER, take_tid=_NUMBER,
        take_rmw_ns=_TIME, take_rcl_ns=_TIME, take_rclcpp_ns=_TIME,
        latency_ns=_COUNT, is_internal=_FLAG, method=_TEXT, publication_intra_ns=_TIME,
        take_dequeue_ns=_TIME, is_replay=_FLAG, is_self_loop=_FLAG,
    ),
    "undelivered": _schema(
        publication_id=_ID, topic_name=_TEXT,
        publication_host=_TEXT, publication_pid=_NUMBER, publication_tid=_NUMBER,
        publication_rmw_ns=_TIME, source_timestamp_ns=_TIME,
        subscription_host=_TEXT, subscription_pid=_NUMBER, subscription_handle=_HANDLE,
        reason=_TEXT, is_internal=_FLAG, subscription_id=_ID,
    ),
    "subscription": _schema(
        subscription_id=_ID, host=_TEXT, pid=_NUMBER, node=_TEXT, topic_name=_TEXT,
        subscription_handle=_HANDLE, rmw_subscription_handle=_HANDLE, created_ns=_TIME,
        ended_ns=_TIME, is_internal=_FLAG,
    ),
    "reader": _schema(host=_TEXT, pid=_NUMBER, topic_name=_TEXT, created_ns=_TIME),
    "causal": _schema(
        callback_instance_id=_ID, publication_id=_ID, host=_TEXT, pid=_NUMBER, tid=_NUMBER,
        kind=_TEXT, callback_start_ns=_TIME, take_id=_ID, take_rmw_ns=_TIME, topic_name=_TEXT,
        publication_rcl_ns=_TIME, publication_rmw_ns=_TIME, is_internal=_FLAG, is_reuse=_FLAG,
    ),
    "end_to_end": _schema(
        root_callback_instance_id=_ID, root_host=_TEXT, root_pid=_NUMBER, root_tid=_NUMBER,
        root_start_ns=_TIME, path=pa.list_(_TEXT),
        sink_host=_TEXT, sink_pid=_NUMBER, sink_tid=_NUMBER, sink_node=_TEXT,
        sink_take_id=_ID, sink_take_ns=_TIME, sink_end_ns=_TIME, latency_ns=_COUNT,
    ),
    "executor_state": _schema(
        host=_TEXT, pid=_NUMBER, tid=_NUMBER, start_ns=_TIME, end_ns=_TIME, state=_TEXT
    ),
    "request": _schema(
        request_id=_ID, service_name=_TEXT, client_gid=_GID, sequence_number=_COUNT,
        client_host=_TEXT, client_pid=_NUMBER, client_tid=_NUMBER, client_node=_TEXT,
        client_handle=_HANDLE, sent_ns=_TIME, sender_callback_instance_id=_ID,
        service_host=_TEXT, service_pid=_NUMBER, service_tid=_NUMBER, service_node=_TEXT,
        service_handle=_HANDLE, taken_ns=_TIME, callback_instance_id=_ID,
    ),
    "response": _schema(
        request_id=_ID, service_name=_TEXT, client_gid=_GID, sequence_number=_COUNT,
        source_timestamp_ns=_TIME,
        service_host=_TEXT, service_pid=_NUMBER, service_tid=_NUMBER, sent_ns=_TIME,
        client_host=_TEXT, client_pid=_NUMBER, client_tid=_NUMBER, taken_ns=_TIME,
    ),
    "goal": _schema(goal_id=_ID, is_accepted=_FLAG, result_request_id=_ID),
    "goal_message": _schema(goal_id=_ID, publication_id=_ID),
    "link_call": _schema(
        request_id=_ID, is_response=_FLAG, publication_id=_ID, sent_request_id=_ID,
        answered_request_id=_ID,
    ),
    "user_event": _schema(
        user_event_id=_ID, host=_TEXT, pid=_NUMBER, tid=_NUMBER, name=_TEXT, at_ns=_TIME,
        callback_instance_id=_ID, frame=_COUNT, score=pa.float64(), label=_TEXT,
    ),
    "lifecycle_transition": _schema(
        host=_TEXT, pid=_NUMBER, tid=_NUMBER, node=_TEXT, at_ns=_TIME, start_state=_TEXT,
        goal_state=_TEXT,
    ),
    "trace": _schema(host=_TEXT, pid=_NUMBER, path=_TEXT, clock_error_ns=_COUNT),
    "dds_event": _schema(
        publication_id=_ID, host=_TEXT, pid=_NUMBER, tid=_NUMBER, event=_TEXT, ts_ns=_TIME
    ),
    "declared": _schema(event=_TEXT, field=_TEXT),
    "unrecorded": _schema(
        host=_TEXT, pid=_NUMBER, tid=_NUMBER, cpu=_NUMBER, event=_TEXT, ts_ns=_TIME, cause=_TEXT
    ),
    "missing_packet": _schema(
        host=_TEXT, pid=_NUMBER, cpu=_NUMBER, since_ns=_TIME, end_ns=_TIME, cause=_TEXT
    ),
    "arrival": _schema(take_id=_ID, arrived_ns=_TIME),
    "thread_state": _schema(
        host=_TEXT, pid=_NUMBER, tid=_NUMBER, state=_TEXT, cpu=_NUMBER, start_ns=_TIME,
        end_ns=_TIME, waker_kind=_TEXT, waker_tid=_NUMBER,
    ),
    "cpu_run": _schema(
        host=_TEXT, cpu=_NUMBER, kernel_tid=_NUMBER, name=_TEXT, priority=_NUMBER, start_ns=_TIME,
        end_ns=_TIME,
    ),
    "interrupt": _schema(host=_TEXT, cpu=_NUMBER, kind=_TEXT, start_ns=_TIME, end_ns=_TIME),
    "kernel_loss": _schema(host=_TEXT, start_ns=_TIME, end_ns=_TIME, is_counted=_FLAG),
    "emitted": _schema(host=_TEXT, pid=_NUMBER, tid=_NUMBER, cpu=_NUMBER, ts_ns=_TIME),
}  # fmt: skip


class TruthTable:
    """One table; rows go to disk in groups, so that memory stays bounded."""

    def __init__(self, path: Path, schema: pa.Schema) -> None:
        self.path = path
        self.count = 0
        self._schema = schema
        self._rows: list[tuple[object, ...]] = []
        self._writer = pq.ParquetWriter(path, schema)

    def add(self, *row: object) -> None:
        """Append one row: values in the order of the columns."""
        self._rows.append(row)
        if len(self._rows) == _ROWS_PER_GROUP:
            self._flush()

    def close(self) -> None:
        """Complete the file."""
        self._flush()
        self._writer.close()

    def _flush(self) -> None:
        if not self._rows:
            return
        columns = zip(zip(*self._rows, strict=True), self._schema, strict=True)
        arrays = [pa.array(column, type=field.type) for column, field in columns]
        self._writer.write_batch(pa.RecordBatch.from_arrays(arrays, schema=self._schema))
        self.count += len(self._rows)
        self._rows.clear()


class Truth:
    """All tables, one attribute each."""

    def __init__(self, directory: Path) -> None:
        directory.mkdir()
        self.tables = {
            name: TruthTable(directory / f"{name}.parquet", schema)
            for name, schema in _SCHEMAS.items()
        }
        for name, table in self.tables.items():
            setattr(self, name, table)

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> TruthTable: ...

    def close(self) -> None:
        """Complete all files."""
        for table in self.tables.values():
            table.close()
