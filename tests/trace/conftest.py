"""What the tests of reading share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest
from support.thorough import few

import msgflow.trace
from msgflow.errors import TraceError
from msgflow.trace import EventBatch, TraceSet, bt2_library

Rows = dict[str, list[dict[str, Any]]]


@pytest.fixture(scope="session")
def bt2_bindings() -> Any:
    """Babeltrace 2's bindings, where this Python can load them."""
    try:
        return bt2_library.load()
    except TraceError as error:
        pytest.skip(error.message)


@pytest.fixture(scope="session", params=few(["msgflow", "bt2"], "msgflow"))
def reader(request: pytest.FixtureRequest) -> str:
    """Every reader that there is, one after the other; bt2 is compared with ours in any case."""
    name: str = request.param
    if name == "bt2":
        request.getfixturevalue("bt2_bindings")
    return name


@pytest.fixture(scope="session")
def open_traces(reader: str) -> Callable[..., TraceSet]:
    """`msgflow.trace.open` of one or more paths."""

    def open_paths(*paths: Path) -> TraceSet:
        return msgflow.trace.open(paths, reader=reader)

    return open_paths


@pytest.fixture(scope="session")
def read_rows(open_traces: Callable[..., TraceSet]) -> Callable[..., Rows]:
    """Read traces whole, into a list of rows per event name."""

    def read(*paths: Path, **options: Any) -> Rows:
        with open_traces(*paths) as traces:
            return rows_of(list(traces.batches(**options)))

    return read


def rows_of(batches: list[EventBatch]) -> Rows:
    """Join the batches of each name."""
    tables: dict[str, list[pa.RecordBatch]] = {}
    for batch in batches:
        tables.setdefault(batch.name, []).append(batch.batch)
    return {
        name: [row for part in parts for row in part.to_pylist()] for name, parts in tables.items()
    }
