"""What to change, as blocks of lines for people."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

from msgflow.text.values import ARROW, printable
from msgflow.text.wrapping import hanging

if TYPE_CHECKING:
    from msgflow.replay.remedies import Remedies

_PATHS = 3


def remedy_lines(
    found: Remedies, command_of: Callable[[Sequence[str]], str], width: int
) -> Iterator[str]:
    """Yield a block for each remedy: what it gains where, what gets worse, what is not known.

    `command_of` returns what the shell runs, of words behind `msgflow`.
    """
    gains = found.gains.table.to_pylist()
    for row in found.remedies.table.to_pylist():
        yield from hanging(f"{row['rank']}. ", printable(row["headline"]), width)
        own = [
            each
            for each in gains
            if each["change"] == row["change"]
            and any(
                each[name] is not None and each[name] > 0 for name in ("gain_low_ns", "p95_low_ns")
            )
        ]
        for each in own[:_PATHS]:
            yield from hanging(
                "   ", printable(f"{_ends(each['path'])}: {each['headline']}"), width
            )
        if (more := len(own) - _PATHS) > 0:
            yield f"   {more} more (--wide)"
        for title, lines in (("worse", row["worse"]), ("not known", row["unknown"])):
            if lines:
                yield from hanging(f"   {title}: ", printable("; ".join(lines)), width)
        yield f"   next: {printable(command_of(('predict', '--set', row['change'])))}"
        yield ""
    if not len(found.remedies):
        yield "nothing that was tried is known to make data sooner"


def _ends(path: str) -> str:
    """Return where a path begins and ends."""
    first, *middle, topic, last = path.split(ARROW)
    return ARROW.join([first, *(["…"] if middle else []), topic, last])
