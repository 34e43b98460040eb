from __future__ import annotations

import pytest

from msgflow.errors import UsageError
from msgflow.query.catalogue import load_queries, load_query, nearest, query_names


def test_the_catalogue_is_the_folder() -> None:
    assert "info-topics" in query_names()
    assert [header.name for header in load_queries()] == list(query_names())
    assert load_query("info-topics").title == "Topics"


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
