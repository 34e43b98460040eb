"""Who has a file is said in errors."""

from __future__ import annotations

import contextlib
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from msgflow.db.workspace import lock_holder

HOLD = (
    "import fcntl, sys; file = open(sys.argv[1]); fcntl.{call}(file, fcntl.LOCK_{kind});"
    " print('held', flush=True); sys.stdin.read()"
)


@contextlib.contextmanager
def held(path: Path, *more: str, call: str = "flock", kind: str = "SH") -> Iterator[int]:
    command = [sys.executable, "-c", HOLD.format(call=call, kind=kind), str(path), *more]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"held\n"
        yield process.pid
        process.kill()


@pytest.mark.parametrize("call", ["flock", "lockf"])
def test_the_process_and_the_begin_of_its_command(tmp_path: Path, call: str) -> None:
    path, other = tmp_path / "file", tmp_path / "other"
    path.touch()
    other.touch()
    with held(path, call=call) as process:
        begin = f" (process {process}: "
        said = lock_holder(path)
        assert said.startswith(f"{begin}{sys.executable} -c 'import fcntl")
        assert said.endswith("…)")
        assert len(said) == len(begin) + 99 + len(")")
        assert lock_holder(other) == ""
    assert lock_holder(path) == ""


def test_a_file_that_is_gone_has_no_holder(tmp_path: Path) -> None:
    assert lock_holder(tmp_path / "none") == ""


def test_a_short_command_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.touch()
    (tmp_path / "hold.py").write_text(HOLD.format(call="flock", kind="EX"))
    command = ["python", "hold.py", path.name]
    with subprocess.Popen(
        command,
        executable=sys.executable,
        cwd=tmp_path,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"held\n"
        assert lock_holder(path) == f" (process {process.pid}: python hold.py file)"
        process.kill()
