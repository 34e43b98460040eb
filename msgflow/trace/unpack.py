"""Unpacks archives of traces, trusting nothing that stands in them.

Nothing is written through a link: regular files come first, links are made when all files are
there, and removed again if they lead nowhere. Owners, modes and times are not restored.
"""

from __future__ import annotations

import os
import shutil
import stat
import tarfile
import tempfile
import zipfile
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import IO, Any

from msgflow.errors import TraceError
from msgflow.trace.compression import CORRUPT, UNPACKABLE, open_plain

_CHUNK = 1 << 20
_MOST_HEADER_BYTES = 1 << 20
_MOST_LINK_BYTES = 4096
_FREE_PART_LEFT = 20
# What a file takes on the disk at least, however small it is.
_BYTES_PER_MEMBER = 4096
_ZIP = b"PK"
_REGULAR_END: type[Exception] = tarfile.EOFHeaderError  # type: ignore[attr-defined]
_LONG_HEADERS = {
    tarfile.XHDTYPE,
    tarfile.XGLTYPE,
    tarfile.SOLARIS_XHDTYPE,
    tarfile.GNUTYPE_LONGNAME,
    tarfile.GNUTYPE_LONGLINK,
}


def unpack(archive: Path, directory: Path) -> None:
    """Unpack an archive into an empty directory.

    Raises:
        TraceError: it is damaged, encrypted, too large for the disk, or has a member that is a
            device or would lie, or lead, outside of the directory.
    """
    target = _Target(archive, directory)
    try:
        with archive.open("rb") as file:
            if file.peek(len(_ZIP)).startswith(_ZIP):
                _unpack_zip(file, target)
            else:
                _unpack_tar(file, target)
        target.make_links()
    except UNPACKABLE as error:
        raise TraceError(
            f"the archive cannot be unpacked ({_reason(error)}) — {archive}",
            hint="unpack it by hand and give the directory",
        ) from error
    except CORRUPT as error:
        raise TraceError(
            f"the archive is damaged or cut off ({_reason(error)}) — {archive}",
            hint="copy or pack it again from where the trace was recorded",
        ) from error
    except OSError as error:
        raise TraceError(
            f"cannot unpack the archive ({error.strerror or error}) — {archive}",
            hint="TMPDIR=DIRECTORY msgflow … unpacks it elsewhere",
        ) from error


def _reason(error: Exception) -> str:
    return str(error).rstrip(".") or "it ends too early"


@dataclass
class _Target:
    """A directory that is being filled, never beyond its borders nor those of the disk."""

    archive: Path
    directory: Path
    links: list[tuple[str, Path, str]] = field(default_factory=list)
    room: int = field(init=False)

    def __post_init__(self) -> None:
        free = shutil.disk_usage(self.directory).free
        self.room = free - free // _FREE_PART_LEFT

    def take(self, size: int) -> None:
        """Use up some bytes of the disk."""
        self.room -= size
        if self.room < 0:
            raise TraceError(
                f"not enough free disk space in {tempfile.gettempdir()} to unpack the archive — "
                f"{self.archive}",
                hint="TMPDIR=DIRECTORY msgflow … unpacks it on another disk",
            )

    def place(self, member: str) -> Path:
        """Return where a member belongs."""
        self.take(_BYTES_PER_MEMBER)
        path = PurePosixPath(member)
        if path.is_absolute() or ".." in path.parts:
            raise self._refusal(member, "would lie outside of it")
        return self.directory.joinpath(*path.parts)

    def make_directory(self, member: str) -> None:
        """Make a directory."""
        self.place(member).mkdir(parents=True, exist_ok=True)

    def write(self, member: str, content: IO[bytes]) -> None:
        """Write a regular file."""
        place = self.place(member)
        place.parent.mkdir(parents=True, exist_ok=True)
        with place.open("wb") as file:
            while chunk := content.read(_CHUNK):
                self.take(len(chunk))
                file.write(chunk)

    def add_hard_link(self, member: str, earlier: str) -> None:
        """Make a second name of a file that came before."""
        place, source = self.place(member), self.place(earlier)
        if not source.is_file():
            raise tarfile.ReadError(f"{member} is a link to {earlier}, which is missing")
        place.parent.mkdir(parents=True, exist_ok=True)
        place.unlink(missing_ok=True)
        os.link(source, place)

    def add_symbolic_link(self, member: str, to: str) -> None:
        """Remember a link."""
        self.links.append((member, self.place(member), to))

    def refuse_special(self, member: str) -> TraceError:
        """Return the error about a device, pipe or the like."""
        return self._refusal(member, "is a device or another special file")

    def make_links(self) -> None:
        """Make the symbolic links; where they lead is only certain when all are made."""
        for _, place, _ in self.links:
            place.parent.mkdir(parents=True, exist_ok=True)
        # Every parent is a directory now, and stays one: no link takes the place of a directory.
        for _, place, to in self.links:
            place.unlink(missing_ok=True)
            place.symlink_to(to)
        dangling = {place for member, place, _ in self.links if not self._leads_inside(member)}
        for place in dangling:
            place.unlink()

    def _leads_inside(self, member: str) -> bool:
        """Tell whether a link leads to something; outside of the directory it must not lead."""
        place = self.place(member)
        try:
            end, is_there = os.path.realpath(place, strict=True), True
        except FileNotFoundError:
            end, is_there = os.path.realpath(place), False
        if not Path(end).is_relative_to(self.directory.resolve()):
            raise self._refusal(member, "is a link that leads outside of it")
        return is_there

    def _refusal(self, member: str, why: str) -> TraceError:
        return TraceError(
            f"a member of the archive {why}: {member!r} — {self.archive}",
            hint="ask who made it; msgflow reads no such archive",
        )


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


def _unpack_tar(file: IO[bytes], target: _Target) -> None:
    with (
        open_plain(file) as content,
        tarfile.open(fileobj=content, mode="r|", tarinfo=_Member) as tar,
    ):
        for member in tar:
            if member.isdir():
                target.make_directory(member.name)
            elif member.isreg():
                source = tar.extractfile(member)
                assert source is not None
                target.write(member.name, source)
            elif member.islnk():
                target.add_hard_link(member.name, member.linkname)
            elif member.issym():
                target.add_symbolic_link(member.name, member.linkname)
            else:
                raise target.refuse_special(member.name)
        # Checksums stand at the end of the compressed stream, behind the end of the tar.
        while content.read(_CHUNK):
            pass


def _unpack_zip(file: IO[bytes], target: _Target) -> None:
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
                with archive.open(member) as content:
                    target.write(member.filename, content)
            else:
                raise target.refuse_special(member.filename)
