from __future__ import annotations

import sys
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from msgflow.errors import UsageError
from msgflow.result.query_result import QueryResult
from msgflow.sql.header import parse
from msgflow.version import __version__

BIG = 2**63 - 1
HEADER = parse(
    "-- description: x\n-- column: at_ns BIGINT [epoch ns]  When\n"
    "-- column: topic VARCHAR  Topic\nSELECT 1\n",
    Path("example.sql"),
)


@pytest.fixture
def result() -> QueryResult:
    table = pa.table({"at_ns": pa.array([BIG, None], pa.int64()), "topic": ["/a", None]})
    return QueryResult(table, HEADER)


def test_it_knows_its_columns_and_units(result: QueryResult) -> None:
    assert len(result) == 2
    assert result.columns == ("at_ns", "topic")
    assert result.units == {"at_ns": "epoch ns"}
    assert QueryResult(result.table).units == {}


def test_pandas_keeps_nanoseconds_beside_missing_values(result: QueryResult) -> None:
    pytest.importorskip("pandas")
    frame = result.to_pandas()
    assert int(frame["at_ns"][0]) == BIG
    assert frame["at_ns"].isna().tolist() == [False, True]


def test_polars(result: QueryResult) -> None:
    pytest.importorskip("polars")
    assert result.to_polars().to_dicts() == [
        {"at_ns": BIG, "topic": "/a"},
        {"at_ns": None, "topic": None},
    ]


@pytest.mark.parametrize("package", ["pandas", "polars"])
def test_a_missing_package_is_named(
    result: QueryResult, package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(UsageError) as raised:
        getattr(result, f"to_{package}")()
    assert raised.value.message == f"{package} is not installed"
    assert raised.value.hint == f"pip install {package}"


def test_parquet_says_what_it_is(result: QueryResult, tmp_path: Path) -> None:
    path = result.to_parquet(tmp_path / "rows.parquet")
    read = pq.read_table(path)
    assert read.to_pylist() == result.table.to_pylist()
    assert read.schema.metadata[b"msgflow.query"] == b"example"
    assert read.schema.metadata[b"msgflow.version"] == __version__.encode()
    assert [child.name for child in tmp_path.iterdir()] == ["rows.parquet"]


def test_a_file_that_cannot_be_written_is_named(result: QueryResult, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no such file or directory"):
        result.to_parquet(tmp_path / "missing" / "rows.parquet")
