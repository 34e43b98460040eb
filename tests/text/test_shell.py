"""Commands as a person types them into a shell."""

from __future__ import annotations

import shlex

import pytest

from msgflow.text.shell import shell_joined, shell_quoted


@pytest.mark.parametrize(
    ("word", "written"),
    [
        ("/scan", "/scan"),
        ("p95 > 5", "'p95 > 5'"),
        ("topic_name = '/scan'", "\"topic_name = '/scan'\""),
        ("it's $HOME", "'it'\\''s $HOME'"),
        ('"it\'s"', "'\"it'\\''s\"'"),
        ("", "''"),
    ],
)
def test_a_shell_takes_a_word_as_it_is(word: str, written: str) -> None:
    assert shell_quoted(word) == written
    assert shlex.split(shell_joined(["msgflow", word])) == ["msgflow", word]
