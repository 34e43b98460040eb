"""Files that are meant where none is named; imports nothing that a command does not need."""

from pathlib import Path

DEFAULT_DATABASE = Path("msgflow.duckdb")
# Where named paths are looked for.
DEFAULT_PATHS = "paths.yaml"
