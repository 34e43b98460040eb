"""Names of runs, and of the database itself."""

from __future__ import annotations

import os
from pathlib import Path

import duckdb
import pytest

from msgflow.errors import UsageError
from msgflow.ingest import ingest
from msgflow.ingest.stored_run import fallback_name


@pytest.mark.parametrize("name", ["all", "7", "-7", ""])
def test_a_name_that_means_something_else_is_refused(
    trace: Path, new_database: Path, name: str
) -> None:
    with pytest.raises(UsageError, match="takes for something else"):
        ingest([trace], new_database, name=name)
    assert os.listdir(new_database.parent) == []


def test_a_directory_of_such_a_name_gives_another(tmp_path: Path) -> None:
    # What a run is called where no name is given: the ingest of each would take longer.
    for name in ("all", "20260314"):
        assert fallback_name([tmp_path / name]) == f"run-{name}"


@pytest.mark.parametrize(
    "below",
    [
        "ust",
        "kernel",
        "ust/uid/1000/64-bit",
        "ust/pid/talker-7-20260314-120000",
        "ust/ust/uid",
        "archives/20260314T120000+0000-20260314T120001+0000-0/ust/uid/1000/64-bit",
    ],
)
def test_a_run_has_the_name_of_the_folder_of_its_session(tmp_path: Path, below: str) -> None:
    assert fallback_name([tmp_path / "night" / below]) == "night"
    assert fallback_name([tmp_path / "ust_of_night"]) == "ust_of_night"


def test_an_archive_of_half_a_session_has_the_name_of_its_folder(tmp_path: Path) -> None:
    archive = tmp_path / "night" / "ust.tar.gz"
    archive.parent.mkdir()
    archive.touch()
    assert fallback_name([archive]) == "night"


def test_no_path_is_not_the_current_directory(new_database: Path) -> None:
    with pytest.raises(UsageError, match="the path of a trace is empty"):
        ingest([""], new_database)


@pytest.mark.thorough
def test_a_link_that_leads_nowhere_yet_leads_to_the_new_database(
    trace: Path, new_database: Path, tmp_path: Path
) -> None:
    """It stays a link; a second ingest through it adds to the same database."""
    link = tmp_path / "links" / "msgflow.duckdb"
    link.parent.mkdir()
    link.symlink_to(new_database)
    ingest([trace], link)
    assert link.is_symlink()
    assert os.listdir(link.parent) == [link.name]
    assert os.listdir(new_database.parent) == [new_database.name]
    assert ingest([trace], link, replace=True).run_id == 2
    with duckdb.connect(str(new_database), read_only=True) as connection:
        assert connection.execute("SELECT run_id FROM run").fetchall() == [(2,)]
