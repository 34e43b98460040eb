"""Runs of a database: added, refused, replaced, named; one says nothing about another."""

from __future__ import annotations

import os
import shutil
import threading
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.ingested import contents, rows

from msgflow.errors import ExitCode, UsageError
from msgflow.ingest import ingest
from msgflow.schema import store

RUNS = "SELECT run_id, name FROM run ORDER BY run_id"


def of_run(database: Path, run_id: int) -> dict[str, list[tuple[Any, ...]]]:
    """Rows of a run, its ids counted from 1 as in a database of its own."""
    result = {}
    with duckdb.connect(str(database), read_only=True) as connection:
        for table in store.tables.values():
            if "run_id" not in table.columns or table.name == "run":
                continue
            columns = []
            for column in table.columns:
                if column.name == "root_id":  # of the table that its kind names
                    columns.append(
                        "root_id - CASE root_kind WHEN 'publication' THEN "
                        "(SELECT min(publication_id) FROM store.publication WHERE run_id = $run) "
                        "ELSE (SELECT min(callback_instance_id) FROM store.callback_instance "
                        "WHERE run_id = $run) END + 1"
                    )
                    continue
                # Some have no foreign key: ids below 0 stand for what is not traced.
                own = store.tables.get(f"store.{column.name.removesuffix('_id')}")
                keys = [each.column for each in column.foreign_keys]
                key = next(iter(keys), column if own is None else own.columns.get(column.name))
                key = column if key is None else key
                base = ""
                if column.name != "run_id" and key.name == f"{key.table.name}_id":
                    first = f"SELECT min({key.name}) FROM {key.table.fullname} WHERE run_id = $run"
                    base = f" - ({first}) + 1"
                columns.append(f"{column.name}{base}" if column.name != "run_id" else "1")
            result[table.name] = connection.execute(
                f"SELECT {', '.join(columns)} FROM {table.fullname} WHERE run_id = $run "
                "ORDER BY ALL",
                {"run": run_id},
            ).fetchall()
    return result


@pytest.mark.thorough
def test_a_second_run_has_the_ids_of_the_first_continued(
    database: Path, both: Path, new_database: Path, other_trace: Path
) -> None:
    """And the same rows as in an empty database; those of the first run stay."""
    report = ingest([other_trace], new_database)
    assert (report.run_id, report.run_name) == (1, "pair")
    assert rows(both, RUNS) == [(1, "robot"), (2, "pair")]
    assert of_run(both, 1) == of_run(database, 1)
    assert of_run(both, 2) == of_run(new_database, 1)
    assert rows(both, "SELECT max(publication_id) = count(*) FROM publication") == [(True,)]


@pytest.mark.thorough
def test_the_same_trace_gives_the_same_rows_in_another_database(
    database: Path, new_database: Path, trace: Path
) -> None:
    """Ids too; only the moment of the ingest differs.

    In any thread, where no signals arrive, and no handler can be installed.
    """
    worker = threading.Thread(target=ingest, args=([trace], new_database))
    worker.start()
    worker.join()
    assert os.listdir(new_database.parent) == [new_database.name]
    first, second = contents(database), contents(new_database)
    first.pop("run")
    second.pop("run")
    assert second == first


def test_the_same_packets_are_refused(database: Path, trace: Path, tmp_path: Path) -> None:
    """Also from a copy elsewhere, and under another name."""
    before = contents(database)
    copy = tmp_path / "copy"
    shutil.copytree(trace, copy)
    for path, name in ((trace, None), (copy, "another")):
        with pytest.raises(UsageError, match=r"already — run robot \(1\)") as raised:
            ingest([path], database, name=name)
        assert raised.value.exit_code == ExitCode.USAGE
        assert "--replace" in (raised.value.hint or "")
    assert contents(database) == before


def test_a_replacement_keeps_other_runs(both: Path, trace: Path) -> None:
    before, other = of_run(both, 1), of_run(both, 2)
    report = ingest([trace], both, replace=True)
    assert rows(both, RUNS) == [(2, "pair"), (3, "robot")]
    assert (report.run_id, report.run_name) == (3, "robot")
    assert of_run(both, 2) == other
    assert of_run(both, 3) == before
    assert not any(of_run(both, 1).values())


@pytest.mark.thorough
def test_one_ingest_may_replace_several_runs(both: Path, trace: Path, other_trace: Path) -> None:
    ingest([trace, other_trace], both, replace=True, name="both")
    assert rows(both, RUNS) == [(3, "both")]
    assert rows(both, "SELECT count(*) FROM trace") == [(3,)]


@pytest.mark.thorough
def test_names_given_must_be_free(database: Path, trace: Path, other_trace: Path) -> None:
    """Unless the run of that name is to be replaced."""
    before = contents(database)
    with pytest.raises(UsageError, match="name already — robot") as raised:
        ingest([other_trace], database, name="robot")
    assert "--replace" in (raised.value.hint or "")
    assert contents(database) == before
    ingest([other_trace], database, name="robot", replace=True)
    assert rows(database, RUNS) == [(2, "robot")]
    assert rows(database, "SELECT count(*) FROM trace") == [(2,)]


@pytest.mark.thorough
def test_names_not_given_are_made_free(database: Path, other_trace: Path, tmp_path: Path) -> None:
    shutil.copytree(other_trace, tmp_path / "robot")
    assert ingest([tmp_path / "robot"], database).run_name == "robot-2"
