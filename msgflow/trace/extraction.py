"""Extraction of archives, which trusts nothing that stands in them.

Nothing is written through a link: regular files come first, links are made when all files are
there, and removed again if they lead nowhere. Owners, modes and times are not restored.
"""

from __future__ import annotations

import contextlib
import gzip
import lzma
import os
import re
import shutil
import stat
import struct
import tarfile
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import IO, Any

from msgflow.errors import TraceError, UsageError

_CHUNK = 1 << 20
_MOST_HEADER_BYTES = 1 << 20
_MOST_LINK_BYTES = 4096
_FREE_PART_LEFT = 20
LIMIT_VARIABLE = "MSGFLOW_UNPACK_LIMIT"
"""Environment variable: most bytes that an archive may have unpacked, such as 20GB."""

MOST_UNPACKED = 1 << 30
"""Every archive may have so many bytes unpacked."""

# Traces are packed ten to thirty times smaller, with the zeros at the ends of packets up to fifty.
_MOST_RATIO = 64
_UNITS = {"": 1, "K": 10**3, "M": 10**6, "G": 10**9, "T": 10**12}
_SIZE = re.compile(r"(\d{1,15})\s*([KMGT]?)B?", re.IGNORECASE | re.ASCII)
# What a file takes on the disk at least, however small it is.
_BYTES_PER_MEMBER = 4096
_SPECIAL = "is a device or another special file"
_ZIP = b"PK"
_REGULAR_END: type[Exception] = tarfile.EOFHeaderError  # type: ignore[attr-defined]
_LONG_HEADERS = {
    tarfile.XHDTYPE,
    tarfile.XGLTYPE,
    tarfile.SOLARIS_XHDTYPE,
    tarfile.GNUTYPE_LONGNAME,
    tarfile.GNUTYPE_LONGLINK,
}

_MAGIC_SIZE = 6
_GZIP = b"\x1f\x8b"
_XZ = b"\xfd7zXZ\x00"
# What Arrow unpacks: the standard library learned Zstandard only in Python 3.14, and LZ4 never.
_OF_ARROW = {b"\x28\xb5\x2f\xfd": "zstd", b"\x04\x22\x4d\x18": "lz4"}

# What reading a damaged archive raises; gzip and Arrow raise an OSError without a number.
_CORRUPT = (
    tarfile.TarError,
    zipfile.BadZipFile,
    lzma.LZMAError,
    zlib.error,
    struct.error,
    EOFError,
    UnicodeError,
    ValueError,
)
# What reading an encrypted archive, or one of an unknown compression, raises.
_UNPACKABLE = (RuntimeError, NotImplementedError)


def unpack(archive: Path, directory: Path) -> None:
    """Unpack an archive into an empty directory."""
    try:
        target = Target(archive, directory)
        with archive.open("rb") as file:
            if file.peek(len(_ZIP)).startswith(_ZIP):
                _unpack_zip(file, target)
            else:
                _unpack_tar(file, target)
        target.make_links()
    except _UNPACKABLE as error:
        raise TraceError(
            f"the archive cannot be unpacked ({_reason(error)}) — {archive}",
            hint="unpack it by hand and give the directory",
        ) from error
    except (*_CORRUPT, OSError) as error:
        if isinstance(error, OSError) and error.errno is not None:
            raise TraceError(
                f"cannot unpack the archive ({error.strerror}) — {archive}",
                hint="TMPDIR=DIRECTORY msgflow … unpacks it elsewhere",
            ) from error
        raise TraceError(
            f"the archive is damaged or cut off ({_reason(error)}) — {archive}",
            hint="copy or pack it again from where the trace was recorded",
        ) from error


def limit_of(packed: int) -> int:
    """Return how much an archive of so many bytes may have unpacked [bytes]."""
    text = os.environ.get(LIMIT_VARIABLE)
    if text is None:
        return max(MOST_UNPACKED, _MOST_RATIO * packed)
    match = _SIZE.fullmatch(text.strip())
    if match is None:
        raise UsageError(f"not an amount of bytes: {text} — {LIMIT_VARIABLE}", "give one like 20GB")
    return int(match[1]) * _UNITS[match[2].upper()]


def _reason(error: Exception) -> str:
    return str(error).rstrip(".") or "it ends too early"


