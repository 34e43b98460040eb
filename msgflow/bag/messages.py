"""Bags: messages of a rosbag2 of the same run, joined to their publications.

A trace has neither the size nor the content of a message. A bag has both, and says when the
recorder received each message. It does not name the publication: `schema/internal/bag` finds it.
"""

from __future__ import annotations

import contextlib
import errno
import importlib.util
import re
import resource
import tempfile
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from msgflow.confined.process import ConfinedProcess
from msgflow.db.memory import bound, bound_process, default_limit, set_memory_limit
from msgflow.errors import QueryError, TraceError, UsageError
from msgflow.result.query_result import QueryResult
from msgflow.sql.statement import internal_sql
from msgflow.text.installation import install_command
from msgflow.trace.extraction import LIMIT_VARIABLE, limit_of
from msgflow.trace.regular_file import irregular

if TYPE_CHECKING:
    import duckdb
    from rosbags.interfaces import Connection
    from rosbags.rosbag2 import Reader
    from rosbags.typesys.store import Typestore

    from msgflow.run.choice import Run

_HEADER = "std_msgs/msg/Header"
_SCHEMA = pa.schema(
    {
        "message": pa.int64(),
        "topic_name": pa.string(),
        "type_name": pa.string(),
        "received_ns": pa.int64(),
        "size_bytes": pa.int64(),
        "stamp_ns": pa.int64(),
        "frame_id": pa.string(),
    }
)
_ROWS_AT_ONCE = 50_000
# It repeats the whole definition.
_LONGEST_REASON = 1 << 7
# Stands before each type in a definition of the interface language.
_IDL = re.compile(r"^=+\nIDL: .*\n", re.MULTILINE)
_CLOCKS_APART = """
SELECT count(*) > 1
    AND (count(reference_clock_id) < count(*) OR count(DISTINCT reference_clock_id) > 1)
FROM main.clock
WHERE run_id = ?
"""
_STORED = """
INSERT INTO store.bag_message BY NAME
SELECT $run_id AS run_id, publication_id, topic_name, type_name, received_ns, size_bytes, stamp_ns,
    frame_id
FROM bag_joined
WHERE publication_id IS NOT NULL
ORDER BY publication_id
"""


@contextlib.contextmanager
def read_bag(bag: Path, *, memory_limit: str | None = None) -> Iterator[pa.RecordBatchReader]:
    """Have the messages of a bag, in the order of their receipt.

    What chunks, messages and definitions of types take in memory, and files on the disk, is known
    only when rosbags has unpacked them: the bounds are those of the process that does so.

    Yields:
        Rows with `message` (number), `topic_name`, `type_name`, `received_ns`, `size_bytes` (of
        the serialised message), and where the type has a header `stamp_ns` and `frame_id`. The
        metadata of their schema have the topics that are left out, each with the reason.
    """
    if importlib.util.find_spec("rosbags") is None:
        raise UsageError(
            "the package that reads bags is not installed — rosbags",
            install_command("rosbags"),
        )
    if not bag.exists():
        raise TraceError(f"no such bag — {bag}", "give the directory of a rosbag2")
    size = 0
    for file in (bag, *(bag.rglob("*") if bag.is_dir() else ())):
        if kind := irregular(file):
            raise TraceError(f"{kind}, no file — {file}", "copy the bag again, with cp -rL")
        size += file.stat().st_size
    with tempfile.TemporaryDirectory(prefix="msgflow-") as place:
        target = Path(place, "messages")
        bounds = {"memory_limit": memory_limit or default_limit(), "most_bytes": limit_of(size)}
        with ConfinedProcess(__name__) as process:
            try:
                process.call("write_messages", {"bag": str(bag), "target": str(target)} | bounds)
            except QueryError as error:  # it has ended
                raise _unread(bag, error) from error
        with pa.OSFile(str(target)) as file, pa.ipc.open_stream(file) as messages:
            yield messages


def write_messages(
    write: Callable[[Any], int], *, bag: str, target: str, memory_limit: str, most_bytes: int
) -> None:
    """Write the messages of a bag to a file, in the child; what it unpacks lies beside it."""
    import duckdb
    from rosbags.rosbag2 import Reader

    path = Path(bag)
    tempfile.tempdir = str(Path(target).parent)
    bound(resource.RLIMIT_FSIZE, most_bytes)
    with duckdb.connect() as con:
        set_memory_limit(con, memory_limit)
        bound_process(con)
    try:
        with Reader(path) as reader, pa.OSFile(target, "w") as stream:
            stores, left_out = _types(reader.connections)
            schema = _SCHEMA.with_metadata(left_out)
            with pa.ipc.new_stream(stream, schema) as rows:
                for table in _tables(reader, stores, left_out, most_bytes):
                    rows.write_table(table.replace_schema_metadata(left_out))
    except MemoryError:
        raise TraceError(
            f"the bag takes more memory unpacked than {memory_limit} — {bag}",
            "MSGFLOW_MEMORY_LIMIT=20GB msgflow … reads it, if you know who made it",
        ) from None
    except Exception as error:  # what its parsers raise in a damaged file has no common class
        if isinstance(error, OSError) and error.errno == errno.EFBIG:
            raise TraceError(
                f"the bag has more than {most_bytes:,} bytes unpacked — {bag}",
                f"{LIMIT_VARIABLE}=100GB msgflow … reads it, if you know who made it",
            ) from None
        raise _unread(path, error) from error


