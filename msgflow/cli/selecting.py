"""The options that choose the rows of a query, by what its columns name."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from msgflow.cli.completion import complete, complete_path
from msgflow.cli.options import path_of
from msgflow.default_files import DEFAULT_PATHS
from msgflow.query.selection import KINDS, PATH, columns_of

if TYPE_CHECKING:
    from msgflow.sql.header import Header

_CHOICE = "Which rows"


def selecting_options(header: Header) -> dict[str, Any]:
    """Return the options by their names; those that have nothing to choose from are hidden, and
    say so when used.
    """
    has_path = bool(columns_of(header, PATH))
    has_ends = any(param.name == "from" for param in header.params)
    place = _if(has_path) | {"autocompletion": complete("place")}
    options: dict[str, Any] = {
        kind: _option(
            list[str] | None,
            kind,
            "NAME",
            f"Rows that name this {kind}; a glob, or several",
            hidden=not columns_of(header, kind),
            autocompletion=complete(kind),
        )
        for kind in KINDS
    }
    for word, kind, metavar, text, more in (
        ("via", list[str], "NAME", "Paths through all of these topics and nodes", place),
        ("without", list[str], "NAME", "Paths through none of these", place),
        (
            "path",
            str,
            "NAME",
            "A path by its name in a file, see msgflow paths suggest",
            _if(has_ends) | {"autocompletion": complete_path},
        ),
        (
            "paths",
            Path,
            "FILE",
            "The file with named paths",
            _if(has_ends) | {"show_default": DEFAULT_PATHS, "parser": path_of},
        ),
        ("where", str, "CONDITION", "Rows for which this is true: SQL on the columns", {}),
        ("sort", list[str], "COLUMN[:desc]", "Column to sort by, or several", {}),
        ("limit", int, "N", "Maximum number of rows", {"min": 1}),
        (
            "slowest",
            int,
            "N",
            "Only the N slowest rows",
            _if(header.slowest is not None) | {"min": 1},
        ),
    ):
        options[word] = _option(kind | None, word, metavar, text, **more)
    return options


def _option(type_: Any, word: str, metavar: str, text: str, **more: Any) -> Any:
    option = typer.Option(f"--{word}", metavar=metavar, help=text, rich_help_panel=_CHOICE, **more)
    return Annotated[type_, option]


def _if(is_shown: bool) -> dict[str, Any]:
    return {"hidden": not is_shown}