class Target:
    """A directory that is being filled, never beyond its borders nor those of the disk."""

    def __init__(self, archive: Path, directory: Path) -> None:
        free = shutil.disk_usage(directory).free
        self.archive = archive
        self.directory = directory
        self.links: list[tuple[str, Path, str]] = []
        self.room = free - free // _FREE_PART_LEFT
        self.limit = limit_of(archive.stat().st_size)
        self.size = 0

    def take(self, size: int) -> None:
        """Use up some bytes of the disk."""
        self.size += size
        if self.size > self.limit:
            raise TraceError(
                f"the archive has more than {self.limit:,} bytes unpacked, "
                f"{self.archive.stat().st_size:,} packed — {self.archive}",
                hint=f"{LIMIT_VARIABLE}=100GB msgflow … reads it, if you know who made it; or "
                "unpack it by hand and give the directory",
            )
        self.room -= size
        if self.room < 0:
            raise TraceError(
                f"not enough free disk space in {tempfile.gettempdir()} to unpack the archive — "
                f"{self.archive}",
                hint="TMPDIR=DIRECTORY msgflow … unpacks it on another disk",
            )

    def expect(self, size: int) -> None:
        """Refuse a member of this size before anything of it is written, if it is too large."""
        if self.size + size > self.limit:
            self.take(size)

    def place(self, member: str) -> Path:
        """Return where a member belongs."""
        self.take(_BYTES_PER_MEMBER)
        path = PurePosixPath(member)
        if path.is_absolute() or ".." in path.parts:
            raise self.refusal(member, "would lie outside of it")
        return self.directory.joinpath(*path.parts)

    def make_directory(self, member: str) -> None:
        """Make a directory."""
        with _of_one_kind(member):
            self.place(member).mkdir(parents=True, exist_ok=True)

    def write(self, member: str, content: IO[bytes]) -> None:
        """Write a regular file."""
        place = self.place(member)
        with _of_one_kind(member):
            place.parent.mkdir(parents=True, exist_ok=True)
            file = place.open("wb")
        with file:
            while chunk := content.read(_CHUNK):
                self.take(len(chunk))
                file.write(chunk)

    def add_hard_link(self, member: str, earlier: str) -> None:
        """Make a second name of a file that came before."""
        place, source = self.place(member), self.place(earlier)
        if not source.is_file():
            raise tarfile.ReadError(f"{member} is a link to {earlier}, which is missing")
        with _of_one_kind(member):
            place.parent.mkdir(parents=True, exist_ok=True)
            place.unlink(missing_ok=True)
        os.link(source, place)

    def add_symbolic_link(self, member: str, to: str) -> None:
        """Remember a link."""
        self.links.append((member, self.place(member), to))

    def make_links(self) -> None:
        """Make the symbolic links; where they lead is only certain when all are made."""
        for member, place, _ in self.links:
            with _of_one_kind(member):
                place.parent.mkdir(parents=True, exist_ok=True)
        # Every parent is a directory now, and stays one: no link takes a directory's place.
        for member, place, to in self.links:
            with _of_one_kind(member):
                place.unlink(missing_ok=True)
                place.symlink_to(to)
        for place in {place for member, place, _ in self.links if not self._leads_inside(member)}:
            place.unlink()

    def _leads_inside(self, member: str) -> bool:
        """Tell whether a link leads to something; outside of the directory it must not lead."""
        place = self.place(member)
        try:
            end, is_there = os.path.realpath(place, strict=True), True
        except OSError:  # leads nowhere, or in a circle
            end, is_there = os.path.realpath(place), False
        if not Path(end).is_relative_to(self.directory.resolve()):
            raise self.refusal(member, "is a link that leads outside of it")
        return is_there

    def refusal(self, member: str, why: str) -> TraceError:
        """Return the error about a member that no trace has."""
        return TraceError(
            f"a member of the archive {why}: {member!r} — {self.archive}",
            hint="ask who made it; msgflow reads no such archive",
        )


@contextlib.contextmanager
def _of_one_kind(member: str) -> Iterator[None]:
    """Say so if a name in the archive is that of a directory and of something else."""
    try:
        yield
    except (FileExistsError, IsADirectoryError, NotADirectoryError) as error:
        what = f"{member!r} is both a directory and something else in it"
        raise tarfile.ReadError(what) from error


class _Member(tarfile.TarInfo):
    """A member of a tar; unlike its base it takes no damage for the end, nor all memory."""

    @classmethod
    def frombuf(cls, buf: bytes | bytearray, encoding: str, errors: str) -> _Member:
        member = super().frombuf(buf, encoding, errors)
        if member.type in _LONG_HEADERS and member.size > _MOST_HEADER_BYTES:
            raise tarfile.ReadError("a header of absurd size")
        return member

    @classmethod
    def fromtarfile(cls, tar: Any) -> _Member:
        try:
            return super().fromtarfile(tar)
        except tarfile.HeaderError as error:
            if isinstance(error, _REGULAR_END):
                raise
            raise tarfile.ReadError(str(error)) from error


def _unpack_tar(file: IO[bytes], target: Target) -> None:
    with (
        _open_plain(file) as content,
        tarfile.open(fileobj=content, mode="r|", tarinfo=_Member) as tar,
    ):
        for member in tar:
            if member.isdir():
                target.make_directory(member.name)
            elif member.isreg():
                source = tar.extractfile(member)
                assert source is not None
                target.expect(member.size)
                target.write(member.name, source)
            elif member.islnk():
                target.add_hard_link(member.name, member.linkname)
            elif member.issym():
                target.add_symbolic_link(member.name, member.linkname)
            else:
                raise target.refusal(member.name, _SPECIAL)
        # Checksums stand at the end of the compressed stream, behind the end of the tar.
        while rest := content.read(_CHUNK):
            target.take(len(rest))


def _unpack_zip(file: IO[bytes], target: Target) -> None:
    with zipfile.ZipFile(file) as archive:
        for member in archive.infolist():
            kind = stat.S_IFMT(member.external_attr >> 16)
            if member.is_dir():
                target.make_directory(member.filename)
            elif kind == stat.S_IFLNK:
                with archive.open(member) as content:
                    to = content.read(_MOST_LINK_BYTES)
                target.add_symbolic_link(member.filename, os.fsdecode(to))
            elif kind in (0, stat.S_IFREG):
                target.expect(member.file_size)
                with archive.open(member) as content:
                    target.write(member.filename, content)
            else:
                raise target.refusal(member.filename, _SPECIAL)


def _open_plain(file: IO[bytes]) -> Any:
    """Return the content of a file, decompressed as its first bytes say.

    It has a method `read`, which raises an OSError or one of `_CORRUPT` where that is damaged.
    """
    magic = file.read(_MAGIC_SIZE)
    file.seek(0)
    if magic.startswith(_GZIP):
        return gzip.open(file)
    if magic.startswith(_XZ):
        return lzma.LZMAFile(file)
    for first, name in _OF_ARROW.items():
        if magic.startswith(first):
            import pyarrow

            return pyarrow.CompressedInputStream(pyarrow.PythonFile(file, "r"), name)
    return file
