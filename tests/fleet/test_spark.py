"""Spark reads a lake by the lines of docs/fleet.md, and finds what DuckDB finds."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import duckdb
import pytest

from msgflow.fleet.lake import Lake

pytest.importorskip("pyspark", reason="pyspark is not installed")
pytestmark = pytest.mark.skipif(shutil.which("java") is None, reason="there is no Java")

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "fleet.md").read_text(encoding="utf-8")
(LINES,) = (
    block for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "spark.read" in block
)
CREATE_RUN, _ = next(
    block.split("\n\n") for block in re.findall(r"```sql\n(.*?)```", PAGE, re.DOTALL)
)


def test_spark_finds_what_duckdb_finds(night: Lake) -> None:
    from pyspark.sql import SparkSession

    # One that no longer counts.
    (first, *_) = night.runs().to_pylist()
    night.commit([{**first, "generation": 0, "part": "gone"}])
    spark = (
        SparkSession.builder.master("local[1]")
        .config("spark.ui.enabled", "false")
        .config("spark.sql.shuffle.partitions", "1")
        .getOrCreate()
    )
    try:
        given: dict[str, Any] = {"spark": spark}
        exec(LINES.replace("LAKE", night.store.url), given)
        rows = given["flow"].groupBy("path").count().orderBy("path").collect()
        labels = given["run"].selectExpr("labels['robot'] AS robot").orderBy("robot").collect()
    finally:
        spark.stop()
    with duckdb.connect() as con:
        con.execute(CREATE_RUN.replace("LAKE", night.store.url))
        expected = con.execute(
            "SELECT path, count(*) FROM"
            f" read_parquet('{night.store.url}/flow/*/*.parquet', hive_partitioning = true)"
            " JOIN run USING (run, part) GROUP BY path ORDER BY path"
        ).fetchall()
    assert [tuple(row) for row in rows] == expected
    assert len(labels) == 3
