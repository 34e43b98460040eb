"""Topics with commas, spaces and line separators in their names: they are found as they are."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import duckdb
import pytest
from support.thorough import few

from msgflow.cli.options import one_text
from msgflow.database import Database
from msgflow.errors import UsageError

COMMA, SPACES = "/chatter, /talker", " /chatter\u2028 "


@pytest.fixture
def odd(small_database: Path) -> Path:
    """In run 1 a topic has a comma in its name, in run 2 spaces and a line separator."""
    with duckdb.connect(str(small_database)) as connection:
        for run_id, name in ((1, COMMA), (2, SPACES)):
            connection.execute(
                "UPDATE store.publisher SET topic_name = $name"
                " WHERE run_id = $run AND topic_name = '/chatter'",
                {"run": run_id, "name": name},
            )
    return small_database


@pytest.mark.parametrize("given", few([COMMA, [COMMA], [COMMA, "/talker"]], COMMA))
@pytest.mark.parametrize("word", ["from_", "to"])
def test_a_name_of_the_run_is_not_split(odd: Path, given: Sequence[str], word: str) -> None:
    with Database(odd) as database:
        database.query("flows", run=1, **{word: given})
        found = database.query("objects", run=1, topic=COMMA)
        assert set(found.table["name"].to_pylist()) == {COMMA}


def test_other_texts_are_several_names(odd: Path) -> None:
    with Database(odd) as database:
        database.query("flows", run=2, from_="/talker, */chatter*")
        with pytest.raises(UsageError, match="/chatter"):
            database.query("flows", run=2, from_="/chatter,/talker")
        with pytest.raises(UsageError, match="/talker, /talker"):
            database.query("flows", run=2, from_=["/talker, /talker"])


def test_spaces_and_separators_stay(odd: Path) -> None:
    with Database(odd) as database:
        database.query("flows", run=2, to=SPACES)
        assert len(database.query("objects", run=2, topic=SPACES))


@pytest.mark.parametrize("names", [[COMMA], "/chatter\u2028*, /nothing"])
def test_macros_take_lists_and_texts(odd: Path, names: Sequence[str]) -> None:
    with Database(odd) as database:
        found = database.connection.execute(
            "SELECT topic_name FROM derive.place([1, 2], $names)", {"names": names}
        ).fetchall()
    assert found == ([(COMMA,)] if isinstance(names, list) else [])


def test_an_option_that_is_repeated_is_a_list() -> None:
    assert one_text(["/a,/b"]) == "/a,/b"
    assert one_text(["/a,/b", "/c"]) == ["/a,/b", "/c"]
