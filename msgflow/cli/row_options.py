"""Options that choose the rows of a query: by name, path, condition and number."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from msgflow.cli.completion import complete, complete_path
from msgflow.cli.options import path_of
from msgflow.files.default_files import DEFAULT_PATHS
from msgflow.query.selection import KINDS, PATH, columns_of

if TYPE_CHECKING:
    from msgflow.sql.header import Header


def row_option(word: str, metavar: str, help: str, **more: Any) -> Any:
    """Return an option that chooses rows."""
    return typer.Option(
        f"--{word}", metavar=metavar, help=help, rich_help_panel="Which rows", **more
    )


def row_options(header: Header) -> dict[str, Any]:
    """Return the annotations of the options for one query, by their names.

    Options that have nothing to choose from in this query are hidden, and say so when used.
    """
    has_ends = any(param.name == "from" for param in header.params)
    place = {"hidden": not columns_of(header, PATH), "autocompletion": complete("place")}
    options: dict[str, Any] = {
        kind: Annotated[
            list[str] | None,
            row_option(
                kind,
                "NAME",
                f"Rows that name this {kind}; a glob, or several",
                hidden=not columns_of(header, kind),
                autocompletion=complete(kind),
            ),
        ]
        for kind in KINDS
    }
    options["via"] = Annotated[
        list[str] | None,
        row_option("via", "NAME", "Paths through all of these topics and nodes", **place),
    ]
    options["without"] = Annotated[
        list[str] | None, row_option("without", "NAME", "Paths through none of these", **place)
    ]
    options["path"] = Annotated[
        str | None,
        row_option(
            "path",
            "NAME",
            "A path by its name in a file, see msgflow suggest paths",
            hidden=not has_ends,
            autocompletion=complete_path,
        ),
    ]
    options["paths"] = Annotated[
        Path | None,
        row_option(
            "paths",
            "FILE",
            "File of named paths",
            hidden=not has_ends,
            show_default=DEFAULT_PATHS,
            parser=path_of,
        ),
    ]
    options["where"] = Annotated[
        str | None,
        row_option("where", "CONDITION", "Rows for which this is true: SQL on the columns"),
    ]
    options["sort"] = SortOption
    options["limit"] = LimitOption
    options["slowest"] = Annotated[
        int | None,
        row_option("slowest", "N", "Only the N slowest rows", hidden=header.slowest is None, min=1),
    ]
    return options


SortOption = Annotated[
    list[str] | None, row_option("sort", "COLUMN[:desc]", "Column to sort by, or several")
]
LimitOption = Annotated[int | None, row_option("limit", "N", "Maximum number of rows", min=1)]
