"""The help of a command, as text: what it does, its arguments, and its options in groups.

Typer lays help out with Rich, and loads its Markdown, highlighting and tracebacks for that: this
takes longer than all the rest of `msgflow --help`.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Container, Iterable, Iterator
from functools import partial
from typing import Any

import typer

from msgflow.text.wrapping import hanging, wrap

_WIDTH = 100
_INDENT = 2
# The widest name beside which a text begins in the same line.
_WIDEST_NAME = 26
_OPTIONS = "Options"
_HARD_SPACE = "\N{NO-BREAK SPACE}"


def lay_out_help(command: Any, left_out: Container[str] = ()) -> Any:
    """Let a command, and those in it, print their help like this; return it.

    Options whose names are `left_out` have their help elsewhere. What the commands of a group share
    stands in its help, if it has a method `shared_options`: a title and options.
    """
    command.format_help = partial(_write, command, left_out)
    for each in getattr(command, "commands", {}).values():
        lay_out_help(each)
    return command


def _write(command: Any, left_out: Container[str], context: Any, formatter: Any) -> None:
    width = min(shutil.get_terminal_size((_WIDTH, 24)).columns, _WIDTH)
    arguments, panels = _panels(command, context, left_out)
    usage = " ".join(["[OPTIONS]", *map(_usage, arguments)])
    if hasattr(command, "list_commands"):
        usage = command.subcommand_metavar
    lines = hanging("Usage: ", f"{context.command_path} {usage}", width)
    for paragraph in (command.help or "").split("\n\n"):
        lines += ["", *wrap(" ".join(paragraph.split()), width)]
    described = [(_name(each), each.help) for each in arguments if each.help]
    sections = {"Arguments": described, **panels, **_commands(command, context)}
    if hasattr(command, "shared_options"):
        title, options = command.shared_options()
        sections[title] = [_row(each, context) for each in options]
    for title, rows in sections.items():
        if rows:
            lines += ["", _heading(f"{title}:"), *_table(rows, width)]
    for paragraph in (command.epilog or "").split("\n\n"):
        lines += ["", *wrap(" ".join(paragraph.split()), width)] if paragraph else []
    formatter.write("\n".join(lines) + "\n")


def _panels(
    command: Any, context: Any, left_out: Container[str]
) -> tuple[list[Any], dict[str, list[tuple[str, str]]]]:
    """Return the arguments, and the rows of the options by the title of their group."""
    arguments = []
    panels: dict[str, list[tuple[str, str]]] = {_OPTIONS: []}
    for each in command.get_params(context):
        if each.param_type_name == "argument":
            arguments.append(each)
        elif not each.hidden and each.name not in left_out:
            title = getattr(each, "rich_help_panel", None) or _OPTIONS
            panels.setdefault(title, []).append(_row(each, context))
    return arguments, panels


def _commands(command: Any, context: Any) -> dict[str, list[tuple[str, str]]]:
    """Return the commands of a group with their summaries, by the title of their group."""
    found: dict[str, list[tuple[str, str]]] = {}
    for name in command.list_commands(context) if hasattr(command, "list_commands") else ():
        each = command.get_command(context, name)
        summary = each.short_help or (each.help or "").partition("\n\n")[0]
        title = getattr(each, "rich_help_panel", None) or "Commands"
        found.setdefault(title, []).append((name, " ".join(summary.split())))
    return found


def _name(argument: Any) -> str:
    return str(argument.metavar or argument.name.upper()).strip("[]")


def _usage(argument: Any) -> str:
    name = _name(argument)
    return name if argument.required else f"[{name}]"


def _row(option: Any, context: Any) -> tuple[str, str]:
    """Return the names of an option with what it takes, and its help with its default."""
    name = ", ".join(sorted(option.opts, key=len))
    name += "".join(f", {other}" for other in option.secondary_opts)
    if not option.is_flag:
        name += f" {option.metavar or option.display_type(context).strip('<>')}"
    notes = [*_default(option, context), *_range(option)]
    if option.envvar:
        notes.append(f"environment: {option.envvar}")
    if option.required:
        notes.append("required")
    text = (option.help or "").rstrip(".")
    return name, f"{text} [{'; '.join(notes)}]" if notes else text


def _default(option: Any, context: Any) -> Iterator[str]:
    shown = getattr(option, "show_default", False)
    value = option.get_default(context, call=False)
    if isinstance(shown, str):
        yield f"default: {shown}"
    elif shown and option.secondary_opts:
        if value is not None:
            yield f"default: {option.opts[0] if value else option.secondary_opts[0]}"
    elif shown and value not in (None, False, "") and not callable(value):
        yield f"default: {value}"


def _range(option: Any) -> Iterator[str]:
    least, most = getattr(option, "min", None), getattr(option, "max", None)
    if least is not None and most is not None:
        yield f"{least} to {most}"
    elif least is not None:
        yield f"at least {least}"
    elif most is not None:
        yield f"at most {most}"


def _heading(text: str) -> str:
    return text if os.environ.get("NO_COLOR") else typer.style(text, bold=True)


def _table(rows: Iterable[tuple[str, str]], width: int) -> Iterator[str]:
    """Yield names and their texts, which stand in a column of their own."""
    rows = list(rows)
    room = max((len(name) for name, _ in rows if len(name) <= _WIDEST_NAME), default=_WIDEST_NAME)
    edge = " " * (_INDENT + room + _INDENT)
    for name, text in rows:
        label = f"{' ' * _INDENT}{name:{room}}{' ' * _INDENT}"
        if len(name) > room:
            yield label.rstrip()
            label = edge
        # No line ends between these words and the value.
        text = text.replace("default: ", f"default:{_HARD_SPACE}")
        lines = hanging(label, text, width)
        yield from (line.rstrip().replace(_HARD_SPACE, " ") for line in lines)
