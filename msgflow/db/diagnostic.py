"""Diagnostics: what is worth knowing about the input, noted on the way.

`schema/health/diagnostic` holds one per file, a query for its rows: `trace_id` (NULL: not one trace
alone), `count` and `detail`. What its header says decides the rest: its name and severity stand in
each row; by its phase it is asked of what was read and built (`staging.diagnostic`), when clocks
are brought together, when links are derived, or once the whole database was audited. Without a
parameter, one of links is not stored, but asked of them again and again (`derive.link_diagnostic`);
it returns `run_id` as well, and has no WITH, which DuckDB 1.4 does not find so deep in a view.
Statements of one phase are one, with the parts that they share.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from msgflow.resources import resource_directory
from msgflow.sql.header import Header
from msgflow.sql.statement import Statements

if TYPE_CHECKING:
    from collections.abc import Sequence

STAGED = "staging.diagnostic"
_STAGED = ("reading", "model")
_OF_LINKS = "links"
SEVERITIES = ("info", "warning", "data_loss", "error")


@cache
def diagnostics() -> tuple[Header, ...]:
    """Return the headers of all diagnostics, sorted by name; `kind: inline` ones are parts."""
    headers = (_statements().header(name) for name in _statements().names())
    return tuple(header for header in headers if header.kind != "inline")


def composed(layer: str) -> tuple[Header, ...]:
    """Return the objects of a layer of `schema/` that diagnostics are put together to."""
    if layer == "model":
        return (staged(of_model()),)
    if layer == "stat":
        return (
            _object(
                "derive.link_diagnostic",
                "What the links say about the input.",
                [header for header in diagnostics() if _is_asked_again(header)],
            ),
        )
    return ()


def of_model() -> tuple[Header, ...]:
    """Return the diagnostics that are asked of what was read and built."""
    return tuple(header for header in diagnostics() if header.phase in _STAGED)


def staged(headers: Sequence[Header]) -> Header:
    """Return the object of the model that these diagnostics are put together to, if any."""
    return _object(
        STAGED,
        "What was found in the input while it was read and the model was built.",
        headers,
    )


def text(header: Header) -> str:
    """Return the SQL of a diagnostic, with the parts that it needs in front."""
    return _statements().text(short_name(header))


def statement(headers: Sequence[Header]) -> str:
    """Return the statement that gives the rows of these diagnostics, which are of one kind.

    It has the columns of `store.diagnostic`, but for `run_id` where the diagnostics do not give it.
    """
    keys = ["run_id", "trace_id"] if _is_asked_again(headers[0]) else ["trace_id"]
    typed = ", ".join(f"{key}::BIGINT AS {key}" for key in keys)
    selects = "\nUNION ALL\n".join(
        f"SELECT {typed}, '{short_name(header)}' AS name, '{header.severity}' AS severity, "
        f"count::BIGINT AS count, detail\nFROM (\n{header.body})"
        for header in headers
    )
    parts = ",\n".join(_statements().parts(short_name(header) for header in headers))
    return f"WITH {parts}\n{selects}\n" if parts else f"{selects}\n"


def _is_asked_again(header: Header) -> bool:
    return header.phase == _OF_LINKS and not header.params


def _object(name: str, description: str, headers: Sequence[Header]) -> Header:
    return Header(
        name=name,
        title=name,
        description=description,
        grain="one row per finding",
        kind="view",
        params=(),
        columns=(),
        severity=None,
        cause=None,
        cure=None,
        note=None,
        body=statement(headers),
        path=_statements().directory,
    )


def short_name(header: Header) -> str:
    """Return the name of a diagnostic as people see it."""
    return header.name.partition(".")[2]


@cache
def _statements() -> Statements:
    return Statements(resource_directory("schema") / "health" / "diagnostic")
