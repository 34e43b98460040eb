"""Error messages of the command line, and the exit codes that belong to them."""

from __future__ import annotations

import errno
import os
import re
import traceback

import typer

from msgflow.cli.output import discard_stdout, print_error
from msgflow.errors import ExitCode, MsgflowError
from msgflow.version import __version__

# What to do in place of an option or a value of other commands, or other programs.
_INSTEAD = {
    # Results go to `-o FILE` everywhere. An ingest has none: it writes to the database.
    ("msgflow ingest", "-o"): "--db FILE names the database",
    ("msgflow ingest", "--output"): "--db FILE names the database",
    ("msgflow export otlp", "--endpoint"): (
        "write a file with -o: Jaeger opens it, and a collector sends it on (docs/export.md)"
    ),
    ("", "--skip-first"): "--start SECONDS",
    ("", "--memory-limit"): "MSGFLOW_MEMORY_LIMIT in the environment",
    ("msgflow graph", "svg"): "msgflow graph | dot -Tsvg; or msgflow ui, page Graph",
}
_CANNOT_WRITE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF)
# What Python says of it, in a RuntimeError.
_NO_THREAD = "can't start new thread"
# Phrases of Typer and Pydantic, and ours for them.
_PHRASES = (
    ("Value error, ", ""),
    ("Input should be a valid integer, unable to parse string as an integer", "no whole number"),
    ("Input should be a valid number, unable to parse string as a number", "no number"),
    ("Input should be ", "it has to be "),
)


def print_exception(error: Exception) -> ExitCode:
    """Print what went wrong, without a traceback, and return the exit code."""
    if isinstance(error, MsgflowError):
        print_error(error.message, error.hint)
        return error.exit_code
    if isinstance(error, typer.TyperException):
        print_error(*_usage(error))
        return ExitCode(error.exit_code)
    # An error of opening a file names it, and those of writing to one are caught where we write.
    if isinstance(error, OSError) and error.filename is None and error.errno in _CANNOT_WRITE:
        discard_stdout()
        reason = (error.strerror or str(error)).lower()
        print_error(
            f"cannot write to stdout: {reason}", "write to another place, for instance with -o FILE"
        )
        return ExitCode.USAGE
    if isinstance(error, MemoryError) or str(error) == _NO_THREAD:
        print_error(
            "the system gives this process no more memory or threads",
            "raise its limits (ulimit -v, ulimit -u, those of its container), or read less",
        )
        return ExitCode.FAILED
    summary = (str(error).strip().splitlines() or [""])[0]
    hint = "this is a mistake of msgflow; MSGFLOW_DEBUG=1 in the environment shows where"
    if os.environ.get("MSGFLOW_DEBUG") == "1":
        traceback.print_exception(error)
        hint = f"this is a mistake of msgflow {__version__}; report it with the lines above"
    print_error(f"unexpected {type(error).__name__}: {summary}", hint)
    return ExitCode.FAILED


def _usage(error: typer.TyperException) -> tuple[str, str | None]:
    message, _, suggestion = error.format_message().strip().partition(". Did you mean ")
    for phrase, ours in _PHRASES:
        message = message.replace(phrase, ours)
    context = getattr(error, "ctx", None)
    hint = None if context is None else f"{context.command_path} --help"
    if suggestion:
        hint = f"did you mean {suggestion}"
    # Behind a bracket stand other options.
    words = re.findall(r"[\w-]+", message.partition(" (")[0])
    for (command, word), instead in _INSTEAD.items():
        if word in words and context is not None and context.command_path.endswith(command):
            hint = instead
    return message[:1].lower() + message[1:].rstrip("."), hint
