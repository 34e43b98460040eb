"""Text files that users write: small, regular, UTF-8."""

from __future__ import annotations

from pathlib import Path

from msgflow.errors import UsageError
from msgflow.trace.regular_file import read_regular

# No user writes more by hand. Parsers of YAML need a hundred times as much memory.
MOST_BYTES = 1_000_000


def read_text(path: Path, what: str, hint: str) -> str:
    """Return the text of a file."""
    try:
        content = read_regular(path, MOST_BYTES)
    except (OSError, ValueError) as error:  # such as a NUL in the path
        reason = (getattr(error, "strerror", None) or str(error)).lower()
        raise UsageError(f"{what}: {reason} — {path}", hint) from error
    try:
        return content.decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        raise UsageError(f"not a text file in UTF-8 — {path}", hint) from error
