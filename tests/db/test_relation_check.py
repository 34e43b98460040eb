"""Relations between tables: identities without their row are counted."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pytest
from support import golden

from msgflow.db.finding import broken_relations


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
                "run_id": 1,
                "child": "link_transport.take_id",
                "parent": "take",
                "count": broken,
            }
        assert broken_relations(connection, 2) == []


@pytest.mark.parametrize("takes", ["1,1\n2,1\n3,2\n4,2\n", "1,1\n2,1\n4,2\n6,2\n"])
def test_a_row_of_another_run_is_none(fresh_database: Path, takes: str) -> None:
    """The first and last row of each run, and those of the other; a third run has no takes."""
    links = "1,1,1\n2,2,1\n3,4,2\n4,4,1\n5,2,2\n6,1,3\n"
    with duckdb.connect(str(fresh_database)) as connection:
        tables = {
            "run": "run_id,name\n1,first\n2,second\n3,third\n",
            "take": "take_id,run_id\n" + takes,
            "link_transport": "publication_id,take_id,run_id\n" + links,
        }
        golden.fill(connection, tables)
        assert [
            (relation["run_id"], relation["count"])
            for relation in broken_relations(connection)
            if relation["child"] == "link_transport.take_id"
        ] == [(1, 1), (2, 1), (3, 1)]


def test_a_database_without_a_run_has_none(fresh_database: Path) -> None:
    with duckdb.connect(str(fresh_database)) as connection:
        assert broken_relations(connection) == []
