"""Options of the command line for the parameters in the header of an SQL file."""

from __future__ import annotations

from inspect import Parameter
from typing import TYPE_CHECKING, Annotated, Any

import typer

from msgflow.cli.completion import complete
from msgflow.cli.operation import escape
from msgflow.cli.options import ADVANCED, ADVANCED_NAMES, one_text
from msgflow.query.names import PLACE_PARAMETERS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from msgflow.sql.header import Param

PARAMETERS = "Parameters"
OWN = "own_"


def header_option(param: Param, panel: str = PARAMETERS) -> Any:
    """Return the option for a parameter; the default stands in the header."""
    flag = f"--{param.name.replace('_', '-')}"
    metavar = {"BOOLEAN": "", "VARCHAR": "TEXT"}.get(param.type, "NUMBER")
    completion: Callable[..., list[str]] | None = None
    if param.name in PLACE_PARAMETERS:
        metavar, completion = "NAME", complete("place")
    elif param.choices:
        metavar, completion = "WORD", lambda: list(param.choices)
    return typer.Option(
        f"{flag}/--no-{flag[2:]}" if param.type == "BOOLEAN" else flag,
        metavar=metavar,
        help=escape(_describe(param)),
        show_default=False,
        autocompletion=completion,
        rich_help_panel=ADVANCED if param.name in ADVANCED_NAMES else panel,
    )


def header_parameter(param: Param, panel: str = PARAMETERS) -> Parameter:
    """Return the parameter of a command for a parameter of a header, with OWN before its name."""
    kind: Any = bool if param.type == "BOOLEAN" else str
    if param.name in PLACE_PARAMETERS:
        kind = list[str]
    return Parameter(
        f"{OWN}{param.name}",
        Parameter.KEYWORD_ONLY,
        default=None if param.has_default else Parameter.empty,
        annotation=Annotated[
            kind | None if param.has_default else kind, header_option(param, panel)
        ],
    )


def _describe(param: Param) -> str:
    text = param.description
    if param.choices:
        text += f" ({', '.join(param.choices)})"
    if param.minimum is not None:
        text += f" (at least {param.minimum})"
    if param.has_default and param.default is not None:
        default = param.default
        text += f" [default: {str(default).lower() if isinstance(default, bool) else default}]"
    return text


def given_of(words: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of those parameters of a header that were given."""
    own = {name.removeprefix(OWN): value for name, value in words.items() if name.startswith(OWN)}
    return {
        name: one_text(value) for name, value in own.items() if value is not None and value != []
    }
