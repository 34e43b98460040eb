"""Files of offsets: what they say, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pytest
from support.drifting_clocks import Clock, fill_clocks

from msgflow.clocks.clocks_file import read_clock_sync
from msgflow.clocks.correction import set_clocks
from msgflow.errors import UsageError


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "clocks.yaml"


@pytest.fixture
def three(connection: duckdb.DuckDBPyConnection) -> duckdb.DuckDBPyConnection:
    """Three clocks; host-3 has a container beside it."""
    connection.begin()
    fill_clocks(connection, [Clock(), Clock(), Clock()], [], 0)
    connection.execute(
        "INSERT INTO store.host (host_id, run_id, clock_id, hostname) VALUES (4, 1, 3, 'inside')"
    )
    return connection


def stored(connection: duckdb.DuckDBPyConnection) -> list[tuple[object, ...]]:
    return connection.execute(
        "SELECT offset_ns, drift_ppb, uncertainty_ns, reference_clock_id, method FROM main.clock "
        "ORDER BY clock_id"
    ).fetchall()


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("clocks.yaml", "host-2: {offset_ns: -7, drift_ppb: 20}\nuuid-3: 1_000\n"),
        ("clocks.toml", 'uuid-3 = 1_000\n["host-2"]\noffset_ns = -7\ndrift_ppb = 20\n'),
    ],
)
def test_hosts_and_clocks_are_corrected_to_the_one_left_out(
    three: duckdb.DuckDBPyConnection, tmp_path: Path, name: str, text: str
) -> None:
    path = tmp_path / name
    path.write_text(text)
    set_clocks(three, 1, read_clock_sync(path))
    assert stored(three) == [
        (0, 0, 0, 1, "none"),
        (-7, 20, None, 1, "file"),
        (1000, 0, None, 1, "file"),
    ]
    set_clocks(three, 1, read_clock_sync("none"))
    assert stored(three) == [(0, 0, None, None, "none")] * 3


def test_containers_of_one_clock_may_say_the_same(
    three: duckdb.DuckDBPyConnection, file: Path
) -> None:
    file.write_text("host-3: 5\ninside: 5\n")
    set_clocks(three, 1, read_clock_sync(file))
    assert [row[0] for row in stored(three)] == [0, 0, 5]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: the file names no clock"),
        ("[1, 2]", "line 1: the file is not a mapping from hosts to offsets"),
        ("host-2: 1\nrobot: 2", "line 2: the run has no host or clock of that name — robot"),
        ("host-2: 1.5", "line 1: offset_ns is not a whole number — 1.5"),
        ("host-2:\n", "line 1: offset_ns has no value"),
        ("host-2: [1]", "line 1: offset_ns is not a whole number — a sequence"),
        ("host-2:\n  drift_ppb: 1", "line 1: host-2 has no offset_ns"),
        ("host-2:\n  offset_ns: 1\n  drift: 1", "line 3: a clock has no drift"),
        ("host-2:\n  offset_ns: 1\n  offset_ns: 2", "line 3: offset_ns is given twice"),
        ("host-2: {offset_ns: 1, drift_ppb: 2000000}", "line 1: drift_ppb is beyond what clocks"),
        ("host-2: 99999999999999999999", "line 1: offset_ns is beyond what clocks have"),
        ("host-2: 1\nhost-3: {", "line 2: "),
        (
            "host-3: 5\n\ninside: 6",
            "line 3: inside and host-3 (line 1) have one clock, and are given different times",
        ),
    ],
)
def test_what_is_wrong_is_named_with_its_line(
    three: duckdb.DuckDBPyConnection, file: Path, text: str, message: str
) -> None:
    file.write_text(text)
    with pytest.raises(UsageError) as error:
        set_clocks(three, 1, read_clock_sync(file))
    assert error.value.message.startswith(f"{file}, {message}")


def test_a_name_of_two_clocks_is_no_name(three: duckdb.DuckDBPyConnection, file: Path) -> None:
    three.execute("UPDATE store.host SET hostname = 'robot' WHERE host_id < 3")
    file.write_text("robot: 1")
    with pytest.raises(UsageError, match="line 1: several hosts have that name") as error:
        set_clocks(three, 1, read_clock_sync(file))
    assert "uuid-1, uuid-2" in str(error.value.hint)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("host-2 = ", "line 1: "),
        ('host-2 = 1\n["robot"]\noffset_ns = 1\ndrift = 1\n', "line 4: a clock has no drift"),
        ("host-2 = 1\nhost-2 = 2", "line 2: "),
    ],
)
def test_toml_is_named_with_its_line_too(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "clocks.toml"
    path.write_text(text)
    with pytest.raises(UsageError) as error:
        read_clock_sync(path)
    assert error.value.message.startswith(f"{path}, {message}")


def test_a_file_that_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="neither none nor messages nor a file"):
        read_clock_sync(tmp_path / "nothing.yaml")
