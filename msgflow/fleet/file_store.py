"""The store of a lake or of recordings: a folder, or a bucket of an S3-compatible service.

pyarrow reaches both. Credentials come from the environment only, as for the libraries of AWS. They
are never written, and never part of an address.
"""

from __future__ import annotations

import io
import os
import posixpath
import re
import shutil
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO, TypeVar
from urllib.parse import urlsplit

from pyarrow import fs

from msgflow.errors import DatabaseError, UsageError, require_utf8
from msgflow.files.temporary_owner import mark
from msgflow.trace.regular_file import open_regular

_T = TypeVar("_T")

S3 = "s3://"
MOST_ATTEMPTS = 6
"""Tries of each request, with pauses that double: some 10 s together."""
READ_AT_ONCE = 16
"""Files that are read from a bucket at the same time."""

_CHUNK = 8 * 1024 * 1024
_CONNECT_SECONDS = 10
_REQUEST_SECONDS = 60
# Variables of the environment that name an endpoint, the more specific one first.
_ENDPOINTS = ("AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL")
# A name of a user or a password before the host; a password may have any character.
_USERINFO = re.compile(r"(//)(?:[^/]*:.*|[^/@]*)@")
# The same where `//` was forgotten: names of folders may have a colon as well.
_USERINFO_ALONE = re.compile(r"^([a-z][\w+.-]*:)[^/:]*:.*@", re.I)


@dataclass(frozen=True)
class Entry:
    """A file below a store's root."""

    path: str  # from the root, with `/`
    size: int  # bytes
    changed_ns: int  # when it was written [epoch ns]


class Store:
    """Files below one address.

    A file appears whole or not at all: in a folder it is renamed into place, in a bucket an object
    becomes visible when it is complete.
    """

    def __init__(self, url: str | Path, *, follows_links: bool = True) -> None:
        """Reach a store; nothing is read yet."""
        self.url = normal_url(url)  # the address: an absolute path, or `s3://BUCKET/PREFIX`
        self._follows_links = follows_links
        self.is_local = not self.url.startswith(S3)
        self._root = self.url if self.is_local else self.url.removeprefix(S3)

    @cached_property
    def _real_root(self) -> str:
        return os.path.realpath(self._root)

    @cached_property
    def filesystem(self) -> Any:
        """The `pyarrow.fs.FileSystem`; `full` gives its paths."""
        return fs.LocalFileSystem() if self.is_local else _s3()

    def full(self, path: str = "") -> str:
        """Return the path of a file in `filesystem`."""
        return f"{self._root}/{path}" if path else self._root

    def url_of(self, path: str) -> str:
        """Return the address of a file, for DuckDB, Spark and people."""
        return f"{self.url}/{path}"

    def _require_here(self, path: str) -> None:
        """Raise if a symbolic link below the root leads to a path."""
        if self._is_elsewhere(path):
            raise DatabaseError(
                f"msgflow follows no symbolic link below a lake — {self.url_of(path)}",
                "put the file or folder there that the link leads to",
            )

    def _is_elsewhere(self, path: str) -> bool:
        if self._follows_links or not self.is_local:
            return False
        real = os.path.join(self._real_root, os.path.normpath(path)) if path else self._real_root
        return os.path.realpath(real) != real

    def _reading(self, path: str) -> Any:
        if self.is_local:
            return open_regular(Path(self.full(path)))
        # Otherwise pyarrow unpacks files called .gz or .zst, and packs them again when it writes.
        return self.filesystem.open_input_stream(self.full(path), compression=None)

    def _writing(self, path: str) -> Any:
        return self.filesystem.open_output_stream(self.full(path), compression=None)

    def entries(self, path: str = "") -> list[Entry]:
        """Return the files below a path, sorted; an empty list if there is no such path."""
        above = len(self._root.rstrip("/")) + 1
        found = [
            Entry(info.path[above:], info.size, info.mtime_ns or 0)
            for info in self._found(path, recursive=True)
            if info.type == fs.FileType.File
        ]
        # What a link leads to is of another place.
        here = (entry for entry in found if not self._is_elsewhere(entry.path))
        return sorted(here, key=lambda entry: entry.path)

    def names(self, path: str = "") -> list[str]:
        """Return the names of what is directly below a path, whatever it is, sorted."""
        return sorted(info.base_name for info in self._found(path, recursive=False))

    def _found(self, path: str, *, recursive: bool) -> list[Any]:
        """Return what pyarrow says of all below a path."""
        selector = fs.FileSelector(self.full(path), allow_not_found=True, recursive=recursive)
        with _reaching(self.url):
            return list(self.filesystem.get_file_info(selector))

    def entry(self, path: str = "") -> Entry | None:
        """Return the entry of one file, None if there is no such file."""
        self._require_here(path)
        with _reaching(self.url):
            info = self.filesystem.get_file_info(self.full(path))
        is_file = info.type == fs.FileType.File
        return Entry(path, info.size, info.mtime_ns or 0) if is_file else None

    def read(self, path: str, most: int | None = None) -> bytes | None:
        """Return the content of a small file, None if there is no such file."""
        self._require_here(path)

        def read() -> bytes:
            with self._reading(path) as stream:
                return bytes(stream.read() if most is None else stream.read(most + 1))

        with _reaching(self.url):
            try:
                content = self._downloaded(read)
            except FileNotFoundError:
                return None
        if most is not None and len(content) > most:
            raise DatabaseError(
                f"no file for this: it has more than {most:,} bytes — {self.url_of(path)}",
                "give the file that you meant",
            )
        return content

    def fetch(self, path: str, target: Path) -> None:
        """Copy a file into a new local file."""
        self._require_here(path)

        def copy() -> None:
            with self._reading(path) as stream, target.open("wb") as file:
                shutil.copyfileobj(stream, file, _CHUNK)

        with _reaching(self.url):
            self._downloaded(copy)

    def _downloaded(self, work: Callable[[], _T]) -> _T:
        """Return what `work` reads; once more if that breaks off, as only its begin is repeated."""
        try:
            return work()
        except FileNotFoundError:
            raise
        except OSError:
            if self.is_local:
                raise
            return work()

    def local_files(self, paths: Sequence[str], folder: Path) -> list[str]:
        """Return where files can be read here: those of a bucket are copied into this folder."""

        def local(path: str) -> str:
            if self.is_local:
                self._require_here(path)
                return self.full(path)
            target = folder / path
            target.parent.mkdir(parents=True, exist_ok=True)
            self.fetch(path, target)
            return str(target)

        # Only a bucket makes one wait.
        with ThreadPoolExecutor(1 if self.is_local else READ_AT_ONCE) as pool:
            return list(pool.map(local, paths))

    def put(self, path: str, content: bytes | Path) -> None:
        """Write a file, in place of an existing one."""
        self._require_here(path)
        with (
            _reaching(self.url, writing=True),
            io.BytesIO(content) if isinstance(content, bytes) else content.open("rb") as source,
            self._locally(path) if self.is_local else self._writing(path) as target,
        ):
            shutil.copyfileobj(source, target, _CHUNK)

    @contextmanager
    def _locally(self, path: str) -> Iterator[BinaryIO]:
        target = Path(self.full(path))
        target.parent.mkdir(parents=True, exist_ok=True)
        # Readers ignore it, as files of a lake end with .parquet.
        temporary = target.with_name(f".{target.name}.{mark()}.part")
        try:
            with temporary.open("wb") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(target)
        finally:
            temporary.unlink(missing_ok=True)

    def delete(self, path: str) -> None:
        """Remove a file if it exists."""
        self._require_here(path)
        with _reaching(self.url, writing=True):
            if self.is_local:
                Path(self.full(path)).unlink(missing_ok=True)
            elif self.entry(path) is not None:
                self.filesystem.delete_file(self.full(path))


