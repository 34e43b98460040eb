"""File in which a user gives paths names: YAML; errors name the line.

paths:
  - name: camera-to-motors
    from: /camera/image
    to: /base/motors
    via: [/planning/planner]
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgflow.errors import UsageError
from msgflow.files.yaml_file import Text, YamlFile
from msgflow.query.names import VISITS, require_names
from msgflow.text.name_suggestions import did_you_mean

if TYPE_CHECKING:
    import duckdb

    from msgflow.run.choice import Run

WORDS = ("from", "to", "via", "without")
_EXAMPLE = "paths: [{name: camera-to-motors, from: /camera/image, to: /base/motors}]"
_QUOTING = "quote patterns that begin with *, as in '*_raw'"


@dataclass(frozen=True)
class NamedPath:
    """One entry of the file."""

    name: Text  # its name, for `--path`
    # topics and nodes, or globs, by 'from', 'to', 'via' and 'without'
    places: dict[str, tuple[Text, ...]]

    def words(self) -> dict[str, list[str]]:
        """Return the arguments of `Database.query` for this path."""
        return {word: [text.value for text in texts] for word, texts in self.places.items()}


@dataclass(frozen=True)
class PathsFile:
    """A file with named paths."""

    file: YamlFile  # for errors, which name the line
    paths: tuple[NamedPath, ...]  # its entries, in order; their names differ

    def named(self, name: str) -> NamedPath:
        """Return the path with a name."""
        for path in self.paths:
            if path.name.value == name:
                return path
        known = [path.name.value for path in self.paths]
        others = f"it has {', '.join(known[:10]) or 'none; msgflow suggest paths finds some'}"
        raise UsageError(
            f"{self.file.path} has no path of this name — {name}", did_you_mean(name, known, others)
        )

    def require(
        self, connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], path: NamedPath
    ) -> None:
        """Raise unless the runs have every topic and node of a path."""
        for word, texts in path.places.items():
            kind = "visit" if word in VISITS else "place"
            for text in texts:
                try:
                    require_names(connection, runs, kind, [text.value])
                except UsageError as error:
                    self.file.fail(text.line, error.message, error.hint)


def read_paths(path: Path) -> PathsFile:
    """Read a file with named paths; a run decides later whether its topics and nodes exist."""
    file = YamlFile(path, _EXAMPLE, _QUOTING)
    paths: dict[str, NamedPath] = {}
    (entries,) = file.entries("paths")
    for node in entries:
        one = _path(file, node)
        if one.name.value in paths:
            before = paths[one.name.value].name.line
            file.fail(one.name.line, f"line {before} has this name, too — {one.name.value}")
        paths[one.name.value] = one
    return PathsFile(file, tuple(paths.values()))


def _path(file: YamlFile, node: Any) -> NamedPath:
    fields = file.mapping(node, "a path", ("name",), WORDS)
    name = file.text(fields["name"], "name", "a name")
    if name.value.isdecimal():
        file.fail(name.line, f"a number is that of a path of a query — {name.value}", _EXAMPLE)
    places = {word: file.texts(fields[word], word) for word in WORDS if word in fields}
    if not places:
        file.fail(name.line, f"nothing says which path it is — {name.value}", _EXAMPLE)
    for texts in places.values():
        for text in texts:
            if "," in text.value:
                file.fail(text.line, f"several names are a list — {text.value}", "[/a, /b]")
    return NamedPath(name, places)
