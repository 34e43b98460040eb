"""Public views as Parquet files, each of which says what it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from msgflow.atomic import replacing
from msgflow.errors import UsageError
from msgflow.query.catalogue import nearest
from msgflow.query.run import read_runs
from msgflow.query.window import choose_runs
from msgflow.version import __version__

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import duckdb

_ROWS_AT_ONCE = 100_000
_VIEWS = """
SELECT views.view_name, list(columns.column_name)
FROM duckdb_views() AS views
JOIN duckdb_columns() AS columns
    ON columns.database_name = views.database_name
    AND columns.schema_name = views.schema_name
    AND columns.table_name = views.view_name
WHERE views.database_name = current_database() AND views.schema_name = 'main'
    AND NOT views.internal
GROUP BY views.view_name
ORDER BY views.view_name
"""


@dataclass(frozen=True)
class ExportedView:
    """A file that was written.

    Attributes:
        view: name of the view.
        path: the file.
        row_count: rows in it.
    """

    view: str
    path: Path
    row_count: int


def export_parquet(
    connection: duckdb.DuckDBPyConnection,
    directory: Path,
    *,
    views: Sequence[str] = (),
    run: str | int | None = "all",
    force: bool = False,
) -> tuple[ExportedView, ...]:
    """Write public views to `directory`, one Parquet file each, named after the view.

    Rows are sorted by all columns, so that equal content gives equal files. The metadata of a
    file hold `msgflow.view`, `msgflow.version` and `msgflow.schema_revision`.

    Args:
        connection: to the database.
        directory: created if missing.
        views: names of views; all when empty.
        run: 'all', a name or an id; the latest run when None.
        force: replace files that exist.

    Raises:
        UsageError: a view or run that does not exist, a file that does and `force` is not given,
            or a directory that cannot be written.
    """
    from msgflow.db.migrate import current_revision

    columns = dict(connection.execute(_VIEWS).fetchall())
    for view in views:
        if view not in columns:
            raise UsageError(f"there is no such view — {view}", _views_hint(view, list(columns)))
    chosen = sorted(set(views)) or sorted(columns)
    runs = [chosen_run.run_id for chosen_run in choose_runs(read_runs(connection), run)]
    metadata = {
        "msgflow.version": __version__,
        "msgflow.schema_revision": current_revision(connection.cursor()) or "",
    }
    _prepare(directory, chosen, force)
    return tuple(
        _export(
            connection,
            view,
            directory / f"{view}.parquet",
            runs if "run_id" in columns[view] else None,
            metadata | {"msgflow.view": view},
        )
        for view in chosen
    )


def _prepare(directory: Path, views: Sequence[str], force: bool) -> None:
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise UsageError(f"cannot create the directory: {reason} — {directory}") from error
    existing = [view for view in views if (directory / f"{view}.parquet").exists()]
    if existing and not force:
        raise UsageError(
            f"the file exists already — {directory / f'{existing[0]}.parquet'}",
            "choose another directory, or replace the files with --force",
        )


def _export(
    connection: duckdb.DuckDBPyConnection,
    view: str,
    path: Path,
    runs: list[int] | None,
    metadata: dict[str, str],
) -> ExportedView:
    import pyarrow.parquet

    # The name comes from the catalogue of the database, never from the user.
    text = f'SELECT * FROM main."{view}"'
    if runs is None:
        relation = connection.sql(f"{text} ORDER BY ALL")
    else:
        relation = connection.sql(
            f"{text} WHERE list_contains($runs, run_id) ORDER BY ALL", params={"runs": runs}
        )
    row_count = 0
    with relation.to_arrow_reader(_ROWS_AT_ONCE) as reader, replacing(path) as temporary:
        schema = reader.schema.with_metadata(metadata)
        with pyarrow.parquet.ParquetWriter(temporary, schema, compression="zstd") as writer:
            for batch in reader:
                writer.write_batch(batch)
                row_count += batch.num_rows
    return ExportedView(view, path, row_count)


def _views_hint(view: str, known: list[str]) -> str:
    near = nearest(view, known)
    return f"did you mean {' or '.join(near)}?" if near else "msgflow db schema"
