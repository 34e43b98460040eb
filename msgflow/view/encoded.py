"""Comparisons and sections of the summary as pages read them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.text.shell import shell_joined
from msgflow.view.table_encoding import encode

if TYPE_CHECKING:
    from msgflow.query.compare import Comparison
    from msgflow.result.query_result import QueryResult
    from msgflow.view.summary import Section


def encoded_comparison(comparison: Comparison, what: str, *, is_quick: bool = False) -> bytes:
    """Return a comparison of runs as bytes, for the page of the comparison."""
    result = comparison.result
    return encode(
        result.to_arrow(),
        meta={
            "notes": result.notes,
            "a": comparison.run_a.name,
            "b": comparison.run_b.name,
            "is_quick": is_quick,
            "columns": _descriptions(result),
            "command": shell_joined(
                ["msgflow", "compare", comparison.run_a.name, comparison.run_b.name]
                + ["--what", what] * (what != "paths")
            ),
        },
        units=result.units,
    )


def encoded_section(section: Section, origin_ns: int) -> bytes:
    """Return a section of the summary as bytes; points in time count from `origin_ns`."""
    result = section.result
    return encode(
        result.to_arrow(),
        meta={
            "title": section.title,
            "reading": section.reading,
            "when_empty": section.when_empty,
            "shown": section.columns,
            "notes": result.notes,
            "columns": _descriptions(result),
            "commands": section.commands,
        },
        origin_ns=origin_ns,
        units=result.units,
    )


def _descriptions(result: QueryResult) -> dict[str, str]:
    columns = result.header.columns if result.header else ()
    return {column.name: column.description for column in columns}
