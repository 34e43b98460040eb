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
    """Write views of runs into a folder, as `--views` writes them into a lake; return their files.

    `wanted` are the views, each as `view/NAME`; all when None. `listed` also writes all views of
    the first run, so that their names and columns are known. The part of a run's views is that of
    its database, which is in the folder for a moment, too.
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
