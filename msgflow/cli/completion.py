"""Completion in the shell: the names that Typer offers when the user presses Tab.

Nothing here prints, fails or imports more than it needs. Names come from a recording, and a
completed name becomes part of the next command. So names that could be more than a word are left
out.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import typer

from msgflow.files.default_files import DEFAULT_DATABASE, DEFAULT_PATHS

VARIABLE = "_MSGFLOW_COMPLETE"
# Besides letters and digits of any language. Quotes, $, `, \\ and globs are never completed.
_SAFE = frozenset("_/.-+@%,:() =<>&#{}")
_QUOTED_IN_BASH = re.compile(r"([^\w/.\-+@%,])")


class _Word(str):
    """A name with the escapes that bash needs; Typer compares the name without them."""

    __slots__ = ("name",)
    name: str

    def startswith(self, *prefix: Any) -> bool:
        return self.name.startswith(*prefix)


def is_completing() -> bool:
    """Tell whether a shell asks for completions."""
    return VARIABLE in os.environ


def complete(kind: str, *more: str) -> Callable[[typer.Context, str], list[str]]:
    """Return the callback that completes the names of a database."""

    def completed(ctx: typer.Context, incomplete: str) -> list[str]:
        from msgflow.db.known_names import known_names

        path = ctx.params.get("database") or os.environ.get("MSGFLOW_DB") or DEFAULT_DATABASE
        return words([*more, *known_names(_path(path), kind, incomplete)], incomplete)

    return completed


def complete_path(ctx: typer.Context, incomplete: str) -> list[str]:
    """Complete the name of a path from its file."""
    from msgflow.errors import MsgflowError
    from msgflow.paths.paths_file import read_paths

    try:
        paths = read_paths(_path(ctx.params.get("paths") or DEFAULT_PATHS)).paths
    except (MsgflowError, OSError):
        return []
    return words((path.name.value for path in paths), incomplete)


def words(names: Iterable[str], incomplete: str) -> list[str]:
    """Return the names that begin with `incomplete` and are one word in the shell.

    A name is left out if it has other characters than letters, digits and a few signs, if a command
    would take it for an option, or if a shell would take it for a home directory.
    """
    found = [
        name
        for name in names
        if name.startswith(incomplete)
        and name
        and name[0] not in "-~ #="
        and all(character in _SAFE or character.isalnum() for character in name)
    ]
    if not os.environ.get(VARIABLE, "").endswith("_bash"):
        return found
    return [_in_bash(name) for name in found]


def _in_bash(name: str) -> str:
    word = _Word(_QUOTED_IN_BASH.sub(r"\\\1", name))
    word.name = name
    return word


def _path(given: object) -> Path:
    # A shell replaces neither `~` nor variables in a word that it completes.
    return Path(os.path.expanduser(os.path.expandvars(str(given))))
