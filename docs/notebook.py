"""Writes docs/notebook.ipynb: runs its cells, and keeps what they show.

    python docs/notebook.py [FILE.ipynb]

It takes nbclient, ipykernel, pandas, polars and matplotlib, which the dependency group `dev` has.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).parent / "notebook.ipynb"
# A text is a cell of words, a text in a list one of code.
CELLS: list[str | list[str]] = [
    """# msgflow in a notebook

A small robot, simulated for two seconds: camera, lidar and IMU to motor commands, on two hosts.
With a recording of your own, begin with `msgflow ingest TRACE` and `open_db("msgflow.duckdb")`.

This file is written by `python docs/notebook.py`, which runs it.""",
    [
        """%matplotlib inline
from tempfile import mkdtemp

import msgflow
from msgflow_sim import simulate

robot = mkdtemp()  # a new one, so that the cells run as often as you like
simulate("demo", f"{robot}/trace", factor=0.2)
db = msgflow.open_db(f"{robot}/robot.duckdb")
db.ingest(f"{robot}/trace", clock_sync="messages")
db.query("info-hosts")"""
    ],
    """## A query is a table

The first rows show; `to_arrow`, `to_pandas` and `to_polars` have all of them, in nanoseconds.""",
    ['db.query("topics-latency")'],
    """## One message""",
    ['db.flow("/camera/image", at="0.3s")'],
    """## Who sends what to whom""",
    ["db.graph()"],
    """## pandas

Latency of the longest path over time: `flows` has a row per flow.""",
    [
        """flows = db.query("flows").with_times("relative").to_pandas()
path = max(flows["path"], key=lambda name: name.count("→"))
latency = flows[flows["path"] == path].set_index("root_s")["latency_s"].dropna().astype(float) * 1e3
axes = latency.plot(style=".", figsize=(8, 3), ylabel="ms", title="end to end")
latency.rolling(10).median().plot(ax=axes, xlabel="s");"""
    ],
    """## polars

What each hop of it consists of, on average.""",
    [
        """import polars as pl

parts = db.query("path-breakdown").to_polars().filter(pl.col("path") == path)
parts = parts.filter(pl.col("mean_ns") > 100_000).with_columns(ms=pl.col("mean_ns") / 1e6)
names = parts.select(pl.format("{} {}  {}", "hop", "part", "what")).to_series()

import matplotlib.pyplot as plt
plt.figure(figsize=(8, 3)).gca().barh(names, parts["ms"])
plt.gca().invert_yaxis()
plt.xlabel("ms");"""
    ],
    """## DuckDB

The file is a DuckDB database: any client reads it with any SQL. Here for which callbacks
executors were busy with others, at most, in all.""",
    [
        """import duckdb

db.close()
con = duckdb.connect(f"{robot}/robot.duckdb", read_only=True)
waits = con.sql(\"\"\"
    SELECT node || ' ' || label AS callback, sum(busy_max_ns) / 1e6 AS ms
    FROM executor_wait JOIN callback_label USING (callback_id)
    GROUP BY ALL ORDER BY ms DESC LIMIT 6
\"\"\").df()
waits.plot.barh("callback", "ms", figsize=(8, 3)).invert_yaxis()"""
    ],
]


def written(path: Path) -> Any:
    """Run the cells twice in an empty directory and write the notebook; return it."""
    notebook = nbformat.v4.new_notebook()
    for place, cell in enumerate(CELLS):
        if isinstance(cell, str):
            made = nbformat.v4.new_markdown_cell(cell)
        else:
            made = nbformat.v4.new_code_cell(cell[0])
        made["id"] = f"cell-{place}"
        notebook.cells.append(made)
    with tempfile.TemporaryDirectory() as directory:
        client = NotebookClient(
            notebook,
            timeout=300,
            kernel_name="python3",
            resources={"metadata": {"path": directory}},
        )
        with client.setup_kernel():
            for is_last in (False, True):
                for place, cell in enumerate(notebook.cells):
                    client.execute_cell(cell, place, store_history=is_last)
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
    notebook.metadata = {"language_info": {"name": "python"}}
    nbformat.write(notebook, path)
    return notebook


if __name__ == "__main__":
    written(Path(sys.argv[1]) if len(sys.argv) > 1 else NOTEBOOK)
