"""Output of the command line: data to stdout, messages about it to stderr; nothing else writes."""

from __future__ import annotations

import codecs
import os
import shlex
import shutil
import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING, TypedDict, cast

import typer
from rich.cells import cell_len

from msgflow.errors import UsageError
from msgflow.export.formats import Format, format_of, write_result
from msgflow.files.default_files import DEFAULT_DATABASE
from msgflow.result.layout import MOST_ROWS, lay_out, screen_width
from msgflow.result.screen import screen_lines
from msgflow.text.values import count, printable
from msgflow.text.wrapping import hanging, wrap

if TYPE_CHECKING:
    from msgflow.result.query_result import QueryResult
    from msgflow.run.choice import Run


# The narrowest column in which text wraps beside a name.
_LEAST_ROOM = 20
# What a terminal may obey of a text.
_LINES = "\n\t"


def print_error(message: str, hint: str | None = None) -> None:
    """Print an error as `error: …`, an empty line, and `hint: …`."""
    _labelled("error", typer.colors.RED, message)
    if hint is not None:
        typer.echo(err=True)
        _labelled("hint", typer.colors.CYAN, hint)


def print_note(text: str) -> None:
    """Print something worth knowing about the data."""
    # A name in it begins no line of its own: it might read as a command to run next.
    _labelled("note", typer.colors.YELLOW, printable(text))


def print_status(text: str) -> None:
    """Print what was done."""
    typer.echo("\n".join(_fitting(printable(text), "  ")), err=True)


def print_next(words: Sequence[str], database: Path, run: str | int | None = None) -> None:
    """Print a command that runs as it is printed."""
    print_status(f"next: {command_text(words, database, run)}")


def command_text(words: Sequence[str], database: Path, run: str | int | None = None) -> str:
    """Return a command for the shell, with the run, and the database if it is not the default."""
    chosen = ["--run", str(run)] if run is not None else []
    named = ["--db", str(database)] if database != DEFAULT_DATABASE else []
    return shlex.join([*words, *chosen, *named])


def confirm(question: str) -> bool:
    """Ask on the terminal whether to go on; no answer means no. A script is not asked."""
    is_asked = all(each is not None and each.isatty() for each in (sys.stdin, sys.stderr))
    return not is_asked or typer.confirm(printable(question, _LINES), err=True)


class Shown(TypedDict, total=False):
    """How a command writes rows, as its options."""

    form: Format | None
    output: Path | None
    wide: bool


def print_result(
    result: QueryResult,
    form: Format | None = None,
    output: Path | None = None,
    *,
    wide: bool = False,
    columns: str | None = None,
    most_rows: int | None = MOST_ROWS,
) -> None:
    """Write a result to a file or stdout, and say on stderr what it leaves out."""
    from msgflow.files.atomic import replacing

    form = form or format_of(output)
    if columns is not None:
        result = result.with_columns([name.strip() for name in columns.split(",")])
    print_runs(result.runs)
    if output is not None:
        with replacing(output) as temporary, temporary.open("wb") as stream:
            write_result(result, form, stream)
        print_status(f"{count(len(result), 'row')} written to {output}")
    else:
        stdout = data_stream()
        on_terminal = stdout.isatty()
        if form is Format.PARQUET and on_terminal:
            raise UsageError("Parquet is not for a terminal", "name a file with -o FILE.parquet")
        is_brief = columns is None and result.header is not None and bool(result.header.brief)
        if form is Format.TABLE and not wide and (on_terminal or is_brief):
            # A pipe has room for all rows, and people read no more than so many columns.
            _print_for_screen(result, columns is not None, most_rows if on_terminal else None)
        else:
            write_result(result, form, stdout)
    if output is None and not len(result):
        print_note(result.when_empty)
    for note in result.notes:
        print_note(note)


def is_screen() -> bool:
    """Tell whether stdout is a terminal."""
    return data_stream().isatty()


def _print_for_screen(result: QueryResult, is_chosen: bool, most_rows: int | None) -> None:
    width = screen_width()
    shown = lay_out(result, width, most_rows=most_rows, is_chosen=is_chosen)
    print_lines(screen_lines(shown, width))
    if shown.not_shown is not None:
        text = "\n".join(_fitting(printable(shown.not_shown, _LINES), " " * len("not shown: ")))
        typer.echo(text if os.environ.get("NO_COLOR") else typer.style(text, dim=True), err=True)
    for note in shown.notes:
        print_note(note)


