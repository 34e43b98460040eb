"""The outermost group: turns whatever goes wrong into a message and an exit code."""

from __future__ import annotations

import errno
import os
import sys
import traceback
from collections.abc import Mapping
from copy import copy
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

import typer
from typer.core import TyperGroup

from msgflow.cli import unneeded, words
from msgflow.cli.completion import is_completing
from msgflow.cli.outline import OUTLINES
from msgflow.cli.output import discard_stdout, print_error
from msgflow.cli.stop import STOP
from msgflow.cli.tilde import with_home
from msgflow.errors import ExitCode, MsgflowError, UsageError
from msgflow.sql.interrupt import Terminated
from msgflow.version import __version__

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

_CANNOT_WRITE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF)
# What the libraries below say of values, and how we do.
_LEAKED = (
    ("Value error, ", ""),
    ("Input should be a valid integer, unable to parse string as an integer", "no whole number"),
    ("Input should be a valid number, unable to parse string as a number", "no number"),
    ("Input should be ", "it has to be "),
)


class _Commands(Mapping[str, Any]):
    """The commands by name, in the order in which a user needs them.

    Each is a module of its name, imported when it is asked for: one command, and completion above
    all, does not wait for the others.
    """

    def __getitem__(self, name: str) -> Any:
        if name not in OUTLINES:
            raise KeyError(name)
        return _built(name)

    def __iter__(self) -> Iterator[str]:
        return iter(OUTLINES)

    def __len__(self) -> int:
        return len(OUTLINES)


@cache
def _built(name: str) -> Any:
    module = import_module(f"msgflow.cli.{name}")
    around = typer.Typer(add_completion=False)
    if hasattr(module, "app"):
        around.add_typer(module.app, name=name)
    else:
        around.command(name)(module.command)
    around.callback()(lambda: None)
    return typer.main.get_group(around).commands[name]


class RootGroup(TyperGroup):
    """The group of all commands; no exception leaves it."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.commands = _Commands()  # type: ignore[assignment]

    def main(self, *args: Any, **options: Any) -> None:
        """Run a command line and exit with its code."""
        try:
            STOP.begin()
            code = self._run(*args, **options)
            STOP.cease()
        except KeyboardInterrupt as error:
            # While `_run` dealt with another exception. `STOP` raises no second time.
            STOP.cease()
            code = _code_of(error)
        code = STOP.came or code
        if code == ExitCode.INTERRUPTED:
            print_error("interrupted")
        if code == ExitCode.TERMINATED:
            print_error("terminated")
        STOP.end_with(code)
        sys.exit(int(code))

    def _run(self, args: Sequence[str] | None = None, **options: Any) -> ExitCode:
        options["standalone_mode"] = False
        (words.as_typed if is_completing() else words.plainly)()
        unneeded.leave_out()
        try:
            line = with_home(sys.argv[1:] if args is None else args)
            return ExitCode(super().main(line, **options) or 0)
        except KeyboardInterrupt as error:
            return _code_of(error)
        except typer.Abort:
            return ExitCode.INTERRUPTED
        except Exception as error:
            # What a signal made fail in the libraries below is no error of its own.
            if STOP.came or _is_interrupt(error):
                return STOP.came or ExitCode.INTERRUPTED
            # A shell would show the words amid the line that somebody types.
            if is_completing():
                return ExitCode.OK
            return _code_with_words(error)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Print the help; a line about a command takes no import of it."""
        outlined = copy(self)
        outlined.commands = OUTLINES  # type: ignore[assignment]
        super(RootGroup, outlined).format_help(ctx, formatter)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command that is named; a query is none, but what was meant is clear."""
        from msgflow.query.catalogue import query_names

        if args[0] not in OUTLINES and args[0] in query_names():
            raise UsageError(f"there is no such command — {args[0]}", f"msgflow query {args[0]}")
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Run the command; a reader that went away (`… | head`) ends it quietly."""
        try:
            value = super().invoke(ctx)
            if sys.stdout is not None:
                sys.stdout.flush()
        except BrokenPipeError:
            # Python flushes stdout once more when it exits, which must not complain either.
            discard_stdout()
            raise typer.Exit(ExitCode.OK) from None
        except Terminated:
            # The libraries below give all that is like Ctrl-C its exit code.
            raise typer.Exit(ExitCode.TERMINATED) from None
        return value


def _code_with_words(error: Exception) -> ExitCode:
    if isinstance(error, MsgflowError):
        print_error(error.message, error.hint)
        return error.exit_code
    if isinstance(error, typer.TyperException):
        print_error(*_usage(error))
        return ExitCode(error.exit_code)
    if isinstance(error, OSError) and _is_of_stdout(error):
        return _unwritable(error)
    return _unexpected(error)


def _code_of(error: KeyboardInterrupt) -> ExitCode:
    return ExitCode.TERMINATED if isinstance(error, Terminated) else ExitCode.INTERRUPTED


def _is_interrupt(error: Exception) -> bool:
    # DuckDB turns the interrupt of a running query into an exception of its own.
    return isinstance(error, RuntimeError) and str(error) == "Query interrupted"


def _is_of_stdout(error: OSError) -> bool:
    # Files are named by the errors of opening them, and those of writing are caught where we write.
    return error.filename is None and error.errno in _CANNOT_WRITE


def _unwritable(error: OSError) -> ExitCode:
    # Python would complain once more about what is left, when it exits.
    discard_stdout()
    reason = (error.strerror or str(error)).lower()
    print_error(
        f"cannot write to stdout: {reason}", "write to another place, for instance with -o FILE"
    )
    return ExitCode.USAGE


def _usage(error: typer.TyperException) -> tuple[str, str | None]:
    message, _, suggestion = error.format_message().strip().partition(". Did you mean ")
    for leaked, ours in _LEAKED:
        message = message.replace(leaked, ours)
    context = getattr(error, "ctx", None)
    hint = None if context is None else f"{context.command_path} --help"
    if suggestion:
        hint = f"did you mean {suggestion}"
    return message[:1].lower() + message[1:].rstrip("."), hint


def _unexpected(error: Exception) -> ExitCode:
    summary = (str(error).strip().splitlines() or [""])[0]
    if os.environ.get("MSGFLOW_DEBUG") == "1":
        traceback.print_exception(error)
        hint = f"this is a mistake of msgflow {__version__}; report it with the lines above"
    else:
        hint = "this is a mistake of msgflow; MSGFLOW_DEBUG=1 in the environment shows where"
    print_error(f"unexpected {type(error).__name__}: {summary}", hint)
    return ExitCode.FAILED
