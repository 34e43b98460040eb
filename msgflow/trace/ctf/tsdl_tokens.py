"""Splits TSDL text into tokens."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from msgflow.trace.ctf.field_types import MetadataError

_TOKEN = re.compile(
    r"""
    (?P<space>\s+|/\*.*?\*/|//[^\n]*)
  | (?P<text>L?"(?:[^"\\]|\\.)*")
  | (?P<character>L?'(?:[^'\\]|\\.)*')
  | (?P<number>(?:0[xX][0-9a-fA-F]+|0[bB][01]+|[0-9]+)[uUlL]*)
  | (?P<name>[A-Za-z_][A-Za-z0-9_]*)
  | (?P<sign>:=|\.\.\.|->|[{}\[\]()<>;,:=+\-*.])
    """,
    re.VERBOSE | re.DOTALL,
)
# Beyond everything that can make sense, and short enough to be shown.
_LARGEST = 1 << 80
_MOST_DIGITS = 30
_ESCAPE = re.compile(r"\\(?:([0-7]{1,3})|x([0-9a-fA-F]+)|(.))", re.DOTALL)
_ESCAPED = {"n": "\n", "t": "\t", "r": "\r", "a": "\a", "b": "\b", "f": "\f", "v": "\v"}


class Token(NamedTuple):
    """A token: 'text', 'character', 'number', 'name', 'sign' or 'end', and what it says."""

    kind: str
    value: str
    line: int


def tokens_of(text: str) -> list[Token]:
    """Return the tokens of the text, 'end' last."""
    tokens = []
    position, line = 0, 1
    while position < len(text):
        match = _TOKEN.match(text, position)
        if match is None:
            raise MetadataError(f"line {line}: unexpected {text[position]!r}")
        value, kind = match.group(), match.lastgroup or ""
        if kind != "space":
            tokens.append(Token(kind, value, line))
        line += value.count("\n")
        position = match.end()
    tokens.append(Token("end", "the end", line))
    return tokens


class TokenStream:
    """Tokens that are taken one after the other."""

    def __init__(self, tokens: Sequence[Token]) -> None:
        self._tokens = tokens
        self._next = 0

    @property
    def token(self) -> Token:
        """The next token."""
        return self._tokens[self._next]

    def after(self) -> Token:
        """Return the token after the next one."""
        return self._tokens[min(self._next + 1, len(self._tokens) - 1)]

    def take(self) -> Token:
        """Return the next token and go on."""
        token = self.token
        if token.kind != "end":
            self._next += 1
        return token

    def take_if(self, *values: str) -> bool:
        """Go on if the next token is a sign or name of one of these values."""
        if self.token.kind in {"sign", "name"} and self.token.value in values:
            self._next += 1
            return True
        return False

    def expect(self, value: str) -> None:
        """Go on over this sign or name."""
        if not self.take_if(value):
            raise MetadataError(f"expected {value!r}, found {self.token.value!r}")

    def name(self) -> str:
        """Take a name."""
        if self.token.kind != "name":
            raise MetadataError(f"expected a name, found {self.token.value!r}")
        return self.take().value

    def number(self) -> int:
        """Take an integer, with its sign; beyond 80 bits, all are one."""
        negative = False
        while self.token.value in {"-", "+"}:
            negative ^= self.take().value == "-"
        if self.token.kind == "character":
            text = _unescaped(self.token.value.lstrip("L")[1:-1])
            if len(text) > 1:
                raise MetadataError(f"{self.token.value:.20} is more than one character")
            self.take()
            value = ord(text or "\0")
        elif self.token.kind == "number":
            value = _integer(self.take().value)
        else:
            raise MetadataError(f"expected a number, found {self.token.value!r}")
        return -value if negative else value

    def text(self) -> str:
        """Take one or more quoted texts, which belong together."""
        if self.token.kind != "text":
            raise MetadataError(f"expected a text, found {self.token.value!r}")
        value = ""
        while self.token.kind == "text":
            value += _unescaped(self.take().value.lstrip("L")[1:-1])
        return value


def _integer(digits: str) -> int:
    digits = digits.rstrip("uUlL")
    if digits[:2].lower() in {"0x", "0b"}:
        return min(int(digits, 0), _LARGEST)
    is_octal = digits[0] == "0" and set(digits) <= set("01234567")
    digits = digits.lstrip("0")
    return _LARGEST if len(digits) > _MOST_DIGITS else int(digits or "0", 8 if is_octal else 10)


def _unescaped(text: str) -> str:
    def replace(match: re.Match[str]) -> str:
        octal, hexadecimal, other = match.groups()
        if other is not None:
            return _ESCAPED.get(other, other)
        return chr(int(octal, 8) if octal else int(hexadecimal, 16) & 0xFF)

    return _ESCAPE.sub(replace, text)
