"""Flows are followed along edges that are looked for once, also in a database opened again."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from msgflow.db.connection import connect


def nodes(plan: dict[str, Any]) -> Iterator[dict[str, Any]]:
    yield plan
    for child in plan["children"]:
        yield from nodes(child)


@pytest.mark.parametrize("direction", ["forward", "backward", "both", "component"])
@pytest.mark.parametrize("limit", ["", ", max_depth := 1000"])
def test_no_table_is_read_at_every_step(empty_database: Path, direction: str, limit: str) -> None:
    con = connect(empty_database, read_only=True)
    explain = f"EXPLAIN (FORMAT json) SELECT * FROM flow_{direction}('publication', 1{limit})"
    (plan,) = json.loads(con.execute(explain).fetchall()[0][1])
    con.close()
    steps = [
        node["children"][1]
        for node in nodes(plan)
        if node["name"] in ("REC_CTE", "RECURSIVE_CTE", "REC_KEY_CTE")
    ]
    assert steps
    read = [node["extra_info"].get("Table") for step in steps for node in nodes(step)]
    assert [name for name in read if name is not None] == []


@pytest.mark.parametrize(
    ("arguments", "most"),
    [
        ("[1]", 32_000),
        ("[1, 2]", 64_000),
        ("[1], max_depth := 3, max_paths := 5", 15),
        ("[1], max_paths := 2147483647", 2147483647 * 32),
    ],
)
def test_chains_are_no_more_than_their_limits(
    empty_database: Path, arguments: str, most: int
) -> None:
    """Else DuckDB keeps tables of all takes for a few roots, and needs twice the memory."""
    con = connect(empty_database, read_only=True)
    chains = arguments.replace("[1]", "[1], NULL, NULL").replace("[1, 2]", "[1, 2], NULL, NULL")
    explain = f"EXPLAIN (FORMAT json) SELECT path_id FROM main.flow_chain({chains})"
    (plan,) = json.loads(con.execute(explain).fetchall()[0][1])
    con.close()
    (limit,) = [node["extra_info"] for node in nodes(plan) if "LIMIT" in node["name"].upper()]
    assert int(limit["Limit"]) == most
    assert int(limit["Estimated Cardinality"]) <= most
