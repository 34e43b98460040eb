"""Files can be read with DuckDB's own settings, where few expected rows are compared with all."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import duckdb
import pytest

ROWS = 100_000
FILL = (
    "INSERT INTO store.executor_thread BY NAME "
    "SELECT 1 AS run_id, 1 + n % 4 AS executor_id, n AS thread_id FROM range(20) AS r(n)",
    "INSERT INTO store.callback_instance BY NAME SELECT n AS callback_instance_id, 1 AS run_id, "
    "1 AS trace_id, n % 30 AS callback_id, 1 AS process_id, n % 20 AS thread_id, n AS start_ns, "
    f"n AS end_ns, n AS take_id, 1 AS depth FROM range({ROWS}) AS r(n)",
    "INSERT INTO store.executor_state BY NAME SELECT 1 AS run_id, n % 20 AS thread_id, "
    f"'wait' AS state, n AS start_ns, n AS start_event_id FROM range({ROWS}) AS r(n)",
)


@pytest.fixture(scope="module")
def filled(simulated: Callable[..., Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    # Of tables without rows, DuckDB expects no row of anything.
    path = tmp_path_factory.mktemp("filled") / "filled.duckdb"
    shutil.copyfile(simulated("demo", 0.1), path)
    with duckdb.connect(str(path)) as con:
        for statement in FILL:
            con.execute(statement)
    return path


def nodes(plan: dict[str, Any]) -> Iterator[dict[str, Any]]:
    yield plan
    for child in plan["children"]:
        yield from nodes(child)


@pytest.mark.parametrize(
    "rows",
    [
        "main.executor_wait",
        "main.executor_interference",
        "main.executor_wait_explained([1])",
        "main.critical_path([1])",
    ],
)
def test_waits_are_found_in_order(rows: str, filled: Path) -> None:
    """Every callback instance compared with every wait of its executor takes minutes."""
    with duckdb.connect(str(filled), read_only=True) as con:
        explain = f"EXPLAIN (FORMAT json) FROM {rows}"
        (plan,) = json.loads(con.execute(explain).fetchall()[0][1])
    joins = [
        node["name"]
        for node in nodes(plan)
        if "picked_ns" in json.dumps(node["extra_info"]) and "JOIN" in node["name"].upper()
    ]
    assert joins
    assert not [name for name in joins if "ASOF" not in name.upper()]
