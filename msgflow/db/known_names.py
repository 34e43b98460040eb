"""Names in a database, for completion in a shell: few, quick and silent.

A shell asks again at every key. Hence this checks no schema and reports no error. A database that
cannot be read has no names.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from threading import Timer

from msgflow.errors import DatabaseError

MOST_NAMES = 1_000
_SECONDS = 1.0
_TOPICS = "SELECT topic_name FROM main.publisher UNION SELECT topic_name FROM main.subscription"
_NODES = "SELECT full_name FROM main.node"
_SERVICES = "SELECT service_name FROM main.service WHERE NOT is_internal"
_SOURCES = {
    "run": "SELECT name FROM main.run",
    "topic": _TOPICS,
    "node": _NODES,
    "callback": "SELECT label FROM main.callback_label",
    "host": "SELECT hostname FROM main.host",
    "place": f"{_TOPICS} UNION {_NODES} UNION {_SERVICES}",
    "view": "SELECT view_name FROM duckdb_views() WHERE schema_name = 'main' AND NOT internal"
    " AND database_name = current_database()",
}
_NAMES = """
SELECT DISTINCT name::VARCHAR
FROM ({source}) AS named (name)
WHERE starts_with(name, $prefix) AND EXISTS (FROM store.alembic_version)
ORDER BY 1
LIMIT {most}
"""


def known_names(path: Path, kind: str, prefix: str) -> Sequence[str]:
    """Return the names in a database that begin with `prefix`, sorted, at most 1000.

    `kind` is 'run', 'topic', 'node', 'callback', 'host', 'view', or 'place' for topics, nodes and
    services. A file that is missing, in use, damaged or foreign has no names.
    """
    import duckdb

    from msgflow.db.sandbox import open_file

    try:
        connection = open_file(path, read_only=True)
        # Views of a foreign file could run for ever.
        timer = Timer(_SECONDS, connection.interrupt)
        timer.daemon = True
        timer.start()
        try:
            sql = _NAMES.format(source=_SOURCES[kind], most=MOST_NAMES)
            return [name for (name,) in connection.execute(sql, {"prefix": prefix}).fetchall()]
        finally:
            timer.cancel()
            connection.close()
            # A timer that outlives the program makes DuckDB's binding write to stderr.
            timer.join()
    except (duckdb.Error, DatabaseError):
        return ()
