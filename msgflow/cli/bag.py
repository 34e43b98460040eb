"""`msgflow bag`: the messages of a bag of the same run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from msgflow.cli.operation import asks
from msgflow.cli.output import print_result, print_status
from msgflow.database import Database
from msgflow.export.formats import Format

if TYPE_CHECKING:
    from msgflow.result.query_result import QueryResult


@asks(Database.join_bag)
def command(
    result: QueryResult,
    *,
    form: Format | None = None,
    wide: bool = False,
    output: Path | None = None,
) -> None:
    """It needs the package rosbags: pip install rosbags, or in a checkout '.[bag]'."""
    print_result(result, form, output, wide=wide)
    topics = result.to_arrow()
    joined, messages = (sum(topics[name].to_pylist()) for name in ("joined", "messages"))
    print_status(f"{joined:,} of {messages:,} messages joined: msgflow sql 'FROM bag_message'")
