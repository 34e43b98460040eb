"""Files of clocks that are no such files: one line says so, at once."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from msgflow.clocks.clocks_file import read_clock_sync
from msgflow.errors import UsageError
from msgflow.files.text_file import MOST_BYTES
from msgflow.links.links_file import read_links
from msgflow.run.choice import choose_runs
from msgflow.run.window import time_point

MANY = 20_000


@pytest.mark.parametrize(
    ("suffix", "text", "message"),
    [
        (".yaml", "a: " + "9" * 5000, "line 1: offset_ns is beyond what clocks have — 9{60}…"),
        (".yaml", "a: 1__0", "line 1: offset_ns is not a whole number — 1__0"),
        (".yaml", "a: 1_", "line 1: offset_ns is not a whole number — 1_"),
        (".yaml", "a: ١٢", "line 1: offset_ns is not a whole number"),
        (".yaml", "a: " + "x" * 5000, "offset_ns is not a whole number — x{60}…"),
        (".yaml", "a: " + "{b: " * 3000 + "}" * 3000, "not a YAML file"),
        (".yaml", "\0", "not a YAML file|control characters|special characters"),
        (".toml", "a = " + "9" * 5000, "not a TOML file of clocks"),
        (".toml", "a = " + "9" * 4000, "line 1: offset_ns is beyond what clocks have"),
        (".toml", "a = 0x" + "f" * 50_000, "line 1: offset_ns is beyond what clocks have"),
        (".toml", "a = " + "[" * 3000 + "]" * 3000, "not a TOML file of clocks"),
        (".toml", "x = 1\n\n[b]\noffset_ns = true", "line 4: offset_ns is not a whole number"),
    ],
)
def test_each_is_refused_with_its_line(
    tmp_path: Path, suffix: str, text: str, message: str
) -> None:
    path = tmp_path / f"clocks{suffix}"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(UsageError, match=message):
        read_clock_sync(path)


def test_the_lines_of_a_long_file_are_found(tmp_path: Path) -> None:
    path = tmp_path / "clocks.toml"
    path.write_text("".join(f"[h{n}]\noffset_ns = {n}\n" for n in range(MANY)), encoding="utf-8")
    clocks = read_clock_sync(path).clocks
    assert [clock.line for clock in clocks] == list(range(1, 2 * MANY, 2))
    assert [clock.offset_ns for clock in clocks] == list(range(MANY))


@pytest.mark.parametrize("read", [read_links, read_clock_sync])
def test_only_regular_files_of_some_size_are_read(tmp_path: Path, read: object) -> None:
    assert callable(read)
    pipe, large = tmp_path / "pipe.yaml", tmp_path / "large.yaml"
    os.mkfifo(pipe)
    with large.open("wb") as file:
        file.truncate(1 << 40)
    for path, message in (
        (pipe, "a pipe, no file"),
        (Path("/dev/zero"), "a device, no file"),
        (tmp_path, "a directory, no file"),
        (large, f"more than the {MOST_BYTES:,} that make sense"),
    ):
        with pytest.raises(UsageError, match=message):
            read(path)


def test_numbers_beyond_any_id_or_time_are_refused() -> None:
    from msgflow.run.choice import Run

    runs = (Run(1, "robot", 0),)
    for text in ("9" * 5000, str(2**63), str(-(2**63) - 1)):
        with pytest.raises(UsageError, match="there is no such run"):
            choose_runs(runs, text)
        with pytest.raises(UsageError):
            time_point(text, runs, "--start")
    with pytest.raises(UsageError, match="cannot read the time"):
        time_point("9" * 5000 + "s", runs, "--start")
