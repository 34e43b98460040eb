"""Files that commands write: what may stand at their place, and what then happens to it."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from typer.testing import CliRunner

from msgflow.cli.app import app
from msgflow.errors import UsageError
from msgflow.files.atomic import replacing
from msgflow.files.atomic_directory import replacing_entries


def write(path: Path, text: str = "new") -> None:
    with replacing(path) as temporary:
        temporary.write_text(text)


def test_a_link_is_followed(tmp_path: Path) -> None:
    target = tmp_path / "elsewhere" / "data.csv"
    target.parent.mkdir()
    target.write_text("old")
    link, dangling = tmp_path / "link.csv", tmp_path / "dangling.csv"
    link.symlink_to(target)
    dangling.symlink_to(target.with_name("other.csv"))
    write(link)
    write(dangling)
    assert link.is_symlink()
    assert dangling.is_symlink()
    assert target.read_text() == "new"
    assert target.with_name("other.csv").read_text() == "new"
    assert sorted(os.listdir(tmp_path)) == ["dangling.csv", "elsewhere", "link.csv"]


def test_a_link_in_a_circle_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "circle").symlink_to(tmp_path / "circle")
    with pytest.raises(UsageError, match="cannot write the file"):
        write(tmp_path / "circle")
    assert (tmp_path / "circle").is_symlink()


def test_a_pipe_gets_what_is_complete(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    found: list[str] = []
    reader = threading.Thread(target=lambda: found.append(pipe.read_text()))
    reader.start()
    write(pipe, "rows")
    reader.join(10)
    assert found == ["rows"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_nothing_is_written_to_a_pipe_after_an_error(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(UsageError, match="cannot write"), replacing(pipe) as temporary:
        (temporary / "x").write_text("half")
    assert stat.S_ISFIFO(pipe.stat().st_mode)


@pytest.mark.parametrize("command", [["sql", "SELECT 1"], ["graph", "--format", "json"]])
def test_a_device_stays_one(small_database: Path, tmp_path: Path, command: list[str]) -> None:
    null = tmp_path / "null"
    try:
        os.mknod(null, stat.S_IFCHR | 0o666, os.makedev(1, 3))
    except PermissionError:
        pytest.skip("only root makes devices")
    words = [*command, "--db", str(small_database), "-o", str(null)]
    assert CliRunner().invoke(app, words).exit_code == 0
    assert stat.S_ISCHR(null.stat().st_mode)


def test_stdout_by_its_name(small_database: Path, tmp_path: Path) -> None:
    link = tmp_path / "stdout"
    link.symlink_to("/proc/self/fd/1")
    command = [sys.executable, "-m", "msgflow", "sql", "SELECT 7 AS x", "--format", "csv"]
    command += ["--db", str(small_database), "-o", str(link)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == '"x"\n7\n'
    with (tmp_path / "rows").open("w") as file:
        file.write("before\n")
        file.flush()
        subprocess.run(command, stdout=file, check=True)
        file.seek(0, os.SEEK_END)
        file.write("after\n")
    assert (tmp_path / "rows").read_text() == 'before\n"x"\n7\nafter\n'
    assert link.is_symlink()


def test_entries_of_a_directory_replace_no_link(tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("mine")
    (tmp_path / "a.csv").symlink_to(tmp_path / "mine")
    for force in (False, True):
        with (
            pytest.raises(UsageError, match=r"exists already|a link, pipe or device"),
            replacing_entries(tmp_path, ["a.csv"], force=force) as aside,
        ):
            (aside / "a.csv").write_text("new")
    assert (tmp_path / "a.csv").is_symlink()
    assert (tmp_path / "mine").read_text() == "mine"


def test_a_file_is_replaced_with_stdout_closed_and_keeps_its_mode(
    small_database: Path, tmp_path: Path
) -> None:
    file = tmp_path / "rows.csv"
    file.write_text("old")
    file.chmod(0o640)
    command = [sys.executable, "-m", "msgflow", "sql", "SELECT 7 AS x"]
    command += ["--db", str(small_database), "-o", str(file)]
    closing = ["sh", "-c", 'exec "$@" >&-', "sh"]
    subprocess.run([*closing, *command], check=True)
    assert file.read_text() == '"x"\n7\n'
    assert stat.S_IMODE(file.stat().st_mode) == 0o640
