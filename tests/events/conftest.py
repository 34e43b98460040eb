"""What the tests of listing share."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import msgflow.trace
from msgflow.events.formats import EventFormat
from msgflow.events.listing import write_events
from msgflow.events.selection import Selection

Listing = Callable[..., str]


@pytest.fixture(scope="session")
def reader() -> str:
    """The name of a reader that works here."""
    return "auto"


@pytest.fixture(scope="session")
def listing(reader: str) -> Listing:
    """List events as text of some format."""

    def write(*paths: Path, form: str = "text", **options: Any) -> str:
        stream = io.BytesIO()
        with msgflow.trace.open(paths, reader=reader) as traces:
            write_events(Selection(traces, **options), EventFormat(form), stream)
        return stream.getvalue().decode()

    return write


@pytest.fixture(scope="session")
def listed(listing: Listing) -> Callable[..., list[dict[str, Any]]]:
    """List events as objects."""

    def read(*paths: Path, **options: Any) -> list[dict[str, Any]]:
        return [
            json.loads(line) for line in listing(*paths, form="jsonl", **options).split("\n")[:-1]
        ]

    return read
