"""Default files of commands; this module imports nothing."""

from pathlib import Path

DEFAULT_DATABASE = Path("msgflow.duckdb")
# Where suggested links are written when they are applied at once.
DEFAULT_LINKS = Path("links.yaml")
# Where named paths are looked for.
DEFAULT_PATHS = "paths.yaml"
