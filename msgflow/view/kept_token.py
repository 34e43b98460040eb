"""Tokens of `msgflow ui`, kept for each database, so that open pages outlive a restart."""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import secrets
import stat
from pathlib import Path

_BYTES = 24
# Neither a link nor a pipe is followed or waited for.
_NEW = os.O_WRONLY | os.O_CREAT | os.O_EXCL
_FLAGS = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK
_OF_OTHERS = stat.S_IRWXG | stat.S_IRWXO
_TOKEN = re.compile(rb"[\w-]{32}")


def kept_token(place: str) -> str:
    """Return the token of a database: the kept one, or a new one that is kept from now on.

    It is kept in a file that its user alone can read. A file that others can read or have written
    is replaced. Where nothing can be kept, each call returns another token.
    """
    token = secrets.token_urlsafe(_BYTES)
    given = os.environ.get("XDG_STATE_HOME")
    root = Path(given) if given and os.path.isabs(given) else Path("~/.local/state")
    name = f"token-{hashlib.sha256(os.fsencode(place)).hexdigest()}"
    with contextlib.suppress(OSError, RuntimeError):  # the last: there is no home directory
        path = root.expanduser() / "msgflow" / name
        return _read(path) or _keep(path, token)
    return token


def _read(path: Path) -> str | None:
    with contextlib.suppress(OSError), open(os.open(path, _FLAGS), "rb") as file:
        status = os.fstat(file.fileno())
        is_ours = (
            stat.S_ISREG(status.st_mode)
            and status.st_uid == os.geteuid()
            and not status.st_mode & _OF_OTHERS
        )
        if is_ours and (found := _TOKEN.fullmatch(file.read(_BYTES * 2))) is not None:
            return found[0].decode()
    return None


def _keep(path: Path, token: str) -> str:
    path.parent.mkdir(mode=stat.S_IRWXU, parents=True, exist_ok=True)
    aside = path.with_name(f"{path.name}.{secrets.token_hex(_BYTES)}.part")
    try:
        with open(os.open(aside, _NEW, stat.S_IRUSR | stat.S_IWUSR), "w") as file:
            file.write(token)
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)
    return token