def _unread(bag: Path, error: Exception) -> TraceError:
    return TraceError(
        f"cannot read as a bag of ROS 2: {_line(error) or type(error).__name__} — {bag}",
        "give the directory of a rosbag2, or one of its files; ros2 bag reindex repairs one that"
        " was cut off",
    )


def _line(error: Exception) -> str:
    return " ".join(str(error).split())


def _types(connections: Sequence[Connection]) -> tuple[dict[str, Typestore], dict[str, str]]:
    """Return by name what reads types with a header, and why topics of other types are left out.

    Of services `ros2 bag record` writes definitions that are none of a message.
    """
    from rosbags.interfaces import MessageDefinitionFormat, Nodetype
    from rosbags.typesys import (
        Stores,
        TypesysError,
        get_types_from_idl,
        get_types_from_msg,
        get_typestore,
    )

    stores: dict[str, Typestore] = {}
    left_out = {}
    # Bags from before Iron do not hold their types.
    of_ros = get_typestore(Stores.LATEST)
    for connection in connections:
        name, (kind, text) = connection.msgtype, connection.msgdef
        store = of_ros
        try:
            if kind != MessageDefinitionFormat.NONE:
                store = get_typestore(Stores.EMPTY)
                if kind == MessageDefinitionFormat.MSG:
                    store.register(get_types_from_msg(text, name))
                else:
                    for part in _IDL.split(text):
                        store.register(get_types_from_idl(part) if part.strip() else {})
        except TypesysError as error:
            reason = _line(error)[:_LONGEST_REASON]
            left_out[connection.topic] = f"the definition of {name} cannot be read: {reason}"
            continue
        _, fields = store.fielddefs.get(name, ((), ()))
        if ("header", (Nodetype.NAME, _HEADER)) in fields:
            stores[name] = store
    return stores, left_out


def _tables(
    reader: Reader,
    stores: Mapping[str, Typestore],
    left_out: Container[str],
    most_bytes: int,
) -> Iterator[pa.Table]:
    rows: list[dict[str, Any]] = []
    number = 0
    packed = reader.compression_mode == "message"
    left = most_bytes
    for number, (connection, received_ns, data) in enumerate(reader.messages(), 1):
        left -= len(data) if packed else 0
        if left < 0:
            raise OSError(errno.EFBIG, "messages are too large")
        if connection.topic in left_out:
            continue
        stamp_ns = frame_id = None
        if (store := stores.get(connection.msgtype)) is not None:
            message: Any = store.deserialize_cdr(data, connection.msgtype)
            stamp = message.header.stamp
            stamp_ns = stamp.sec * 1_000_000_000 + stamp.nanosec
            frame_id = message.header.frame_id
        rows.append(
            {
                "message": number,
                "topic_name": connection.topic,
                "type_name": connection.msgtype,
                "received_ns": received_ns,
                "size_bytes": len(data),
                "stamp_ns": stamp_ns,
                "frame_id": frame_id,
            }
        )
        if len(rows) == _ROWS_AT_ONCE:
            yield pa.Table.from_pylist(rows, _SCHEMA)
            rows = []
    if number != reader.message_count:
        raise ValueError(
            f"it has {number:,} of the {reader.message_count:,} messages that it names"
        )
    if rows or not number:
        yield pa.Table.from_pylist(rows, _SCHEMA)


def join_bag(
    con: duckdb.DuckDBPyConnection, runs: tuple[Run, ...], messages: pa.RecordBatchReader
) -> QueryResult:
    """Store which publications the messages of a bag are of; see `Database.join_bag`."""
    if len(runs) > 1:
        raise UsageError("a bag is of one run", "give its name with --run")
    (one,) = runs
    if con.execute(_CLOCKS_APART, [one.run_id]).fetchall() == [(True,)]:
        raise UsageError(
            f"the run has hosts whose clocks are not synchronised — {one.name}",
            f"msgflow clocks apply messages --run {one.name}",
        )
    given: dict[str, Any] = {"run_id": one.run_id}
    notes = [
        f"{topic.decode()} is left out: {reason.decode()}"
        for topic, reason in (messages.schema.metadata or {}).items()
    ]
    con.register("bag_messages", messages)
    con.execute("CREATE OR REPLACE TEMP TABLE bag_read AS FROM bag_messages")
    con.unregister("bag_messages")
    internal_sql().keep(con, "bag_joined", given)
    con.execute("DELETE FROM store.bag_message WHERE run_id = $run_id", given)
    con.execute(_STORED, given)
    table = internal_sql().run(con, "bag_topic", given).to_arrow_table()
    con.execute("DROP TABLE temp.bag_read")
    con.execute("DROP TABLE temp.bag_joined")
    return QueryResult(table, internal_sql().header("bag_topic"), runs, notes)
