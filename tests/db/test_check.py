"""Audits: what they let pass, and what they find."""

from __future__ import annotations

from pathlib import Path

import duckdb
import golden

from msgflow.db.check import run_checks

ONCE = "check.publication_is_received_once"


def received(database: Path, methods: str) -> int:
    """Return the offending rows, where a subscription takes a message once by each method."""
    links = "".join(
        f"1,1,{take},1,{method}\n" for take, method in enumerate(methods.split(), start=1)
    )
    header = "publication_id,publisher_id,take_id,subscription_id,method\n"
    with duckdb.connect(str(database)) as connection:
        golden.fill(connection, {"link_transport": header + links})
        results = {result.name: result.row_count for result in run_checks(connection)}
    return results[ONCE]


def test_a_copy_through_the_middleware_may_be_taken_too(fresh_database: Path) -> None:
    assert received(fresh_database, "ring_buffer exact") == 0


def test_a_message_is_received_once_by_each_way(fresh_database: Path) -> None:
    """However the two takes of one way were linked."""
    assert received(fresh_database, "ring_buffer exact nearest") == 1
