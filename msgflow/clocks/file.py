"""What brings clocks together: nothing, messages, or a file that says how far each is off.

robot-b: {offset_ns: -350000000, drift_ppb: 20, reference_ns: 1795149267363524269}
robot-c: -12500
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from msgflow.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator

METHODS = ("none", "messages")
_FIELDS = ("offset_ns", "drift_ppb", "reference_ns", "uncertainty_ns")
_EXAMPLE = "robot-b: {offset_ns: -350000000, drift_ppb: 20}"
_INTEGER = re.compile(r"[-+]?\d[\d_]*")
_LARGEST_NS = 2**62
# A thousandth: no clock that counts seconds is worse.
_LARGEST_DRIFT_PPB = 1_000_000


@dataclass(frozen=True)
class GivenClock:
    """What a file says of one clock.

    Attributes:
        name: hostname, or uuid of the clock.
        line: where it stands, from 1.
        offset_ns: to be added to its times [ns].
        drift_ppb: to be added per time since the reference [1e-9].
        reference_ns: moment at which offset_ns alone is right [epoch ns, as recorded]; None: the
            begin of its traces.
        uncertainty_ns: bound of the error; None: not known.
    """

    name: str
    line: int
    offset_ns: int
    drift_ppb: int = 0
    reference_ns: int | None = None
    uncertainty_ns: int | None = None


@dataclass(frozen=True)
class ClockSync:
    """How clocks are to be brought together.

    Attributes:
        method: 'none', 'messages' or 'file'.
        path: the file.
        clocks: what it says, in order.
    """

    method: str
    path: Path | None = None
    clocks: tuple[GivenClock, ...] = ()

    def fail(self, line: int, what: str, hint: str | None = None) -> NoReturn:
        """Raise the error of a line of the file."""
        raise UsageError(f"{self.path}, line {line}: {what}", hint)


def read_clock_sync(given: str | Path) -> ClockSync:
    """Return what 'none', 'messages' or the path of a file means.

    The file is TOML where its name ends so, else YAML. Whether its hosts exist is for a run to say.

    Raises:
        UsageError: the file cannot be read, or is not of the form above.
    """
    if isinstance(given, str) and given in METHODS:
        return ClockSync(given)
    path = Path(given)
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise UsageError(
            f"neither {' nor '.join(METHODS)} nor a file that can be read: {reason} — {path}",
            _EXAMPLE,
        ) from error
    except UnicodeDecodeError as error:
        raise UsageError(f"not a text file in UTF-8 — {path}", _EXAMPLE) from error
    sync = ClockSync("file", path)
    entries = _toml(text, sync) if _is_toml(path) else _yaml(text, sync)
    clocks = tuple(_clock(sync, *entry) for entry in entries)
    if not clocks:
        sync.fail(1, "the file names no clock", _EXAMPLE)
    return ClockSync("file", path, clocks)


# Both yield: name, its line, and its fields with their lines; a number alone is the offset.
_Entry = tuple[str, int, dict[str, tuple[str, int]]]


def _is_toml(path: Path | None) -> bool:
    return path is not None and path.suffix == ".toml"


def _toml(text: str, sync: ClockSync) -> Iterator[_Entry]:
    try:
        root = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        where = re.search(r"\(at line (\d+)", str(error))
        line = int(where[1]) if where else text.count("\n") + 1
        sync.fail(line, str(error).partition(" (at ")[0].lower())
    for name, value in root.items():
        line = _toml_line(text, name)
        fields = value if isinstance(value, dict) else {"offset_ns": value}
        yield (
            name,
            line,
            {
                key: (str(field), max(line, _toml_line(text, key, line)))
                for key, field in fields.items()
            },
        )


def _toml_line(text: str, key: str, first: int = 1) -> int:
    """Return the line, from `first` on, that defines a key; the parser does not tell."""
    pattern = re.compile(
        rf"""^\s*(\[\s*["']?{re.escape(key)}["']?\s*\]|["']?{re.escape(key)}["']?\s*[.=])"""
    )
    lines = text.splitlines()[first - 1 :]
    return next((first + at for at, line in enumerate(lines) if pattern.match(line)), first)


def _yaml(text: str, sync: ClockSync) -> Iterator[_Entry]:
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    try:
        root: Any = YAML(typ="safe", pure=True).compose(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        what = " ".join(str(error.problem or error.context or "not YAML").split())
        sync.fail(1 if mark is None else mark.line + 1, what, _EXAMPLE)
    except (YAMLError, RecursionError) as error:
        raise UsageError(f"not a YAML file — {sync.path}", _EXAMPLE) from error
    if root is None:
        return
    for name, value in _pairs(sync, root, "the file is not a mapping from hosts to offsets"):
        fields = {"offset_ns": (_scalar(value), _line(value if _scalar(value) else name))}
        if value.id == "mapping":
            fields = {}
            for key, field in _pairs(sync, value, ""):
                if _scalar(key) in fields:
                    sync.fail(_line(key), f"{_scalar(key)} is given twice")
                fields[_scalar(key)] = (_scalar(field), _line(field if _scalar(field) else key))
        yield _scalar(name), _line(name), fields


def _pairs(sync: ClockSync, node: Any, what: str) -> list[tuple[Any, Any]]:
    if node.id != "mapping":
        sync.fail(_line(node), what, _EXAMPLE)
    return list(node.value)


def _scalar(node: Any) -> str:
    return str(node.value) if node.id == "scalar" else f"a {node.id}"


def _line(node: Any) -> int:
    return int(node.start_mark.line) + 1


def _clock(sync: ClockSync, name: str, line: int, fields: dict[str, tuple[str, int]]) -> GivenClock:
    numbers: dict[str, int] = {}
    for key, (text, field_line) in fields.items():
        if key not in _FIELDS:
            quoted = "; a name with dots stands in quotes" if _is_toml(sync.path) else ""
            sync.fail(field_line, f"a clock has no {key}", f"it has {', '.join(_FIELDS)}{quoted}")
        if not text:
            sync.fail(field_line, f"{key} has no value", _EXAMPLE)
        if not _INTEGER.fullmatch(text):
            sync.fail(field_line, f"{key} is not a whole number — {text}", _EXAMPLE)
        numbers[key] = int(text)
        limit = _LARGEST_DRIFT_PPB if key == "drift_ppb" else _LARGEST_NS
        if abs(numbers[key]) >= limit or (key == "uncertainty_ns" and numbers[key] < 0):
            sync.fail(field_line, f"{key} is beyond what clocks have — {text}", _EXAMPLE)
    if "offset_ns" not in numbers:
        sync.fail(line, f"{name} has no offset_ns", _EXAMPLE)
    return GivenClock(name, line, **numbers)