def print_runs(runs: Sequence[Run]) -> None:
    """Print which runs were read, if any."""
    if runs:
        names = printable(", ".join(run.title for run in runs))
        _labelled("run" if len(runs) == 1 else "runs", typer.colors.CYAN, names)


def print_text(text: str, path: Path | None) -> None:
    """Write text to a file or stdout; a terminal shows control characters in it as text."""
    if path is None:
        print_lines([text])
        return
    from msgflow.files.atomic import replacing

    with replacing(path) as temporary:
        temporary.write_text(f"{text}\n", encoding="utf-8")
    print_status(f"written to {path}")


def print_drawing(draw: Callable[[int | None, bool], str], path: Path | None) -> None:
    """Write a drawing to a file or stdout, on a terminal in colours."""
    if path is not None or not is_screen():
        print_text(draw(None, False), path)
        return
    color = not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
    # Not as data: a terminal has to obey colours.
    text = draw(shutil.get_terminal_size().columns, color)
    sys.stdout.buffer.write(f"{text}\n".encode())


def print_lines(lines: Iterable[str]) -> None:
    """Write lines of text to stdout."""
    stream = data_stream()
    for line in lines:
        stream.write(f"{line}\n".encode())
    # Messages on stderr follow the data.
    stream.flush()


def print_list(rows: Sequence[tuple[str, str]], titles: tuple[str, str] | None = None) -> None:
    """Write names and their descriptions side by side; a terminal wraps the descriptions."""
    every = [*([titles] if titles else []), *rows]
    width = max(cell_len(name) for name, _ in every)
    room = max(width + 2 + _LEAST_ROOM, screen_width()) if is_screen() else sys.maxsize
    lines = [line for name, text in every for line in hanging(f"{name:{width}}  ", text, room)]
    if titles:
        lines.insert(1, "─" * max(map(cell_len, lines)))
    print_lines(lines)


def discard_stdout() -> None:
    """Discard stdout, with what is not written yet: Python would fail once more when it exits."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def data_stream() -> IO[bytes]:
    """Return stdout as bytes; a terminal gets no control characters, which traces may have."""
    if sys.stdout is None:  # the parent process closed it
        raise UsageError(
            "cannot write to stdout: it is closed", "write to a file, for instance with -o FILE"
        )
    sys.stdout.flush()
    stream = sys.stdout.buffer
    return cast("IO[bytes]", _Terminal(stream)) if stream.isatty() else stream


class _Terminal:
    """A terminal as a binary stream; it shows control characters instead of obeying them."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream
        self._decoder = codecs.getincrementaldecoder("utf-8")("replace")
        self.closed = False

    def write(self, data: bytes) -> int:
        text = self._decoder.decode(bytes(data))
        self._stream.write(printable(text, _LINES).encode())
        return len(data)

    def flush(self) -> None:
        self._stream.flush()

    def writable(self) -> bool:
        return True

    def isatty(self) -> bool:
        return True


def _width_of_stderr() -> int:
    """Return the width of the terminal of stderr; stdout may go elsewhere."""
    with suppress(OSError, ValueError):
        if not os.environ.get("COLUMNS", "").isdigit():
            return os.get_terminal_size(sys.stderr.fileno()).columns or screen_width()
    return screen_width()


def _fitting(text: str, indent: str, used: int = 0) -> list[str]:
    """Return the lines of a text for stderr, wrapped to the width of its terminal."""
    if sys.stderr is None or not sys.stderr.isatty() or "\n" in text:
        return [text]
    width = _width_of_stderr()
    if used + cell_len(text) <= width:
        return [text]
    first, *more = wrap(text, width - max(used, len(indent)))
    return [first, *(indent + line for line in more)]


def _labelled(label: str, color: str, text: str) -> None:
    indent = " " * (len(label) + 2)
    text = "\n".join(_fitting(printable(text, _LINES), indent, len(indent)))
    styled = label if os.environ.get("NO_COLOR") else typer.style(label, fg=color, bold=True)
    typer.echo(f"{styled}: {text}", err=True)