def normal_url(url: str | Path) -> str:
    """Return an address in its normal form: an absolute path, or `s3://BUCKET/PREFIX`."""
    text = str(url)
    scheme, separator, rest = text.partition("://")
    is_local = not separator or scheme == "file"
    userinfo = _USERINFO_ALONE if is_local else _USERINFO
    if userinfo.search(text):
        shown = userinfo.sub(r"\1…@", text)
        raise UsageError(
            f"no credentials in an address — {shown}",
            "give them in the environment: AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY",
        )
    if is_local:
        path = os.path.abspath(rest if separator else text)
        require_utf8(path)
        return path
    if scheme != "s3":
        raise UsageError(
            f"neither a folder nor a bucket — {text}", "give a path, or s3://BUCKET/PREFIX"
        )
    # `..` in a manifest means the same as in a folder.
    path = posixpath.normpath(rest)
    if "?" in rest or not rest.partition("/")[0] or path.startswith("."):
        raise UsageError(f"no address of a bucket — {text}", "s3://BUCKET/PREFIX")
    return S3 + path


def _s3() -> Any:
    options: dict[str, Any] = {}
    if url := next((os.environ[name] for name in _ENDPOINTS if os.environ.get(name)), None):
        parts = urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.netloc or "@" in parts.netloc:
            # It may hold a password, also one without `//` in front of it.
            raise UsageError(
                "AWS_ENDPOINT_URL is no address of a store",
                "AWS_ENDPOINT_URL=http://HOST:PORT, or https://; credentials have variables of"
                " their own",
            )
        options = {"endpoint_override": parts.netloc, "scheme": parts.scheme}
    region = os.environ.get("AWS_REGION") or os.environ.get("AWS_DEFAULT_REGION")
    if region:
        options["region"] = region
    return fs.S3FileSystem(
        retry_strategy=fs.AwsStandardS3RetryStrategy(max_attempts=MOST_ATTEMPTS),
        connect_timeout=_CONNECT_SECONDS,
        request_timeout=_REQUEST_SECONDS,
        **options,
    )


@contextmanager
def _reaching(url: str, *, writing: bool = False) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        words = str(error.strerror or error).strip().splitlines()[0]
        # pyarrow names the file in its text; Python has it apart.
        place = error.filename if isinstance(error.filename, str) else url
        verb = "write to" if writing else "read"
        hint = "check that it exists and that its permissions allow it"
        if url.startswith(S3):
            hint = (
                "check the bucket, AWS_ENDPOINT_URL and AWS_REGION, and the credentials in the"
                " environment"
            )
        raise DatabaseError(f"cannot {verb} the store: {words} — {place}", hint) from error
