"""`msgflow export series`: files that other programs plot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pyarrow.csv
import pyarrow.parquet
import pytest
from typer.testing import Result

from msgflow.database import open_db

Msgflow = Callable[..., Result]


@pytest.fixture
def fan_out(simulated: Callable[..., Path]) -> Path:
    return simulated("fan_out", 0.1)


def test_files_have_seconds_from_the_start_of_the_run(
    msgflow: Msgflow, fan_out: Path, tmp_path: Path
) -> None:
    with open_db(fan_out) as database:
        whole = database.series("topics").to_arrow()
        ((start,),) = database.connection.execute("SELECT start_ns FROM run").fetchall()
    for name in ("a.csv", "a.parquet"):
        result = msgflow(
            "export", "series", "-o", tmp_path / name, "--what", "topics", "--db", fan_out
        )
        assert (result.exit_code, result.stdout) == (0, "")
    csv = pyarrow.csv.read_csv(tmp_path / "a.csv")
    parquet = pyarrow.parquet.read_table(tmp_path / "a.parquet")
    assert csv.column_names == parquet.column_names == ["at_s", *whole.column_names[1:]]
    expected = [(time - start) / 1e9 for time in whole["at_ns"].to_pylist()]
    assert parquet["at_s"].to_pylist() == expected
    assert csv["at_s"].to_pylist() == pytest.approx(expected)
    msgflow("export", "series", "-o", tmp_path / "b.csv", "--times", "ns", "--db", fan_out)
    assert pyarrow.csv.read_csv(tmp_path / "b.csv").column_names[0] == "at_ns"


def test_other_files_and_words_are_refused(msgflow: Msgflow, fan_out: Path, tmp_path: Path) -> None:
    for name in ("a.xlsx", "a.json", "a"):
        result = msgflow("export", "series", "-o", tmp_path / name, "--db", fan_out)
        assert result.exit_code == 2
        assert not (tmp_path / name).exists()
