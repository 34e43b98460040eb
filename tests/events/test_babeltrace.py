"""Recorded traces, line by line as `babeltrace2` lists them."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from support.thorough import thorough

_LINE = re.compile(
    r"\[(?P<time>[-0-9]+ [:0-9.]+)\] (?P<host>\S+) (?P<name>\S+): \{ cpu_id = (?P<cpu>\d+) \}, "
    r"\{ (?P<context>.*?) \}, \{ (?P<fields>.*)\}"
)
_FIELD = re.compile(r'(\w+) = ("(?:[^"\\]|\\.)*"|\[ .*?\](?=, \w+ = |$)|[^, ]+)')
_ELEMENT = re.compile(r"\[\d+\] = ([^, ]+)")
_OPTIONS = ("--clock-gmt", "--clock-date", "--no-delta")


@pytest.mark.parametrize(
    ("name", "count"), [thorough("tracecompass-ros2", 99_338), ("services", 14_359)]
)
def test_lists_what_babeltrace_lists(
    shared_traces: Path, listing: Callable[..., str], name: str, count: int
) -> None:
    program = shutil.which("babeltrace2")
    if program is None:
        pytest.skip("babeltrace2 is not here")
    path = shared_traces / name
    ours = listing(path).splitlines()
    theirs = subprocess.run(
        [program, *_OPTIONS, str(path)], capture_output=True, text=True, check=True
    ).stdout
    expected = list(translated(theirs))
    assert len(expected) == count
    assert ours == expected


def translated(text: str) -> Iterator[str]:
    """Write the lines of babeltrace2 as ours."""
    for line in text.splitlines():
        match = _LINE.fullmatch(line)
        assert match, line
        context = dict(_FIELD.findall(match["context"]))
        thread = (context["procname"].strip('"'), context["vpid"], context["vtid"])
        found = _FIELD.findall(match["fields"].strip())
        fields = "".join(f" {name}={translated_value(value)}" for name, value in found)
        time = match["time"].replace(" ", "T")
        yield (
            f"{time}Z {match['host']} {'/'.join(thread)} [{match['cpu']}] {match['name']}{fields}"
        )


def translated_value(value: str) -> str:
    if value.startswith("0x"):
        return value.lower()
    if value.startswith("["):
        elements = [translated_value(element) for element in _ELEMENT.findall(value)]
        return f"[{', '.join(elements)}]"
    return value
