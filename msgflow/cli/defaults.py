"""Files that are meant where none is named."""

from pathlib import Path

DEFAULT_DATABASE = Path("msgflow.duckdb")
DEFAULT_PATHS = "paths.yaml"
