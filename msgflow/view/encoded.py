"""Comparisons and sections of the summary as pages read them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msgflow.text.shell import shell_joined
from msgflow.view.table_encoding import encode

if TYPE_CHECKING:
    from collections.abc import Mapping

    from msgflow.query.compare import Comparison
    from msgflow.result.query_result import QueryResult
    from msgflow.view.summary import Section


def encoded_comparison(comparison: Comparison, what: str, *, is_quick: bool = False) -> bytes:
    """Return a comparison of runs as bytes, for the page of the comparison."""
    names = [comparison.run_a.name, comparison.run_b.name]
    meta = {
        "a": names[0],
        "b": names[1],
        "is_quick": is_quick,
        "command": shell_joined(
            ["msgflow", "compare", *names] + ["--what", what] * (what != "paths")
        ),
    }
    return encoded_result(comparison.result, meta)


def encoded_section(section: Section, origin_ns: int) -> bytes:
    """Return a section of the summary as bytes; points in time count from `origin_ns`."""
    meta = {
        "title": section.title,
        "reading": section.reading,
        "when_empty": section.when_empty,
        "shown": section.columns,
        "commands": section.commands,
    }
    return encoded_result(section.result, meta, origin_ns)


def encoded_result(result: QueryResult, meta: Mapping[str, Any], origin_ns: int = 0) -> bytes:
    """Return rows as bytes, with their notes and what their columns mean beside `meta`."""
    columns = result.header.columns if result.header else ()
    said = {
        "notes": result.notes,
        "columns": {column.name: column.description for column in columns},
    }
    return encode(result.to_arrow(), meta={**meta, **said}, origin_ns=origin_ns, units=result.units)
