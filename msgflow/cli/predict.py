"""Replay a run with changes: what they do to each path."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.backports import Unpack
from msgflow.cli.operation import asks
from msgflow.cli.output import Shown, print_result
from msgflow.database import Database

if TYPE_CHECKING:
    from msgflow.result.query_result import QueryResult


@asks(Database.predict)
def command(result: QueryResult, **shown: Unpack[Shown]) -> None:
    """`msgflow why --fix` tries what may help."""
    print_result(result, **shown)
