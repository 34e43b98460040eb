"""The page queries: SQL whose rows have the shape of a picture, not of an answer.

They lie in `msgflow/view/sql`, not in `queries/`, because their rows mean nothing without the page:
bins as wide as a pixel, keys of rows, times that count from the begin of the run. Headers are those
of named queries. A file of kind 'inline' is put in front of each that names it as `view.NAME`.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from msgflow.sql.header import Header, read

if TYPE_CHECKING:
    from collections.abc import Mapping

    import duckdb
    import pyarrow as pa

    from msgflow.sql.value import Value

DIRECTORY = Path(__file__).parent / "sql"
_INLINE = "view."


@cache
def page_query(name: str) -> Header:
    """Return the header of a page query.

    Raises:
        FileNotFoundError: there is none of this name.
    """
    return read(DIRECTORY / f"{name}.sql")


@cache
def statement(name: str) -> str:
    """Return the SQL of a page query, with what it needs of the others in front."""
    header = page_query(name)
    parts = [f"{need} AS (\n{page_query(need).body}\n)" for need in _inlined(header)]
    if not parts:
        return header.body
    body = header.body
    if body.startswith("WITH "):
        return "WITH " + ",\n".join(parts) + ",\n" + body.removeprefix("WITH ")
    return "WITH " + ",\n".join(parts) + "\n" + body


def _inlined(header: Header) -> list[str]:
    # Each after those that it needs.
    names: list[str] = []
    for need in header.needs:
        if need.startswith(_INLINE):
            name = need.removeprefix(_INLINE)
            names += [*_inlined(page_query(name)), name]
    return list(dict.fromkeys(names))


def run_page_query(
    connection: duckdb.DuckDBPyConnection, name: str, values: Mapping[str, Value]
) -> pa.Table:
    """Return the rows of a page query.

    Args:
        connection: to a database with the public views.
        name: of the page query.
        values: its parameters; those with a default may be left out, others are ignored.
    """
    header = page_query(name)
    inherited = {param.name: param.default for param in header.params if param.has_default}
    used = connection.extract_statements(statement(name))[0].named_parameters
    bound = {key: values.get(key, inherited.get(key)) for key in used}
    return connection.sql(statement(name), params=bound).to_arrow_table()
