"""`~` in paths: a shell replaces it at the begin of a word, but not behind `--db=`."""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

# All options that take a path; others may begin with `~` for their own reasons, as topics do.
PATH_OPTIONS = {
    "--db", "--output", "-o", "--html", "--file", "-f", "--links", "--keep-staging",
    "--clock-sync", "--host", "--paths", "--lake", "--scratch",
}  # fmt: skip
# The name is that of `--host=NAME=~/traces`.
_JOINED = re.compile(r"(?P<option>--[a-z-]+=|-[a-z])(?P<name>[^=~/]+=)?(?P<path>~.*)", re.DOTALL)


def with_home(arguments: Sequence[str]) -> list[str]:
    """Return the words of a command line with the home directory for `~` in `--db=~/x`, `-o~/x`.

    What follows a lone `--` stays as it is.
    """
    words = list(arguments)
    end = words.index("--") if "--" in words else len(words)
    return [_expanded(word) for word in words[:end]] + words[end:]


def _expanded(word: str) -> str:
    found = _JOINED.fullmatch(word)
    if found is None or found["option"].rstrip("=") not in PATH_OPTIONS:
        return word
    return f"{found['option']}{found['name'] or ''}{os.path.expanduser(found['path'])}"
