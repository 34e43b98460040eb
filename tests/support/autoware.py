"""The Autoware reference system on two simulated hosts: what became of each lidar message.

SQL beside this module counts the messages, in the database and in the truth of the simulation.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import duckdb

import msgflow

if TYPE_CHECKING:
    from collections.abc import Mapping


NAMES = ("autoware", "autoware_two_threads")
_HERE = Path(__file__).parent


@dataclass(frozen=True)
class Measured:
    """Messages of one run and what became of them.

    `usual_branches` names the topics by which the messages reached /BehaviorPlanner, in order. It
    counts only roots with the usual number of messages.
    """

    name: str
    from_ns: int
    until_ns: int
    roots: int
    messages: Mapping[int, int]
    first_ns: tuple[int, int, int]
    last_ns: tuple[int, int, int]
    usual_branches: str


def measure(database: msgflow.Database, run_ids: list[int], margin_ns: int) -> list[Measured]:
    """Return what the database says about runs."""
    rows = database.connection.execute(
        (_HERE / "autoware.sql").read_text(), {"runs": run_ids, "margin_ns": margin_ns}
    ).fetchall()
    return [Measured(*row) for row in rows]


def true_messages(truth: Mapping[str, Path], measured: Measured) -> dict[bool, tuple[int, Any]]:
    """Return the true roots and counts, with and without messages that a node used again."""
    with duckdb.connect() as connection:
        for name, path in truth.items():
            connection.execute(f"CREATE VIEW {name} AS FROM '{path}'")
        rows = connection.execute(
            (_HERE / "autoware_truth.sql").read_text(),
            {"from_ns": measured.from_ns, "until_ns": measured.until_ns},
        ).fetchall()
    return {is_reusing: (roots, messages) for is_reusing, roots, messages in rows}
