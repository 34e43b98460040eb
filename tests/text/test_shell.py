"""Commands as a person types them into a shell."""

from __future__ import annotations

import shlex
from itertools import product

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


def test_no_word_of_quotes_leaves_them() -> None:
    words = ["".join(signs) for length in range(6) for signs in product("'\"$x", repeat=length)]
    assert shlex.split(shell_joined(words)) == words
