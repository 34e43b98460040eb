"""The SQL files of the project, where they belong, and what they refer to."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

from msgflow.db import objects
from msgflow.files.resources import resource_directory
from msgflow.sql.header import Header, read

# From left to right: an object reads only its own layer and those to its left.
LAYERS = (
    "alignment", "model", "kernel", "arrival", "overlap", "store", "link", "clock", "delivery",
    "flow", "stat", "public", "health", "queries", "internal", "culprit",
)  # fmt: skip


@dataclass(frozen=True)
class SqlFile:
    """A file with an SQL object: its layer and its header."""

    layer: str
    path: Path
    header: Header

    def __str__(self) -> str:
        return f"{self.layer}/{self.path.stem}"

    @property
    def references(self) -> set[str]:
        """Every object that comes before this one, but for the tables of events."""
        return {name for name in self.header.needs if not name.startswith("raw.")}


def sql_paths() -> list[tuple[str, Path]]:
    """Return (layer, path) of every SQL file with a header."""
    schema = resource_directory("schema")
    folders = [(each.name, each) for each in sorted(schema.iterdir()) if each.is_dir()]
    folders.append(("queries", resource_directory("queries")))
    return [(layer, path) for layer, folder in folders for path in sorted(folder.glob("**/*.sql"))]


@cache
def sql_files() -> list[SqlFile]:
    """Return every SQL file, parsed, with what its columns share with a table."""
    public = {header.path: header for header in objects.load("public")}
    return [SqlFile(layer, path, public.get(path) or read(path)) for layer, path in sql_paths()]
