"""Messages of a bag, read with the package rosbags."""

from __future__ import annotations

import contextlib
import io
import os
import struct
from typing import IO, TYPE_CHECKING, Any

import pyarrow as pa

from msgflow.errors import TraceError, UsageError
from msgflow.trace.compression import CORRUPT, open_plain
from msgflow.trace.extraction import LIMIT_VARIABLE, limit_of
from msgflow.trace.regular_file import irregular

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

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
_BYTES_AT_ONCE = 1 << 20
_MCAP_MAGIC_SIZE = 8
# Of each record of MCAP: its kind and its length.
_RECORD = struct.Struct("<BQ")
_CHUNK = 6
_BEFORE_COMPRESSION = 28


def read_bag(bag: Path) -> Iterator[pa.Table]:
    """Yield the messages of a bag in the order of their receipt, in one table or more.

    Yields:
        Tables with `message` (number), `topic_name`, `type_name`, `received_ns`, `size_bytes` (of
        the serialised message), and where the type has a header `stamp_ns` and `frame_id`.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise UsageError(
            "the package that reads bags is not installed — rosbags",
            "pip install rosbags; or in a checkout of msgflow: uv tool install '.[bag]'",
        ) from None
    if not bag.exists():
        raise TraceError(f"no such bag — {bag}", "give the directory of a rosbag2")
    _require_safe(bag)
    try:
        # Bags from before Iron do not hold their types. The reader knows those of ROS itself.
        with AnyReader([bag], default_typestore=get_typestore(Stores.LATEST)) as reader:
            if any(getattr(each, "compression_mode", None) == "message" for each in reader.readers):
                _require_sizes_of_messages(bag)
            yield from _tables(reader)
    except TraceError:
        raise
    except Exception as error:  # what its parsers raise in a damaged file has no common class
        said = str(error).strip().splitlines()
        raise TraceError(
            f"cannot read as a bag of ROS 2: {said[0] if said else type(error).__name__} — {bag}",
            "give the directory of a rosbag2; ros2 bag reindex repairs one that was cut off",
        ) from error


def _require_safe(bag: Path) -> None:
    """Raise where a bag would hang its reader, or fill the disk or the memory that unpacks it."""
    files = [bag, *(bag.rglob("*") if bag.is_dir() else ())]
    for file in files:
        if kind := irregular(file):
            raise TraceError(f"{kind}, no file — {file}", "copy the bag again, with cp -rL")
        if not file.is_file():
            continue
        with file.open("rb") as opened, contextlib.suppress(*CORRUPT):
            if file.suffix == ".zstd":
                _require_size(file, [opened])
            elif file.suffix == ".mcap":
                _require_size(file, _chunks(opened))


def _require_sizes_of_messages(bag: Path) -> None:
    """Raise where messages that were compressed one by one are larger than the limit."""
    from rosbags.rosbag2 import Reader

    for file in sorted(bag.rglob("*")):
        if file.suffix in (".db3", ".mcap"):
            # The file alone does not say that its messages are compressed: they come as they are.
            with Reader(file) as reader, contextlib.suppress(*CORRUPT):
                _require_size(file, (io.BytesIO(data) for _, _, data in reader.messages()))


def _require_size(file: Path, parts: Iterable[IO[bytes]]) -> None:
    """Raise where compressed parts of a file have more bytes than the limit of archives."""
    left = limit_of(file)
    for part in parts:
        content = open_plain(part)
        while chunk := content.read(_BYTES_AT_ONCE):
            left -= len(chunk)
            if left < 0:
                raise TraceError(
                    f"the file has more than {limit_of(file):,} bytes unpacked — {file}",
                    f"{LIMIT_VARIABLE}=100GB msgflow … reads it, if you know who made it",
                )


def _chunks(file: IO[bytes]) -> Iterator[IO[bytes]]:
    """Yield the chunks of an MCAP file as they stand there: see its specification, Records."""
    size = os.fstat(file.fileno()).st_size
    file.seek(_MCAP_MAGIC_SIZE)
    while len(head := file.read(_RECORD.size)) == _RECORD.size:
        kind, length = _RECORD.unpack(head)
        end = file.tell() + length
        if kind == _CHUNK:
            # Times, size, and checksum; then the name of the compression, and the size of the rest.
            file.seek(_BEFORE_COMPRESSION, os.SEEK_CUR)
            (name_size,) = struct.unpack("<I", file.read(4))
            file.seek(name_size + 8, os.SEEK_CUR)
            yield io.BytesIO(file.read(max(0, min(end, size) - file.tell())))
        file.seek(min(end, size))


def _tables(reader: Any) -> Iterator[pa.Table]:
    with_header = {
        connection.msgtype
        for connection in reader.connections
        if connection.msgtype in reader.typestore.fielddefs
        and ("header", _HEADER) in _named_fields(reader, connection.msgtype)
    }
    rows: list[tuple[Any, ...]] = []
    number = 0
    for number, (connection, received_ns, data) in enumerate(reader.messages(), 1):
        stamp_ns = frame_id = None
        if connection.msgtype in with_header:
            header = reader.deserialize(data, connection.msgtype).header
            stamp_ns = header.stamp.sec * 1_000_000_000 + header.stamp.nanosec
            frame_id = header.frame_id
        rows.append(
            (number, connection.topic, connection.msgtype, received_ns, len(data), stamp_ns,
             frame_id)
        )  # fmt: skip
        if len(rows) == _ROWS_AT_ONCE:
            yield _table(rows)
            rows = []
    if number != reader.message_count:
        raise ValueError(
            f"it has {number:,} of the {reader.message_count:,} messages that it names"
        )
    if rows or not number:
        yield _table(rows)


def _named_fields(reader: Any, type_name: str) -> set[tuple[str, str]]:
    """Return name and type of the fields of a message that are messages themselves."""
    from rosbags.interfaces import Nodetype

    _, fields = reader.typestore.fielddefs[type_name]
    return {(name, detail) for name, (kind, detail) in fields if kind is Nodetype.NAME}


def _table(rows: list[tuple[Any, ...]]) -> pa.Table:
    columns = zip(*rows, strict=True) if rows else [()] * len(_SCHEMA)
    arrays = [pa.array(column, field.type) for column, field in zip(columns, _SCHEMA, strict=True)]
    return pa.Table.from_arrays(arrays, schema=_SCHEMA)
