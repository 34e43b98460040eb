"""The file in which a user declares indirect links: YAML, every mistake named with its line.

links:
  - kind: periodic_async
    node: /fusion
    inputs: [/lidar, /camera]
    outputs: [/objects]
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NoReturn

from msgflow.errors import UsageError
from msgflow.text_file import read_text

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

KINDS = ("periodic_async", "partial_sync")
_REQUIRED = ("kind", "node", "inputs", "outputs")
_OPTIONAL = ("inputs_of", "process", "host")
_EXAMPLE = "links: [{kind: periodic_async, node: /fusion, inputs: [/lidar], outputs: [/objects]}]"


@dataclass(frozen=True)
class Text:
    """A text of the file, and the line it stands on, from 1."""

    value: str
    line: int


@dataclass(frozen=True)
class DeclaredLink:
    """One entry of the file, as it was written.

    Attributes:
        kind: 'periodic_async' or 'partial_sync'.
        node: full name of a node, or a pattern.
        inputs: topics that the node receives, or patterns.
        inputs_of: name or pattern of another node of its process that receives them for it.
        outputs: topics that it publishes, or patterns.
        process: name or pid of its process, where the name of the node occurs twice.
        host: its host, likewise.
        line: where the entry begins.
    """

    kind: str
    node: Text
    inputs: tuple[Text, ...]
    outputs: tuple[Text, ...]
    inputs_of: Text | None
    process: Text | None
    host: Text | None
    line: int


@dataclass(frozen=True)
class LinksFile:
    """A file with declared links.

    Attributes:
        path: the file.
        links: its entries, in order.
    """

    path: Path
    links: tuple[DeclaredLink, ...]

    def fail(self, line: int, what: str, hint: str | None = None) -> NoReturn:
        """Raise the error of a line."""
        raise UsageError(f"{self.path}, line {line}: {what}", hint)


def read_links(path: Path) -> LinksFile:
    """Read a file with declared links; whether its names exist is for a run to say.

    Raises:
        UsageError: the file cannot be read, is not YAML, or not of the form above.
    """
    text = read_text(path, "cannot read the file", _EXAMPLE)
    root = _compose(text, path)
    reader = _Reader(LinksFile(path, ()))
    return LinksFile(path, reader.links(root))


def _compose(text: str, path: Path) -> Any:
    """Return the tree of nodes of the only document, which know their lines."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    try:
        return YAML(typ="safe", pure=True).compose(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = 1 if mark is None else mark.line + 1
        what = " ".join(str(error.problem or error.context or "not YAML").split())
        raise UsageError(
            f"{path}, line {line}: {what}", "quote patterns that begin with *, as in '*_raw'"
        ) from error
    except (YAMLError, RecursionError, ValueError) as error:
        raise UsageError(f"not a YAML file — {path}", _EXAMPLE) from error


class _Reader:
    """Turns the tree into entries, or names the first line that is wrong."""

    def __init__(self, file: LinksFile) -> None:
        self._file = file

    def links(self, root: Any) -> tuple[DeclaredLink, ...]:
        if root is None:
            self._file.fail(1, "the file is empty", _EXAMPLE)
        fields = self._mapping(root, "the file", ("links",), ())
        entries = fields["links"]
        if _is_null(entries):
            return ()
        if entries.id != "sequence":
            self._file.fail(_line(entries), "links is not a list", _EXAMPLE)
        return tuple(self._link(entry) for entry in entries.value)

    def _link(self, node: Any) -> DeclaredLink:
        fields = self._mapping(node, "a link", _REQUIRED, _OPTIONAL)
        kind = self._text(fields["kind"], "kind")
        if kind.value not in KINDS:
            self._file.fail(
                kind.line,
                f"no such kind of link — {kind.value}",
                f"the kinds are {', '.join(KINDS)}",
            )
        return DeclaredLink(
            kind.value,
            self._text(fields["node"], "node"),
            self._texts(fields["inputs"], "inputs"),
            self._texts(fields["outputs"], "outputs"),
            self._optional(fields, "inputs_of"),
            self._optional(fields, "process"),
            self._optional(fields, "host"),
            _line(node),
        )

    def _mapping(
        self, node: Any, what: str, required: tuple[str, ...], optional: tuple[str, ...]
    ) -> dict[str, Any]:
        names = ", ".join(required + optional)
        if node.id != "mapping":
            self._file.fail(_line(node), f"{what} is not a mapping with {names}", _EXAMPLE)
        fields: dict[str, Any] = {}
        for key, value in node.value:
            name = key.value if key.id == "scalar" else "…"
            if name not in required + optional:
                self._file.fail(_line(key), f"{what} has no {name}", f"it has {names}")
            if name in fields:
                self._file.fail(_line(key), f"{name} is given twice")
            if _is_null(value) and name != "links":
                self._file.fail(_line(key), f"{name} has no value", _EXAMPLE)
            fields[name] = value
        for name in required:
            if name not in fields:
                self._file.fail(_line(node), f"{what} lacks {name}", _EXAMPLE)
        return fields

    def _texts(self, node: Any, what: str) -> tuple[Text, ...]:
        if node.id != "sequence":
            return (self._text(node, what),)
        if not node.value:
            self._file.fail(_line(node), f"{what} is empty", _EXAMPLE)
        return tuple(self._text(item, what) for item in node.value)

    def _optional(self, fields: Mapping[str, Any], name: str) -> Text | None:
        return self._text(fields[name], name) if name in fields else None

    def _text(self, node: Any, what: str) -> Text:
        if node.id != "scalar" or _is_null(node) or not str(node.value).strip():
            self._file.fail(_line(node), f"{what} is not a name or a pattern", _EXAMPLE)
        return Text(str(node.value), _line(node))


def _line(node: Any) -> int:
    return int(node.start_mark.line) + 1


def _is_null(node: Any) -> bool:
    return str(node.tag) == "tag:yaml.org,2002:null"
