"""Page queries: the SQL below `sql`, whose rows have the shape of a picture, not of an answer.

They are no named queries, because their rows mean nothing without the page: bins as wide as a
pixel, keys of rows, times that count from the begin of the run. They have the same headers, and
read the public views alone. A file of kind 'inline' is put in front of each file that reads it.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from msgflow.sql.statement import Statements

if TYPE_CHECKING:
    from collections.abc import Mapping

    import duckdb
    import pyarrow as pa

    from msgflow.sql.value import Value

DIRECTORY = Path(__file__).parent / "sql"
_PAGES = Statements(DIRECTORY)

page_query = _PAGES.header


def run_page_query(
    connection: duckdb.DuckDBPyConnection, name: str, values: Mapping[str, Value]
) -> pa.Table:
    """Return the rows of a page query; see `Statements.run`."""
    return _PAGES.run(connection, name, values).to_arrow_table()
