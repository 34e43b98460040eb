"""Named paths: the file in which a user keeps them, and suggestions for it."""

from msgflow.paths.paths_file import NamedPath, PathsFile, read_paths
from msgflow.paths.suggested_paths import suggest_paths

__all__ = ["NamedPath", "PathsFile", "read_paths", "suggest_paths"]
