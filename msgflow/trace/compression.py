"""Compressed files: gzip, xz, Zstandard and LZ4, recognised by their first bytes."""

from __future__ import annotations

import gzip
import io
import lzma
import struct
import tarfile
import zipfile
import zlib
from typing import IO, Any

_MAGIC_SIZE = 6
_GZIP = b"\x1f\x8b"
_XZ = b"\xfd7zXZ\x00"
# What Arrow unpacks: the standard library learned Zstandard only in Python 3.14, and LZ4 never.
_OF_ARROW = {b"\x28\xb5\x2f\xfd": "zstd", b"\x04\x22\x4d\x18": "lz4"}


class _ArrowError(Exception):
    """Data that Arrow unpacks are damaged."""


CORRUPT = (
    tarfile.TarError,
    zipfile.BadZipFile,
    gzip.BadGzipFile,
    lzma.LZMAError,
    zlib.error,
    struct.error,
    _ArrowError,
    EOFError,
    UnicodeError,
    ValueError,
)
"""What reading a damaged archive raises."""

UNPACKABLE = (RuntimeError, NotImplementedError)
"""What reading an encrypted archive, or one of an unknown compression, raises."""


def open_plain(file: IO[bytes]) -> Any:
    """Return the content of a file, decompressed as its first bytes say.

    It has a method `read`, which raises one of `CORRUPT` where the file is damaged.
    """
    magic = file.read(_MAGIC_SIZE)
    file.seek(0)
    if magic.startswith(_GZIP):
        return gzip.open(file)
    if magic.startswith(_XZ):
        return lzma.LZMAFile(file)
    for first, name in _OF_ARROW.items():
        if magic.startswith(first):
            return io.BufferedReader(_Unpacked(file, name))
    return file


class _Unpacked(io.RawIOBase):
    """What Arrow unpacks."""

    def __init__(self, file: IO[bytes], compression: str) -> None:
        import pyarrow

        self._content = pyarrow.CompressedInputStream(pyarrow.PythonFile(file, "r"), compression)

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        try:
            chunk = self._content.read(len(buffer))
        except OSError as error:
            raise _ArrowError(str(error)) from error
        buffer[: len(chunk)] = chunk
        return len(chunk)
