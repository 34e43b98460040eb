"""How lists of SELECT are laid out: what is checked, and a program that lays them out anew.

An expression or an alias has a line of its own; plain columns and values may share one. So a diff
shows which column has changed, and the eye finds a column at the left edge.

    python tests/support/sql_layout.py [FILES]        prints where a list breaks the rule
    python tests/support/sql_layout.py --fix [FILES]  lays these lists out anew

Only white space between tokens moves.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("msgflow", "schema", "queries")
GENERATED = {ROOT / "schema" / "store.sql", ROOT / "schema" / "model.sql"}
WIDTH = 100
INDENT = 4

TOKEN = re.compile(
    r"""(?P<space>\s+)
    | (?P<comment>--[^\n]*)
    | (?P<text>'(?:[^']|'')*')
    | (?P<word>"[^"]*"|\$?[A-Za-z_]\w*)
    | (?P<number>\d[\w.]*)
    | (?P<sign>:=|::|<>|<=|>=|!=|->>|->|=>|\|\||.)""",
    re.VERBOSE,
)
COLUMN = re.compile(r'[a-z_]\w*|"[^"]*"|\*')
VALUE = re.compile(r"NULL|true|false|\$\w+|-?\d[\w.]*|'(?:[^']|'')*'")
# What ends a list of SELECT, and begins a line of its own where a query has several.
CLAUSES = {
    "FROM",
    "WHERE",
    "GROUP",
    "HAVING",
    "QUALIFY",
    "WINDOW",
    "ORDER",
    "LIMIT",
    "UNION",
    "EXCEPT",
    "INTERSECT",
}
JOINS = {"LEFT", "RIGHT", "FULL", "OUTER", "INNER", "CROSS", "ASOF", "SEMI", "ANTI", "POSITIONAL"}
# Where a line that is too long may be broken: before these words and signs.
BREAKS = {"AND", "OR", "WHEN", "THEN", "ELSE", "END", "OVER", "FILTER", "ON", "ORDER", "AS"}
BREAKS |= {"||", "+", "-", "*", "/", "=", "<>", "<", ">", "<=", ">=", "IN", "IS", "JOIN", *JOINS}


@dataclass
class Item:
    """A column or expression of a list: the places of its first and last token."""

    first: int
    last: int


@dataclass
class SelectList:
    """What stands between SELECT and the clause behind it, all by place of the token."""

    select: int
    items: list[Item]
    end: int


class Layout:
    """The tokens of an SQL text, and the white space before each."""

    def __init__(self, sql: str) -> None:
        self.tokens: list[str] = []
        self.gaps: list[str] = []
        gap = ""
        for match in TOKEN.finditer(sql):
            if match.lastgroup == "space":
                gap = match.group()
                continue
            self.tokens.append(match.group())
            self.gaps.append(gap)
            gap = ""
        self.tail = gap
        # For each bracket, the place of its other half.
        self.pair: dict[int, int] = {}
        opened: list[int] = []
        for place, token in enumerate(self.tokens):
            if token in ("(", "[", "{"):
                opened.append(place)
            elif token in (")", "]", "}"):
                start = opened.pop()
                self.pair |= {start: place, place: start}

    def text(self) -> str:
        """Return the SQL as it is laid out now."""
        return "".join(map("".join, zip(self.gaps, self.tokens, strict=True))) + self.tail

    def begins_line(self, place: int) -> bool:
        """Tell whether a token is the first of its line."""
        return place == 0 or "\n" in self.gaps[place]

    def line_start(self, place: int) -> int:
        """Return the place of the first token of the line of a token."""
        while not self.begins_line(place):
            place -= 1
        return place

    def indent(self, place: int) -> int:
        """Return the indent of the line of a token."""
        return len(self.gaps[self.line_start(place)].rpartition("\n")[2])

    def break_before(self, place: int, indent: int) -> None:
        """Let a token begin a line; empty lines before it stay."""
        self.gaps[place] = "\n" * max(self.gaps[place].count("\n"), 1) + " " * indent

    def shift(self, first: int, last: int, by: int) -> None:
        """Move those lines to the right that begin with one of these tokens."""
        for place in range(first, last + 1):
            if self.begins_line(place):
                old = len(self.gaps[place].rpartition("\n")[2])
                self.break_before(place, max(old + by, 0))

    def after(self, place: int) -> int:
        """Return the place behind a token, or behind a bracket and all in it."""
        return self.pair.get(place, place) + 1

    def is_clause(self, place: int) -> bool:
        """Tell whether a clause begins here: not where a comparison says DISTINCT FROM."""
        token = self.tokens[place]
        return token in CLAUSES and not (token == "FROM" and self.tokens[place - 1] == "DISTINCT")

    def select_lists(self) -> Iterator[SelectList]:
        """Yield all lists of SELECT, also those in others."""
        for select, token in enumerate(self.tokens):
            if token == "SELECT":
                yield self._list(select)

    def _list(self, select: int) -> SelectList:
        place = select + 1
        if self.tokens[place] == "DISTINCT":
            place += 1
            if self.tokens[place] == "ON":
                place = self.after(place + 1)
        items: list[Item] = []
        is_new = True
        while place < len(self.tokens):
            token = self.tokens[place]
            if token in (")", ";") or self.is_clause(place):
                break
            if token == ",":
                is_new = True
            elif not token.startswith("--"):
                if is_new:
                    items.append(Item(place, place))
                items[-1].last = self.after(place) - 1
                is_new = False
            place = self.after(place)
        return SelectList(select, items, place)

    def is_plain(self, item: Item) -> bool:
        """Tell whether an item is a column or a value, without an alias."""
        tokens = self.tokens[item.first : item.last + 1]
        if VALUE.fullmatch("".join(tokens)):
            return True
        names, dots = tokens[::2], tokens[1::2]
        are_names = all(COLUMN.fullmatch(name) for name in names)
        return are_names and len(names) > len(dots) and set(dots) <= {"."}

    def is_wrong(self, found: SelectList) -> bool:
        """Tell whether an expression or alias shares its line with another item."""
        return any(
            not (self.is_plain(item) and self.is_plain(following))
            and not any(map(self.begins_line, range(item.last + 1, following.first + 1)))
            for item, following in zip(found.items, found.items[1:], strict=False)
        )

    def line_of(self, place: int) -> int:
        """Return the number of the line of a token."""
        before = [self.gaps[each] + self.tokens[each] for each in range(place)]
        return "".join([*before, self.gaps[place]]).count("\n") + 1


def _lay_out(layout: Layout, found: SelectList) -> None:
    """Give each expression of a list a line."""
    _open(layout, found)
    select, end = found.select, found.end
    base = layout.indent(select)
    was_beside = end < len(layout.tokens) and not layout.begins_line(end)
    moved = [base + INDENT - layout.indent(item.first) for item in found.items]
    for item, by in zip(found.items, moved, strict=True):
        layout.shift(item.first + 1, item.last, by)
    behind = select + 1
    may_share = False
    for item in found.items:
        is_plain = layout.is_plain(item)
        comments = [
            place for place in range(behind, item.first) if layout.tokens[place].startswith("--")
        ]
        for place in filter(layout.begins_line, comments):
            layout.break_before(place, base + INDENT)
        layout.gaps[item.first] = " "
        width = _width(layout, layout.line_start(item.first), item.last) + len(",")
        if comments or not (is_plain and may_share) or width > WIDTH:
            layout.break_before(item.first, base + INDENT)
        behind = item.last + 1
        may_share = is_plain
    if was_beside:
        _break_clauses(layout, found, base)
    last = end
    while last < len(layout.tokens) and layout.tokens[last] not in (")", ";"):
        last = layout.after(last)
    _shorten(layout, select, min(last, len(layout.tokens) - 1))


def _width(layout: Layout, first: int, last: int) -> int:
    """Return how wide a line is from its first token to another."""
    texts = [layout.tokens[first]]
    texts += [layout.gaps[place] + layout.tokens[place] for place in range(first + 1, last + 1)]
    return layout.indent(first) + len("".join(texts))


def _open(layout: Layout, found: SelectList) -> None:
    """Let SELECT begin a line; where it stands behind a bracket, the bracket closes on another."""
    select = found.select
    if layout.begins_line(select):
        return
    indent = layout.indent(select)
    if layout.tokens[select - 1] != "(":
        layout.break_before(select, indent)
        return
    close = layout.pair[select - 1]
    lines = [place for place in range(select + 1, close) if layout.begins_line(place)]
    if lines:
        least = min(layout.indent(place) for place in lines)
        layout.shift(select + 1, close - 1, indent + INDENT - least)
    layout.break_before(select, indent + INDENT)
    layout.break_before(close, indent)


def _break_clauses(layout: Layout, found: SelectList, base: int) -> None:
    """Let each clause behind a list begin a line, up to the end of the query."""
    place = found.end
    while place < len(layout.tokens) and layout.tokens[place] != ";":
        token = layout.tokens[place]
        if token == ")":
            if not layout.begins_line(place):
                layout.break_before(place, max(base - INDENT, 0))
            return
        begin = place
        while token == "JOIN" and layout.tokens[begin - 1] in JOINS:
            begin -= 1
        is_clause = token in ("JOIN", "SELECT") or layout.is_clause(place)
        if is_clause and not layout.begins_line(begin):
            layout.break_before(begin, base)
        place = layout.after(place)


def _shorten(layout: Layout, first: int, last: int) -> None:
    """Break lines that are too long, at the outermost place where they may be."""
    place = first
    while place <= last:
        stop = place
        while stop < len(layout.tokens) - 1 and not layout.begins_line(stop + 1):
            stop += 1
        if _width(layout, layout.line_start(place), stop) > WIDTH:
            _break(layout, layout.line_start(place), stop)
        # What was broken off may be too long as well.
        place += 1
        while place <= last and not layout.begins_line(place):
            place += 1


def _break(layout: Layout, start: int, stop: int) -> None:
    """Break a line before the last place that leaves it short enough, of those least deep.

    A clause goes before all others.
    """
    depth = 0
    choices: list[tuple[int, bool, int]] = []
    for place in range(start, stop + 1):
        token = layout.tokens[place]
        depth -= token in (")", "]", "}")
        is_clause = layout.is_clause(place)
        may_break = is_clause or token in BREAKS or layout.tokens[place - 1] in (",", "(")
        if place > start and may_break and _width(layout, start, place - 1) <= WIDTH:
            choices.append((-depth, is_clause, place))
        depth += token in ("(", "[", "{")
    if choices:
        _, is_clause, place = max(choices)
        layout.break_before(place, layout.indent(start) + (0 if is_clause else INDENT))


def fixed(sql: str) -> str:
    """Return SQL of the same tokens in which no list breaks the rule."""
    layout = Layout(sql)
    while found := next(filter(layout.is_wrong, layout.select_lists()), None):
        _lay_out(layout, found)
        assert not layout.is_wrong(found)
    text = layout.text()
    assert Layout(text).tokens == layout.tokens
    return text


def wrong_lines(sql: str) -> list[int]:
    """Return the lines with a SELECT whose list breaks the rule."""
    layout = Layout(sql)
    return [layout.line_of(each.select) for each in layout.select_lists() if layout.is_wrong(each)]


def sql_paths() -> list[Path]:
    """Return all files of SQL that people write."""
    paths = (path for room in ROOMS for path in sorted((ROOT / room).rglob("*.sql")))
    return [path for path in paths if path not in GENERATED]


def main(words: list[str]) -> int:
    """Print where lists break the rule, or lay them out anew."""
    is_fixing = "--fix" in words
    paths = [Path(word) for word in words if word != "--fix"] or sql_paths()
    count = 0
    for path in paths:
        sql = path.read_text(encoding="utf-8")
        if not is_fixing:
            for line in wrong_lines(sql):
                count += 1
                print(f"{path}:{line}: an expression shares its line")
        elif (text := fixed(sql)) != sql:
            path.write_text(text, encoding="utf-8")
            print(path)
            for line in text.splitlines():
                if len(line) > WIDTH:
                    count += 1
                    print(f"    break by hand: {line.strip()}")
    return min(count, 1)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
