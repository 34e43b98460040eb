"""Empty databases: all tables, views and macros, and no run.

They are made from `schema/` without a migration, so that Alembic is not needed.
DuckDB takes long to look at each view. Hence the first empty database is kept in the user's cache,
and later ones are copies of it. A cache that is damaged, missing or read-only costs time only.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
from pathlib import Path

import duckdb

from msgflow.db import objects
from msgflow.db.sandbox import BLOCK_BYTES, STORAGE_VERSION, open_file
from msgflow.db.store_table import store_file
from msgflow.db.transaction import transaction
from msgflow.errors import UsageError
from msgflow.files.atomic import replacing
from msgflow.sql.quoting import literal
from msgflow.version import __version__

# Versions of msgflow that alternate on one machine each keep theirs.
_MOST_KEPT = 10


def write_empty(path: Path) -> None:
    """Write an empty database to `path`, which does not exist yet."""
    content = _cached()
    if content is not None:
        path.write_bytes(content)
        return
    with contextlib.closing(open_file(path, read_only=False)) as con:
        scripts = (
            store_file().read_text(encoding="utf-8"),
            # As Alembic makes it.
            "CREATE TABLE store.alembic_version (version_num VARCHAR(32) NOT NULL, "
            "CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num))",
            f"INSERT INTO store.alembic_version VALUES ({literal(objects.head_revision())})",
        )
        with transaction(con):
            for script in scripts:
                # One by one: what looks at a statement before it runs, such as EXPLAIN, sees it.
                for statement in con.extract_statements(script):
                    con.execute(statement)
            objects.apply(con)
        con.execute("CHECKPOINT")  # closing would fail silently, and leave a log behind
    _cache(path.read_bytes())


def _cached() -> bytes | None:
    """Return the empty database in the cache, None if it is missing or damaged."""
    try:
        digest, content = _cache_file().read_bytes().split(b"\n", 1)
    except (OSError, ValueError, RuntimeError):  # the last: there is no home directory
        return None
    return content if hashlib.sha256(content).hexdigest().encode() == digest else None


def _cache(content: bytes) -> None:
    """Keep an empty database in the cache, if possible."""
    with contextlib.suppress(OSError, RuntimeError, UsageError):
        path = _cache_file()
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as aside:
            aside.write_bytes(hashlib.sha256(content).hexdigest().encode() + b"\n" + content)
        kept = sorted(path.parent.iterdir(), key=lambda each: each.stat().st_mtime)
        for old in kept[:-_MOST_KEPT]:
            old.unlink()


def _cache_file() -> Path:
    given = os.environ.get("XDG_CACHE_HOME")
    root = Path(given) if given and os.path.isabs(given) else Path("~/.cache").expanduser()
    made_as = (STORAGE_VERSION, str(BLOCK_BYTES))
    made_by = (__version__, objects.head_revision(), objects.definition_hash(), *made_as)
    key = hashlib.sha256("\0".join(made_by).encode()).hexdigest()[:32]
    return root / "msgflow" / f"database-{duckdb.__version__}-{key}"
