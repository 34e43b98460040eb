"""`msgflow bag`: the messages of a bag of the same run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from msgflow.cli.options import (
    DatabaseOption,
    FormatOption,
    OutputOption,
    RunOption,
    WideOption,
    path_of,
)
from msgflow.files.default_files import DEFAULT_DATABASE


def command(
    bag: Annotated[
        Path,
        typer.Argument(
            metavar="BAG",
            parser=path_of,
            help="Directory of a rosbag2, or one of its files (.mcap, .db3)",
        ),
    ],
    run: RunOption = None,
    form: FormatOption = None,
    wide: WideOption = False,
    output: OutputOption = None,
    database: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Join the messages of a bag to their publications: size, header.stamp, frame_id.

    The bag was recorded in the same run. It replaces an earlier one. What cannot
    be joined is counted, by topic. The view bag_message has the messages.
    """
    from msgflow.cli.output import print_result, print_status
    from msgflow.database import Database

    with Database(database) as opened:
        result = opened.join_bag(bag, run=run)
    print_result(result, form, output, wide=wide)
    topics = result.to_arrow()
    joined, messages = (sum(topics[name].to_pylist()) for name in ("joined", "messages"))
    print_status(f"{joined:,} of {messages:,} messages joined: msgflow sql 'FROM bag_message'")
