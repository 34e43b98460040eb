"""Audits: what they let pass, and what they find."""

from __future__ import annotations

from pathlib import Path

import duckdb
import golden
import pytest

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


def test_a_database_without_a_run_passes(fresh_database: Path) -> None:
    with duckdb.connect(str(fresh_database)) as connection:
        assert {result.row_count for result in run_checks(connection)} == {0}


@pytest.mark.parametrize(("takes", "broken"), [("1\n2\n3\n", 1), ("1\n2\n5\n", 2)])
def test_references_without_their_row_are_counted(
    fresh_database: Path, takes: str, broken: int
) -> None:
    """Whether ids come in one block or not."""
    with duckdb.connect(str(fresh_database)) as connection:
        links = "publication_id,take_id\n1,2\n2,3\n3,4\n"
        golden.fill(connection, {"take": "take_id\n" + takes, "link_transport": links})
        for run_id, number in ((None, broken), (1, broken), (2, 0)):
            results = {each.name: each.row_count for each in run_checks(connection, run_id)}
            assert results["relation.link_transport.take_id"] == number
