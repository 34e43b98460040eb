"""Databases in which every name is one that would be more than text on a page."""

from __future__ import annotations

import shutil
from pathlib import Path

import duckdb

HOSTILE = (
    "<img src=x onerror=hacked=1>",
    "</script><script>hacked=1</script>",
    '"><svg onload=hacked=1>',
    "javascript:hacked=1",
    "</title></style><style>*{display:none}</style>",
    "{{hacked=1}} ${hacked=1} %3Cscript%3E",
    "\u202eevil\u0000\x1b[31m\u2028",
    "https://evil.example/x.png",
)
_RENAMED = """
UPDATE store.{table} SET {column} = $names[1 + {key} % len($names)] || coalesce({column}, '')
"""


def renamed(source: Path, path: Path, names: tuple[str, ...]) -> Path:
    """Return a copy of a database in which every name is a hostile one."""
    shutil.copyfile(source, path)
    with duckdb.connect(str(path)) as connection:
        for table, column, key in (
            ("host", "hostname", "host_id"),
            ("process", "name", "process_id"),
            ("thread", "name", "thread_id"),
            ("node", "full_name", "length(coalesce(full_name, ''))"),
            ("publisher", "topic_name", "length(coalesce(topic_name, ''))"),
            ("subscription", "topic_name", "length(coalesce(topic_name, ''))"),
            ("service", "service_name", "length(coalesce(service_name, ''))"),
            ("client", "service_name", "length(coalesce(service_name, ''))"),
            ("callback", "symbol", "length(coalesce(symbol, ''))"),
            ("run", "name", "run_id"),
        ):
            sql = _RENAMED.format(table=table, column=column, key=key)
            connection.execute(sql, {"names": list(names)})
    return path
