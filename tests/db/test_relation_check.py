"""Relations between tables: identities without their row are counted."""

from __future__ import annotations

from pathlib import Path

import duckdb
import golden
import pytest

from msgflow.db.relation_check import broken_relations


@pytest.mark.parametrize(("takes", "broken"), [("1\n2\n3\n", 1), ("1\n2\n5\n", 2)])
def test_identities_without_their_row_are_counted(
    fresh_database: Path, takes: str, broken: int
) -> None:
    """Whether ids come in one block or not."""
    with duckdb.connect(str(fresh_database)) as connection:
        links = "publication_id,take_id\n1,2\n2,3\n3,4\n"
        golden.fill(connection, {"take": "take_id\n" + takes, "link_transport": links})
        for run_id in (None, 1):
            (found,) = (
                relation
                for relation in broken_relations(connection, run_id)
                if relation["child"] == "link_transport.take_id"
            )
            assert found == {
                "run_id": 1, "child": "link_transport.take_id", "parent": "take", "count": broken
            }  # fmt: skip
        assert broken_relations(connection, 2) == []


def test_a_database_without_a_run_has_none(fresh_database: Path) -> None:
    with duckdb.connect(str(fresh_database)) as connection:
        assert broken_relations(connection) == []
