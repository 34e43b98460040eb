"""Spark reads a lake by the lines of docs/fleet.md, and finds what DuckDB finds."""

from __future__ import annotations

import re
import shutil
from typing import Any

import pytest
from support.lakes import PAGE, read

from msgflow.fleet.lake import Lake

pytest.importorskip("pyspark", reason="pyspark is not installed")
pytestmark = pytest.mark.skipif(shutil.which("java") is None, reason="there is no Java")

(LINES,) = (
    block for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "spark.read" in block
)


def test_spark_finds_what_duckdb_finds(night: Lake) -> None:
    from pyspark.sql import SparkSession

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
    expected = read(
        night,
        "SELECT path, count(*) FROM read_parquet('LAKE/flow/*.parquet')"
        " JOIN run USING (run, part) GROUP BY path ORDER BY path",
    )
    assert [tuple(row) for row in rows] == expected
    assert len(labels) == 3
