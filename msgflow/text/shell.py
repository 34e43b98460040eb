"""Commands as a person types them into a shell."""

from __future__ import annotations

import shlex


def shell_joined(words: list[str]) -> str:
    """Return a command of these words, which a shell takes apart again.

    A word with ' in it stands between double quotes where these change nothing: `shlex.join` would
    write each ' as five signs.
    """
    return " ".join(map(shell_quoted, words))


def shell_quoted(word: str) -> str:
    """Return a word that a shell takes as it is."""
    if shlex.quote(word) == word:
        return word
    if "'" in word and not set('"$`\\!') & set(word):
        return f'"{word}"'
    return "'" + word.replace("'", "'\\''") + "'"
