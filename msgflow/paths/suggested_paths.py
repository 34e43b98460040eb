"""Suggestion of named paths: a file with the paths of a run, to choose from."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

from msgflow.files.yaml_file import list_lines, quoted
from msgflow.text.values import ARROW, format_duration, printable
from msgflow.text.wrapping import wrap_path

_HEAD = """\
# Paths of a run by name, for --path: keep those that matter, and call them as
# you like.
#   msgflow query e2e-latency --path NAME"""
# With its indent, no comment is wider than a terminal of 80 columns.
_WIDTH = 76


def suggest_paths(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return a file with a named path for each path of a run, from rows of `e2e-latency`.

    Paths with the same begin and end differ by topics and nodes that only some of them visit.
    """
    texts = list(dict.fromkeys(row["path"] for row in rows))
    if not texts:
        return f"{_HEAD}\n# There are none.\npaths: []"
    evidence = {row["path"]: row for row in rows}
    steps = {text: text.split(ARROW) for text in texts}
    alike: dict[tuple[str, str], list[str]] = defaultdict(list)
    for text in texts:
        # A path begins with its first topic: a node may publish several.
        alike[steps[text][1], steps[text][-1]].append(text)
    taken: Counter[str] = Counter()
    lines = [_HEAD, "paths:"]
    for text in texts:
        first, last = steps[text][1], steps[text][-1]
        siblings = [set(steps[other]) for other in alike[first, last]]
        name = f"{_slug(first)}-to-{_slug(last)}"
        taken[name] += 1
        row = evidence[text]
        seen = f"{row['reached']} of {row['roots']} arrived"
        if row["p99_ns"] is not None:
            seen += f", p99 {format_duration(row['p99_ns'])}"
        lines += [
            *(f"  # {line}" for line in wrap_path(printable(row["path"]), _WIDTH)),
            f"  # {seen}",
            f"  - name: {quoted(name if taken[name] == 1 else f'{name}-{taken[name]}')}",
            f"    from: {quoted(first)}",
            f"    to: {quoted(last)}",
        ]
        own = dict.fromkeys(steps[text])
        via = [step for step in own if not all(step in other for other in siblings)]
        without = sorted(set().union(*siblings) - own.keys())
        for word, places in (("via", via), ("without", without)):
            if places:
                lines += list_lines(f"    {word}", [quoted(place) for place in places])
    return "\n".join(lines)


def _slug(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9]+", "-", name).strip("-").lower() or "unnamed"
