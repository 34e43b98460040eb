"""Options of a slice: a command gets --run, --start, --end and --skip-first as one value."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from inspect import Parameter, Signature, signature
from typing import Annotated, Any, get_type_hints

import typer

from msgflow.cli.options import SELECTION, RunOption
from msgflow.run.slice import Slice

SLICE_OPTIONS: dict[str, Any] = {
    "run": RunOption,
    "start": Annotated[
        str | None,
        typer.Option(
            "--start",
            metavar="TIME",
            help="Start of the time window: seconds from the start of the run, 100ms, ISO time,"
            " or epoch ns (16 digits or more)",
            rich_help_panel=SELECTION,
        ),
    ],
    "end": Annotated[
        str | None,
        typer.Option(
            "--end",
            metavar="TIME",
            help="End of the time window, in the same formats as --start",
            rich_help_panel=SELECTION,
        ),
    ],
    "skip_first": Annotated[
        float | None,
        typer.Option(
            "--skip-first",
            metavar="SECONDS",
            min=0,
            help="Skip the first SECONDS of the run (warm-up)",
            rich_help_panel=SELECTION,
        ),
    ],
}
"""Annotations of the options, by the fields of `Slice`."""

Command = Callable[..., None]


def with_slice(*names: str, **changed: Any) -> Callable[[Command], Command]:
    """Return a decorator of a command: in place of its parameter `part`, it gets the options.

    The defaults of the options are the fields of the default of `part`.
    """
    options = {name: SLICE_OPTIONS[name] for name in names or SLICE_OPTIONS} | changed

    def decorate(command: Command) -> Command:
        hints = get_type_hints(command, include_extras=True)
        parameters: list[Parameter] = []
        for parameter in signature(command).parameters.values():
            if parameter.name != "part":
                parameters.append(parameter.replace(annotation=hints[parameter.name]))
                continue
            parameters += [
                Parameter(
                    name,
                    parameter.kind,
                    default=getattr(parameter.default, name),
                    annotation=annotation,
                )
                for name, annotation in options.items()
            ]

        @wraps(command)
        def sliced(**given: Any) -> None:
            part = Slice(**{name: given.pop(name) for name in options})
            command(part=part, **given)

        set_parameters(sliced, parameters)
        return sliced

    return decorate


def set_parameters(command: Command, parameters: Sequence[Parameter]) -> None:
    """Give a command the parameters from which Typer makes its arguments and options."""
    command.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {each.name: each.annotation for each in parameters}
