"""Public views of runs that a lake holds without them, read from the databases of these runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msgflow.fleet.layout import VIEWS, view_path
from msgflow.fleet.part import KEY, PART, public_views, view_rows, write_rows
from msgflow.fleet.run_database import run_database

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping
    from pathlib import Path

    from msgflow.fleet.lake import Lake


def write_views(
    lake: Lake,
    runs: Iterable[Mapping[str, Any]],
    folder: Path,
    wanted: Collection[str] | None,
    *,
    listed: bool = False,
) -> dict[str, list[str]]:
    """Write views of runs into a folder, as `--views` writes them into a lake.

    Args:
        lake: the lake, which has the databases of the runs.
        runs: their rows of the table `run`. The part of their views is that of the database.
        folder: where to write; the databases are there for a moment, too.
        wanted: the views, each as `view/NAME`; all when None.
        listed: write all views of the first run, so that their names and columns are known.

    Returns:
        The files of each view.
    """
    made: dict[str, list[str]] = {}
    for run in runs:
        with run_database(lake, run, folder) as connection:
            first = {KEY: run["run"], PART: run["database_part"]}
            for name in public_views(connection):
                view = f"{VIEWS}/{name}"
                if wanted is None or view in wanted or listed:
                    file = folder / view_path(name, run["database_part"])
                    file.parent.mkdir(parents=True, exist_ok=True)
                    write_rows(file, name, view_rows(connection, name), first, "")
                    made.setdefault(view, []).append(str(file))
        listed = False
    return made
