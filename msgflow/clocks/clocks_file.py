"""File of clock offsets, and the other ways to correct clocks: by messages, or not at all.

robot-b: {offset_ns: -350000000, drift_ppb: 20, reference_ns: 1795149267363524269}
robot-c: -12500
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from msgflow.backports import tomllib
from msgflow.errors import UsageError
from msgflow.files.text_file import read_text
from msgflow.files.yaml_file import YamlFile, line_of

METHODS = ("none", "messages")
FIELDS = ("offset_ns", "drift_ppb", "reference_ns", "uncertainty_ns")
_EXAMPLE = "robot-b: {offset_ns: -350000000, drift_ppb: 20}"
# Digits may stand in groups, as in YAML and TOML. No time has more of them.
_INTEGER = re.compile(r"[-+]?[0-9]+(_[0-9]+)*")
_MOST_DIGITS = 40
_MOST_SHOWN = 60
_TOML_KEY = re.compile(
    r"""\s*(\[\s*["']?(?P<table>[^"'\]]*?)["']?\s*\]|["']?(?P<key>[^"'.=\s]+)["']?\s*[.=])"""
)
_LARGEST_NS = 2**62
# One thousandth: every clock is better.
_LARGEST_DRIFT_PPB = 1_000_000


@dataclass(frozen=True)
class GivenClock:
    """The correction of one clock in a file."""

    name: str  # hostname, or uuid of the clock
    line: int  # its line, from 1
    offset_ns: int  # to add to its times [ns]
    drift_ppb: int = 0  # to add per time since the reference [1e-9]
    # The moment when offset_ns alone is right [epoch ns, as recorded]; None: the begin of its
    # traces.
    reference_ns: int | None = None
    uncertainty_ns: int | None = None  # bound of the error [ns]; None: not known


@dataclass(frozen=True)
class ClockSync:
    """A way to correct clocks."""

    method: str  # 'none', 'messages' or 'file'
    clocks: tuple[GivenClock, ...] = ()  # entries of the file, in order
    file: YamlFile | None = None  # for errors, which name the line; it may also be TOML


def read_clock_sync(given: str | Path) -> ClockSync:
    """Return the way that 'none', 'messages' or the path of a file means.

    The file is TOML if its name ends with .toml, else YAML. A run decides later whether its hosts
    exist.
    """
    if isinstance(given, str) and given in METHODS:
        return ClockSync(given)
    path = Path(given)
    text = read_text(path, f"neither {' nor '.join(METHODS)} nor a file that can be read", _EXAMPLE)
    file = YamlFile(path, _EXAMPLE, _EXAMPLE, text)
    entries = _toml(text, file) if path.suffix == ".toml" else _yaml(file)
    clocks = tuple(_clock(file, *entry) for entry in entries)
    if not clocks:
        file.fail(1, "the file names no clock", _EXAMPLE)
    return ClockSync("file", clocks, file)


# Both yield: name, its line, and its fields with their lines; a number alone is the offset.
_Entry = tuple[str, int, dict[str, tuple[str, int]]]


def _toml(text: str, file: YamlFile) -> Iterator[_Entry]:
    try:
        root = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        where = re.search(r"\(at line (\d+)", str(error))
        line = int(where[1]) if where else text.count("\n") + 1
        file.fail(line, str(error).partition(" (at ")[0].lower())
    except (RecursionError, ValueError) as error:  # the latter: a number of thousands of digits
        raise UsageError(f"not a TOML file of clocks — {file.path}", _EXAMPLE) from error
    lines = _toml_lines(text)
    for name, value in root.items():
        line = next(iter(lines.get(name, ())), 1)
        fields = value if isinstance(value, dict) else {"offset_ns": value}
        yield (
            name,
            line,
            {
                key: (_toml_scalar(field), next((n for n in lines.get(key, ()) if n >= line), line))
                for key, field in fields.items()
            },
        )


def _toml_lines(text: str) -> dict[str, list[int]]:
    """Return the lines that may define each key, in order: the parser does not return them."""
    found: dict[str, list[int]] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        if match := _TOML_KEY.match(line):
            found.setdefault(match["table"] or match["key"], []).append(number)
    return found


def _toml_scalar(value: object) -> str:
    if isinstance(value, int) and not isinstance(value, bool):
        # Python refuses to write out numbers that no clock has.
        return str(value) if abs(value) < _LARGEST_NS else "9" * _MOST_DIGITS
    return "a mapping" if isinstance(value, dict) else str(value)


def _yaml(file: YamlFile) -> Iterator[_Entry]:
    root = file.root()
    if root is None:
        return
    if root.id != "mapping":
        file.fail(line_of(root), "the file is not a mapping from hosts to offsets", _EXAMPLE)
    for name, value in root.value:
        fields = {"offset_ns": (_scalar(value), line_of(value if _scalar(value) else name))}
        if value.id == "mapping":
            fields = {}
            for key, field in value.value:
                if _scalar(key) in fields:
                    file.fail(line_of(key), f"{_scalar(key)} is given twice")
                fields[_scalar(key)] = (_scalar(field), line_of(field if _scalar(field) else key))
        yield _scalar(name), line_of(name), fields


def _scalar(node: Any) -> str:
    return str(node.value) if node.id == "scalar" else f"a {node.id}"


def _clock(file: YamlFile, name: str, line: int, fields: dict[str, tuple[str, int]]) -> GivenClock:
    numbers: dict[str, int] = {}
    for key, (text, field_line) in fields.items():
        if key not in FIELDS:
            is_toml = file.path.suffix == ".toml"
            quoted = "; a name with dots stands in quotes" if is_toml else ""
            file.fail(field_line, f"a clock has no {key}", f"it has {', '.join(FIELDS)}{quoted}")
        if not text:
            file.fail(field_line, f"{key} has no value", _EXAMPLE)
        shown = text if len(text) <= _MOST_SHOWN else f"{text[:_MOST_SHOWN]}…"
        if not _INTEGER.fullmatch(text):
            file.fail(field_line, f"{key} is not a whole number — {shown}", _EXAMPLE)
        if len(text) > _MOST_DIGITS:
            file.fail(field_line, f"{key} is beyond what clocks have — {shown}", _EXAMPLE)
        numbers[key] = int(text)
        limit = _LARGEST_DRIFT_PPB if key == "drift_ppb" else _LARGEST_NS
        if abs(numbers[key]) >= limit or (key == "uncertainty_ns" and numbers[key] < 0):
            file.fail(field_line, f"{key} is beyond what clocks have — {text}", _EXAMPLE)
    if "offset_ns" not in numbers:
        file.fail(line, f"{name} has no offset_ns", _EXAMPLE)
    return GivenClock(name, line, **numbers)
