"""Suggestion of indirect links: a file to review, from the query `link-suggestions`."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

from msgflow.yaml_file import list_lines, quoted

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

_HEAD = (
    "Candidates for indirect links, found in what was traced. Only the author of a node knows what"
    " it does with messages that it keeps: review every entry, delete what is wrong, then run the"
    " command below. Not everything is found: messages that also lead elsewhere, such as those"
    " that two links of a node share, may be missing."
)
# With the indent of an entry, no comment is wider than a terminal of 80 columns.
_WIDTH = 76


def suggest_links(rows: Sequence[Mapping[str, Any]], command: str) -> str:
    """Return a file with the candidates, and the evidence of each as a comment.

    Args:
        rows: of the query `link-suggestions`.
        command: what applies the file.
    """
    lines = [*_comment(_HEAD), f"#   {command}"]
    if not rows:
        return "\n".join([*lines, "# There are none.", "links: []"])
    lines.append("links:")
    for row in rows:
        lines += _entry(row)
    return "\n".join(lines)


def _entry(row: Mapping[str, Any]) -> list[str]:
    lines = [
        *(f"  {line}" for line in _comment(f"{row['node']}: {row['evidence']}")),
        *(f"  {line}" for line in _comment(f"Doubtful: {row['doubt']}." if row["doubt"] else "")),
        f"  - kind: {row['kind']}",
        f"    node: {quoted(row['node'])}",
    ]
    if row["is_name_repeated"]:
        lines += [f"    process: {row['pid']}", f"    host: {quoted(row['host'])}"]
    for side in ("inputs", "outputs"):
        lines += list_lines(f"    {side}", [quoted(name) for name in row[side]])
    return lines


def _comment(text: str) -> list[str]:
    return [f"# {line}" for line in textwrap.wrap(text, _WIDTH, break_on_hyphens=False)]
