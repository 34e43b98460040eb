from __future__ import annotations

from pathlib import Path

import pytest

from msgflow.database import open_db
from msgflow.db.objects import public_names
from msgflow.errors import UsageError
from msgflow.query.catalogue import (
    choose_query,
    load_queries,
    load_query,
    queries_by_word,
    query_names,
)
from msgflow.sql.value import Value
from msgflow.text.name_suggestions import meant_or, nearest


def test_the_catalogue_is_the_folder() -> None:
    assert "topics" in query_names()
    names = [header.name for header in load_queries()]
    assert names == sorted(path.stem for path in load_query("topics").path.parent.glob("*.sql"))
    assert [header.name for header in load_queries() if " " not in header.words] == list(
        query_names()
    )
    assert load_query("topics").title == "Topics"


def test_a_newcomer_can_read_the_list() -> None:
    # Lines of a usual terminal.
    assert len(query_names()) <= 24


def test_every_variant_is_a_value_of_the_option_of_its_query() -> None:
    for name in query_names():
        files = [header.name for header in load_queries() if header.name.startswith(f"{name}-")]
        chosen = []
        for variant in load_query(name).variants:
            if variant.type == "BOOLEAN":
                assert variant.default is False
                chosen.append(f"{name}-{variant.name}")
            else:
                assert variant.default in variant.choices
                others = [value for value in variant.choices if value != variant.default]
                chosen += [f"{name}-{value}" for value in others]
        assert sorted(files) == sorted(chosen)


@pytest.mark.parametrize(
    ("name", "given", "words"),
    [
        ("topics", {}, "topics"),
        ("topics", {"measure": "rate", "node": "/a"}, "topics --measure rate"),
        ("topics", {"measure": "messages"}, "topics"),
        ("topics", {"measure": None}, "topics"),
        ("topics-rate", {}, "topics --measure rate"),
        ("topics-rate", {"measure": "latency"}, "topics --measure latency"),
        ("callbacks", {"each": True}, "callbacks --each"),
        ("callbacks", {"each": "yes"}, "callbacks --each"),
        ("callbacks-each", {"each": False}, "callbacks"),
        ("callbacks", {"each": "maybe"}, "callbacks"),
        ("flows", {"measure": "rate"}, "flows"),
        ("e2e-latency", {"measure": "latency", "by": "ends"}, "e2e-latency --by ends"),
        ("e2e-latency-ends", {"measure": "latency"}, "e2e-latency --by ends"),
        ("e2e-latency", {"measure": "age", "by": "path"}, "e2e-latency --measure age"),
    ],
)
def test_an_option_chooses_a_variant(name: str, given: dict[str, Value], words: str) -> None:
    assert choose_query(name, given).words == words


def test_two_variants_are_not_one_answer() -> None:
    with pytest.raises(UsageError, match="do not go together — --measure age and --by ends"):
        choose_query("e2e-latency", {"measure": "age", "by": "ends"})
    with pytest.raises(UsageError, match="do not go together — --measure age and --by ends"):
        choose_query("e2e-latency-age", {"by": "ends"})


def test_a_value_that_no_variant_has_is_refused(small_database: Path) -> None:
    with open_db(small_database) as database:
        with pytest.raises(UsageError, match="--measure has no such value — rates") as raised:
            database.query("topics", measure="rates")
        assert "did you mean rate" in str(raised.value.hint)
        rates = database.query("topics", measure="rate")
        assert rates.columns == database.query("topics-rate").columns


def test_a_file_is_parsed_once() -> None:
    assert load_query("topics") is load_query("topics", public_names)


def test_an_unknown_query_is_refused_with_similar_ones() -> None:
    with pytest.raises(UsageError) as raised:
        load_query("topic-s")
    assert raised.value.message == "there is no such query — topic-s"
    assert "msgflow query topics" in str(raised.value.hint)


def test_without_a_similar_one_the_list_is_named() -> None:
    with pytest.raises(UsageError) as raised:
        load_query("xyzzy")
    assert raised.value.hint == "msgflow query"


def test_nearest_finds_slips_and_parts() -> None:
    known = ["executor-usage", "e2e-latency", "flows"]
    assert nearest("e2e-latncy", known) == ["e2e-latency"]
    assert nearest("usage", known)[0] == "executor-usage"
    assert nearest("", known) == []
    assert nearest("foo", ("roots", "reached")) == []


def test_what_may_be_meant_comes_before_what_there_is() -> None:
    assert meant_or(["flows"], "it has a and b") == "did you mean flows; it has a and b"
    assert meant_or(["a", "b"], "there is c", "?") == "did you mean a or b? there is c"
    assert meant_or([], "it has a and b") == "it has a and b"


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("jitter", "msgflow query timers or msgflow query topics --measure rate"),
        ("drops", "msgflow query topics --measure delivery"),
        ("Blocking", "msgflow query waits --by pair"),
        ("nodes", "msgflow info --section nodes"),
        ("loss", "msgflow query topics --measure delivery or msgflow info --section quality"),
        ("executor_wait", "it is a view: msgflow sql 'FROM executor_wait'"),
        ("take", "it is a view: msgflow sql 'FROM take'"),
        ("../x/../node.", "msgflow query"),
        ("callback-schedule", "msgflow query scheduling"),
        ("thread-states", "msgflow query scheduling --measure threads"),
        ("cpu-usage", "msgflow query scheduling --measure cpu"),
        (
            "preemption",
            "msgflow query scheduling --measure preemption or msgflow query waits --by pair",
        ),
        ("wakeup-latency", "msgflow query scheduling --measure wakeup"),
    ],
)
def test_words_for_what_a_query_answers(name: str, hint: str) -> None:
    with pytest.raises(UsageError) as raised:
        load_query(name, public_names)
    assert raised.value.hint == hint


def test_every_word_leads_to_a_query() -> None:
    for queries in queries_by_word().values():
        assert all(load_query(query) for query in queries)
