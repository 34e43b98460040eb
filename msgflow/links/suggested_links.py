"""Candidates for links, as a file to review: doubtful entries are comments."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from msgflow.files.yaml_file import list_lines, quoted
from msgflow.text.values import printable

if TYPE_CHECKING:
    from msgflow.run.choice import Run

_HEAD = (
    "Candidates for links, found in what was traced. Only the author of a node knows what it does"
    " with messages: review every entry, delete what is wrong, then run the command below. Doubtful"
    " entries are comments: take their # away to declare them. Not everything is found: messages"
    " that also lead elsewhere, such as those that two links of a node share, may be missing."
)
_SIDES = (("from", "publishers"), ("to", "subscribers"))
# With the indent of an entry, no comment is wider than a terminal of 80 columns.
_WIDTH = 76


@dataclass(frozen=True)
class LinkSuggestions:
    """What a run suggests.

    Attributes:
        runs: the run; none if the database holds none.
        candidates: rows of the query `links --suggested`.
        declared: links that a file declared before; they stay.
        topics: topics that it named, which stay, and those without a name.
    """

    runs: Sequence[Run]
    candidates: Sequence[Mapping[str, Any]]
    declared: Sequence[Mapping[str, Any]] = ()
    topics: Sequence[Mapping[str, Any]] = ()

    @property
    def certain(self) -> list[Mapping[str, Any]]:
        """Candidates without a doubt."""
        return [row for row in self.candidates if not row["doubt"]]

    @property
    def doubtful(self) -> list[Mapping[str, Any]]:
        """The other candidates."""
        return [row for row in self.candidates if row["doubt"]]

    def text(self, command: str) -> str:
        """Return the file, with the evidence of each candidate, and the command that applies it."""
        lines = [*_comment(_HEAD), f"#   {command}"]
        if not self.candidates and not self.declared:
            return "\n".join([*lines, "# There are none.", "links: []", *self._topics()])
        lines.append("links:")
        for row in self.declared:
            lines += _indented([*_comment(f"{row['node']}: declared before"), *_entry(row)])
        for row in self.candidates:
            lines += _indented(_comment(f"{row['node']}: {row['evidence']}"))
            if row["doubt"]:
                lines += _indented(_comment(f"Doubtful: {row['doubt']}."))
                lines += _indented([f"# {line}" for line in _entry(row)])
            else:
                lines += _indented(_entry(row))
        return "\n".join([*lines, *self._topics()])

    def _topics(self) -> list[str]:
        lines = ["topics:"] if self.topics else []
        for row in self.topics:
            if row["name"] is not None:
                lines.append(f"  - {{name: {quoted(row['name'])}, {row['entry']}}}")
                continue
            ends = [f"{word} {row[side]}" for word, side in _SIDES if row[side]]
            lines += _indented(
                _comment(f"Without a name: {row['message_count']:,} messages {' '.join(ends)}.")
            )
            lines += _indented([f"# - {{name: /NAME, {printable(row['entry'])}}}"])
        return lines


def _entry(row: Mapping[str, Any]) -> list[str]:
    lines = [f"- kind: {row['kind']}", f"  node: {quoted(row['node'])}"]
    if row["is_name_repeated"]:
        lines += [f"  process: {row['pid']}", f"  host: {quoted(row['host'])}"]
    if row.get("inputs_of"):
        lines.append(f"  inputs_of: {quoted(row['inputs_of'])}")
    for side in ("inputs", "outputs"):
        lines += list_lines(f"  {side}", [quoted(name) for name in row[side]], _WIDTH)
    if row.get("queue_depth"):
        lines.append(f"  depth: {row['queue_depth']}")
    return lines


def _indented(lines: Sequence[str]) -> list[str]:
    return [f"  {line}" for line in lines]


def _comment(text: str) -> list[str]:
    words = printable(" ".join(text.split()))
    return [f"# {line}" for line in textwrap.wrap(words, _WIDTH, break_on_hyphens=False)]
