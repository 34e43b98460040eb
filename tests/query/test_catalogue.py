from __future__ import annotations

import pytest

from msgflow.db.objects import public_names
from msgflow.errors import UsageError
from msgflow.name_suggestions import meant_or, nearest
from msgflow.query.catalogue import QUERIES_BY_WORD, load_queries, load_query, query_names


def test_the_catalogue_is_the_folder() -> None:
    assert "info-topics" in query_names()
    assert [header.name for header in load_queries()] == list(query_names())
    assert load_query("info-topics").title == "Topics"


def test_a_file_is_parsed_once() -> None:
    assert load_query("info-topics") is load_query("info-topics", public_names)


def test_an_unknown_query_is_refused_with_similar_ones() -> None:
    with pytest.raises(UsageError) as raised:
        load_query("info-topic")
    assert raised.value.message == "there is no such query — info-topic"
    assert "msgflow query info-topics" in str(raised.value.hint)


def test_without_a_similar_one_the_list_is_named() -> None:
    with pytest.raises(UsageError) as raised:
        load_query("xyzzy")
    assert raised.value.hint == "msgflow query --list"


def test_nearest_finds_slips_and_parts() -> None:
    known = ["callback-duration", "e2e-latency", "flows"]
    assert nearest("e2e-latncy", known) == ["e2e-latency"]
    assert nearest("duration", known)[0] == "callback-duration"
    assert nearest("", known) == []
    assert nearest("foo", ("roots", "reached")) == []


def test_what_may_be_meant_comes_before_what_there_is() -> None:
    assert meant_or(["flows"], "it has a and b") == "did you mean flows; it has a and b"
    assert meant_or(["a", "b"], "there is c", "?") == "did you mean a or b? there is c"
    assert meant_or([], "it has a and b") == "it has a and b"


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("jitter", "msgflow query timers or msgflow query publication-rate"),
        ("drops", "msgflow query delivery"),
        ("Blocking", "msgflow query interference"),
        ("topics", "msgflow query info-topics"),
        ("loss", "msgflow query delivery or msgflow query data-quality"),
        ("executor_wait", "it is a view: msgflow sql 'FROM executor_wait'"),
        ("take", "it is a view: msgflow sql 'FROM take'"),
        ("../x/../node.", "msgflow query --list"),
    ],
)
def test_words_for_what_a_query_answers(name: str, hint: str) -> None:
    with pytest.raises(UsageError) as raised:
        load_query(name, public_names)
    assert raised.value.hint == hint


def test_every_word_leads_to_a_query() -> None:
    assert {query for queries in QUERIES_BY_WORD.values() for query in queries} <= set(
        query_names()
    )
