"""The child process that ingests one recording: `python -m msgflow.fleet.child_process DIRECTORY`.

It reads its task from stdin, and ends as soon as its parent closes that. It writes its stage and
its outcome into files of the directory, which the parent removes.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
import shutil
import sys
import threading
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from msgflow.database import Database
from msgflow.db.connection import connect
from msgflow.errors import DatabaseError, MsgflowError, TraceError, UsageError
from msgflow.fleet.file_store import S3
from msgflow.fleet.lake import Lake
from msgflow.fleet.part import write_part
from msgflow.fleet.sources import fetch, look_at
from msgflow.fleet.task import RESULT, STAGE, Outcome, Reason, Task, is_disk_full, without_secrets

_ORPHAN = 1


def main() -> None:
    """Do the task on stdin."""
    directory = Path(sys.argv[1])
    text = sys.stdin.readline()
    threading.Thread(target=_end_with_parent, daemon=True).start()
    outcome = do(Task(**json.loads(text)), directory)
    (directory / RESULT).write_text(json.dumps(asdict(outcome)), encoding="utf-8")


def _end_with_parent() -> None:
    with contextlib.suppress(OSError, ValueError):
        os.read(0, 1)
    os._exit(_ORPHAN)


def do(task: Task, directory: Path) -> Outcome:
    """Fetch, ingest, check and write one recording; commit nothing."""
    stage = ""

    def enter(name: str) -> None:
        nonlocal stage
        stage = name
        # The parent reads it when this process hangs or has gone.
        (directory / STAGE).write_text(name, encoding="utf-8")

    try:
        values = _values(task, directory, enter)
        return Outcome(values=values, signature=values["source_signature"])
    except Exception as error:
        return failed_outcome(error, stage)


def _values(task: Task, directory: Path, enter: Callable[[str], None]) -> dict[str, Any]:
    enter("looking at the source")
    before = look_at(task.source)
    if (free := shutil.disk_usage(directory).free) < task.needed_disk:
        words = f"some {task.needed_disk:,} bytes of scratch space are needed, {free:,} are free"
        raise OSError(errno.ENOSPC, words)
    path = Path(task.source)
    if task.source.startswith(S3):
        enter("fetching")
        (directory / "source").mkdir()
        path = fetch(task.source, directory / "source")
    enter("ingesting")
    database = directory / "msgflow.duckdb"
    with Database(database) as opened:
        opened.ingest(path, **task.ingest)
    if task.source.startswith(S3):
        _rename_paths(database, f"{directory / 'source'}/", f"{task.source.rpartition('/')[0]}/")
    enter("looking at the source again")
    if look_at(task.source) != before:
        raise ChangedError(
            f"the recording changed while it was read — {task.source}",
            "ingest it again when it is complete",
        )
    enter("opening the lake")
    lake = Lake.open(task.lake)
    enter("writing")
    limit = f"{task.memory}B" if task.memory else None
    with Database(database, memory_limit=limit) as opened:
        part = write_part(
            opened.connection, database, lake.store, directory, database=task.database
        )
    return {
        **part,
        "source": task.source,
        "source_signature": before.signature,
        "source_bytes": before.size,
        "options": json.dumps(task.ingest, sort_keys=True),
    }


class ChangedError(MsgflowError):
    """The source changed during the ingest."""


def _rename_paths(database: Path, before: str, after: str) -> None:
    """Replace the path of the local copy by the address of the source in all texts."""
    with contextlib.closing(connect(database, read_only=False)) as con:
        columns = con.execute(
            "SELECT table_name, column_name FROM duckdb_columns() WHERE data_type = 'VARCHAR' "
            "AND schema_name = 'store' AND database_name = current_database()"
        ).fetchall()
        for table, column in columns:
            con.execute(
                f'UPDATE store."{table}" SET "{column}" = replace("{column}", $before, $after) '
                f'WHERE contains("{column}", $before)',
                {"before": before, "after": after},
            )


def failed_outcome(error: Exception, stage: str) -> Outcome:
    """Return the outcome of a recording at which an error was raised."""
    message = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
    hint = None
    if isinstance(error, MsgflowError):
        message, hint = error.message, error.hint
    reason = Reason.ERROR
    if isinstance(error, ChangedError):
        reason = Reason.CHANGED
    elif is_disk_full(error):
        reason = Reason.NO_SPACE
    elif isinstance(error, MemoryError) or re.search("(?i:out of memory)|more memory", message):
        reason = Reason.TOO_LARGE
        hint = "give its worker more memory"
    elif isinstance(error, TraceError | UsageError):
        reason = Reason.BROKEN
    elif isinstance(error, DatabaseError) and "the store" in message:
        reason = Reason.UNREACHABLE
    return Outcome(reason, stage, without_secrets(message), hint and without_secrets(hint))


if __name__ == "__main__":
    main()
