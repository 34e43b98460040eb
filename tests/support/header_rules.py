"""Rules for headers of SQL files that the program does not need in order to read them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from itertools import chain

from msgflow.sql.header import Header, Param
from msgflow.sql.value import is_integer

REPEATABLE = {"param", "column", "variant"}
SINGLE = {
    "title", "description", "cause", "cure", "grain", "kind", "severity", "note", "when", "also",
    "reads", "next", "brief",
}  # fmt: skip
NOTES = {"clocks", "callbacks", "kernel", "requests", "goals", "samples", "usage"}
# Begins of lines above the SQL.
_HEAD = re.compile(r"(?:--[^\n]*(?:\n|$))*")
_BRIEF = re.compile(r"^-- brief: +((?:.*\n--     )*.*)$", re.MULTILINE)
_MARKED = re.compile(r"\w+(?: \((?:heading|slowest|even 0|not 0)\))?")
_KEY = re.compile(r"^-- ([a-z_]+):", re.MULTILINE)


def faults(text: str, header: Header) -> Iterator[str]:
    """Yield what is wrong with the text of a file, a sentence each."""
    head = _HEAD.match(text)
    keys = Counter(_KEY.findall(head[0] if head else ""))
    for key, count in keys.items():
        if key not in REPEATABLE | SINGLE:
            yield f"unknown field {key!r}"
        elif count > 1 and key in SINGLE:
            yield f"{key!r} stands twice"
    if not header.description:
        yield "the header has no 'description'"
    if not header.body.strip():
        yield "there is no SQL below the header"
    if "kind" in keys and header.kind != "inline":
        yield f"a file says only that its kind is 'inline', not {header.kind!r}"
    if header.note not in {None, *NOTES}:
        yield f"note {header.note!r} is not one of {', '.join(sorted(NOTES))}"
    columns = [column.name for column in header.columns]
    for names in ([param.name for param in header.params], columns):
        yield from (f"{name!r} stands twice" for name, count in Counter(names).items() if count > 1)
    for name in header.brief:
        if name not in columns:
            yield f"brief names a column that there is not: {name!r}"
    for names in _BRIEF.findall(text):
        for name in re.split(r",\s+(?:--     )?", names):
            if not _MARKED.fullmatch(name):
                yield f"brief has a mark that there is not: {name!r}"
    yield from chain.from_iterable(map(_of_param, (*header.params, *header.variants)))


def _of_param(param: Param) -> Iterator[str]:
    limits = (param.minimum, param.maximum)
    if limits != (None, None) and not is_integer(param.type):
        yield f"only an integer has a minimum, not {param.type}"
    if param.default is None:
        return
    if param.choices and param.default not in param.choices:
        yield f"the default {param.default!r} is not among the choices"
    if isinstance(param.default, int):
        if param.minimum is not None and param.default < param.minimum:
            yield f"the default {param.default} is less than {param.minimum}"
        if param.maximum is not None and param.default > param.maximum:
            yield f"the default {param.default} is more than {param.maximum}"
