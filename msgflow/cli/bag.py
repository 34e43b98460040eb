"""Join the messages of a bag to their publications: size, header.stamp, frame_id."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.backports import Unpack
from msgflow.cli.operation import asks
from msgflow.cli.output import Shown, print_result, print_status
from msgflow.database import Database

if TYPE_CHECKING:
    from msgflow.result.query_result import QueryResult


@asks(Database.join_bag)
def command(result: QueryResult, **shown: Unpack[Shown]) -> None:
    """It needs the package rosbags: pip install rosbags, or in a checkout '.[bag]'."""
    print_result(result, **shown)
    topics = result.to_arrow()
    joined, messages = (sum(topics[name].to_pylist()) for name in ("joined", "messages"))
    print_status(f"{joined:,} of {messages:,} messages joined: msgflow sql 'FROM bag_message'")
