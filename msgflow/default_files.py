"""Default files of commands; this module imports nothing."""

from pathlib import Path

DEFAULT_DATABASE = Path("msgflow.duckdb")
# Where named paths are looked for.
DEFAULT_PATHS = "paths.yaml"
