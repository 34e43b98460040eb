"""YAML files that users write by hand: errors name the line; lines and names are written back."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from msgflow.errors import UsageError
from msgflow.files.text_file import read_text

_WIDTH = 80
_PLAIN = re.compile(r"[A-Za-z/][\w/.-]*")
_WORDS = {"null", "true", "false", "yes", "no", "on", "off", "y", "n"}


@dataclass(frozen=True)
class Text:
    """A text of the file, and the line it stands on, from 1."""

    value: str
    line: int


@dataclass(frozen=True)
class YamlFile:
    """A file, read as a tree of nodes that know their lines."""

    path: Path
    example: str  # of its content, for hints
    quoting: str  # what users forget to quote, for the hint of a file that is not YAML
    content: str | None = None  # of the file, if it is not written yet

    def fail(self, line: int, what: str, hint: str | None = None) -> NoReturn:
        """Raise the error of a line."""
        raise UsageError(f"{self.path}, line {line}: {what}", hint)

    def entries(self, *names: str) -> tuple[list[Any], ...]:
        """Return the nodes of each list; the file has at least one list and no other keys."""
        root = self.root()
        if root is None:
            self.fail(1, "the file is empty", self.example)
        lists = self.mapping(root, "the file", (), names, may_be_null=names)
        if not lists:
            self.fail(line_of(root), f"the file lacks {' or '.join(names)}", self.example)
        there = {name: node for name, node in lists.items() if not is_null(node)}
        for name, node in there.items():
            if node.id != "sequence":
                self.fail(line_of(node), f"{name} is not a list", self.example)
        return tuple(list(there[name].value) if name in there else [] for name in names)

    def mapping(
        self,
        node: Any,
        what: str,
        required: tuple[str, ...],
        optional: tuple[str, ...],
        may_be_null: tuple[str, ...] = (),
    ) -> dict[str, Any]:
        """Return the values of a mapping by name: all required ones, and no unknown ones."""
        names = ", ".join(required + optional)
        if node.id != "mapping":
            self.fail(line_of(node), f"{what} is not a mapping with {names}", self.example)
        fields: dict[str, Any] = {}
        for key, value in node.value:
            name = key.value if key.id == "scalar" else "…"
            if name not in required + optional:
                self.fail(line_of(key), f"{what} has no {name}", f"it has {names}")
            if name in fields:
                self.fail(line_of(key), f"{name} is given twice")
            if is_null(value) and name not in may_be_null:
                self.fail(line_of(key), f"{name} has no value", self.example)
            fields[name] = value
        for name in required:
            if name not in fields:
                self.fail(line_of(node), f"{what} lacks {name}", self.example)
        return fields

    def texts(self, node: Any, what: str, kind: str = "a name or a pattern") -> tuple[Text, ...]:
        """Return the texts of a list, or a single text."""
        if node.id != "sequence":
            return (self.text(node, what, kind),)
        if not node.value:
            self.fail(line_of(node), f"{what} is empty", self.example)
        return tuple(self.text(item, what, kind) for item in node.value)

    def optional(self, fields: Mapping[str, Any], name: str) -> Text | None:
        """Return the text of a field that may be missing."""
        return self.text(fields[name], name) if name in fields else None

    def text(self, node: Any, what: str, kind: str = "a name or a pattern") -> Text:
        """Return the text of a node."""
        if node.id != "scalar" or is_null(node) or not str(node.value).strip():
            self.fail(line_of(node), f"{what} is not {kind}", self.example)
        return Text(str(node.value), line_of(node))

    def root(self) -> Any:
        """Return the tree of nodes of the only document; nodes know their lines."""
        from ruamel.yaml import YAML
        from ruamel.yaml.error import MarkedYAMLError, YAMLError

        text = self.content
        if text is None:
            text = read_text(self.path, "cannot read the file", self.example)
        try:
            return YAML(typ="safe", pure=True).compose(text)
        except MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            line = 1 if mark is None else mark.line + 1
            what = " ".join(str(error.problem or error.context or "not YAML").split())
            raise UsageError(f"{self.path}, line {line}: {what}", self.quoting) from error
        except (YAMLError, RecursionError, ValueError) as error:
            raise UsageError(f"not a YAML file — {self.path}", self.example) from error


def line_of(node: Any) -> int:
    """Return the line of a node, from 1."""
    return int(node.start_mark.line) + 1


def is_null(node: Any) -> bool:
    """Tell whether a node is null."""
    return str(node.tag) == "tag:yaml.org,2002:null"


def quoted(text: str) -> str:
    """Return a text as YAML writes it: in quotes, unless it is plainly a name."""
    return text if _PLAIN.fullmatch(text) and text.lower() not in _WORDS else in_quotes(text)


def in_quotes(text: str) -> str:
    """Return a text in quotes, on one line, which YAML reads as the same text."""
    # JSON leaves characters as they are that end a line of YAML, or that YAML forbids.
    return "".join(
        each if each.isprintable() else f"\\U{ord(each):08x}"
        for each in json.dumps(text, ensure_ascii=False)
    )


def list_lines(key: str, items: Sequence[str], width: int = _WIDTH) -> list[str]:
    """Return the lines of a list in brackets, for files that people read in a terminal."""
    lines = [f"{key}: ["]
    indent = " " * (len(key) - len(key.lstrip()) + 2)
    for place, item in enumerate(items, start=1):
        text = f"{item}, " if place < len(items) else f"{item}]"
        if len(lines[-1]) + len(text.rstrip()) > width:
            lines.append(indent)
        lines[-1] += text
    return [line.rstrip() for line in lines]
