"""The count of chains by which a search for paths is skipped: it is never too low."""

from __future__ import annotations

import random
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path

import duckdb
import pytest
from support.golden import fill

RUNS = 150
DEPTH, PATHS = 3, 6


@pytest.fixture(scope="module")
def connection(
    empty_database: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[duckdb.DuckDBPyConnection]:
    """Random graphs of hops, some with circles, each of a run of its own."""
    path = Path(shutil.copy(empty_database, tmp_path_factory.mktemp("chains") / "chains.duckdb"))
    random.seed(1)
    hops: set[tuple[object, ...]] = set()
    places: set[tuple[object, ...]] = set()
    for run in range(1, RUNS + 1):
        size = random.randint(1, 6)
        places |= {(run, run * 10 + place) for place in range(size)}
        hops.add((run, "", run * 10, run * 10, True, "[]"))
        for _ in range(random.randint(0, 18)):
            first, last = random.randrange(size), random.randrange(size)
            if first < last or random.random() < 0.1:
                place = run * 10 + last
                hops.add((run, run * 10 + first, place, place, False, "[]"))
    with duckdb.connect(str(path)) as opened:
        fill(
            opened,
            {
                "run": csv("run_id", [(run,) for run in range(1, RUNS + 1)]),
                "publisher": csv("run_id,publisher_id", places),
                "subscription": csv("run_id,subscription_id", places),
                "flow_hop": csv(
                    "run_id,from_subscription_id,publisher_id,subscription_id,is_source,route",
                    hops,
                ),
            },
        )
        yield opened


def csv(head: str, rows: Iterable[tuple[object, ...]]) -> str:
    return "\n".join([head, *(",".join(map(str, row)) for row in sorted(rows, key=str))]) + "\n"


def test_where_something_is_cut_there_may_be_too_many_chains(
    connection: duckdb.DuckDBPyConnection,
) -> None:
    cut = {
        run
        for (run,) in connection.execute(
            "SELECT DISTINCT run_id FROM main.flow_path("
            "range(1, ?), NULL, NULL, max_depth := ?, max_paths := ?) WHERE is_cut",
            [RUNS + 1, DEPTH, PATHS],
        ).fetchall()
    }
    many = {
        run
        for run in range(1, RUNS + 1)
        if connection.execute(
            "FROM derive.many_chains(?, max_depth := ?, max_paths := ?)", [run, DEPTH, PATHS]
        ).fetchall()
    }
    assert cut <= many
    assert len(cut) >= 10
    assert len(many) < RUNS // 2
