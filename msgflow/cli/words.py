"""Makes values of the words of a command line.

Typer has Pydantic do so. Importing and preparing it takes longer than many a question, and most
words are plain: a text stays one, a path becomes a `Path`. Only the others are left to Typer.
"""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Any, get_args

import typer.core

_core: Any = typer.core
# Another Typer may lack it: then its words go their own way, and take longer.
_by_typer = getattr(_core, "build_runtime_param", None)
_NOT_PLAIN = object()


class _AsTyped:
    """Takes every word as it is."""

    def __init__(self, parameter: Any) -> None:
        self._parameter = parameter

    def coerce(self, value: Any, **_: Any) -> Any:
        return value


class _Plainly(_AsTyped):
    """Makes values of the words of one parameter, as Typer would."""

    def coerce(self, value: Any, **place: Any) -> Any:
        made = self._made(value, **place)
        if made is _NOT_PLAIN:
            return _by_typer(self._parameter).coerce(value, **place)  # type: ignore[misc]
        return made

    def _made(self, value: Any, param: Any, ctx: Any) -> Any:
        info = self._parameter.parameter_info
        kind = self._parameter.annotation
        is_many = param.multiple or param.nargs == -1
        if value is None:
            return () if is_many else None
        if info.parser is not None:
            return _NOT_PLAIN
        if is_many and (isinstance(value, str) or len(get_args(kind)) != 1):
            return _NOT_PLAIN
        if is_many:
            (kind,) = get_args(kind)
        made: list[Any] = []
        for each in value if is_many else [value]:
            if kind is str and isinstance(each, str):
                made.append(each)
            elif kind is Path and isinstance(each, str | Path) and not _is_checked(info):
                made.append(Path(each))
            elif isinstance(kind, type) and issubclass(kind, Enum) and isinstance(each, kind):
                made.append(each)
            else:
                return _NOT_PLAIN
        return made if is_many else made[0]


def _is_checked(path: Any) -> bool:
    """Tell whether Typer has more to do for a path; whether it can be read shows who opens it."""
    return bool(
        path.exists
        or path.writable
        or path.resolve_path
        or path.path_type
        or not (path.file_okay and path.dir_okay)
    )


def as_typed() -> None:
    """Let Typer take all words of this process as they are: a third of the time of a completion."""
    _let_make(_AsTyped)


def plainly() -> None:
    """Let Typer ask Pydantic only for words that are not plain."""
    _let_make(_Plainly)


def _let_make(maker: type[_AsTyped]) -> None:
    if _by_typer is not None:
        _core.build_runtime_param = maker
