"""`Database.why` on systems of golden cases."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import duckdb
import pytest
from golden import fill_case

import msgflow
from msgflow.errors import NoFlowError

SECOND = 1_000_000_000
CASES = Path(__file__).parent / "cases"
PATHS = {path.relative_to(CASES).as_posix(): path for path in CASES.glob("*/*.case")}


def why(database: Path, case: Path) -> msgflow.Explanation | None:
    with duckdb.connect(str(database)) as connection:
        fill_case(connection, case)
    with msgflow.open_db(database) as db, suppress(NoFlowError):
        return db.why(run=1)
    return None


def test_a_path_may_pass_services(fresh_database: Path) -> None:
    found = why(fresh_database, CASES / "critical-path" / "services.case")
    assert found is not None
    path = found.paths.table["path"][0].as_py()
    assert " → (/" in path
    assert set(found.slow_flow.table["path"].to_pylist()) <= {path, None}
    assert found.slow_flow.table["duration_ns"].to_pylist()


def test_a_blank_name_of_a_topic_stops_no_answer(fresh_database: Path) -> None:
    case = CASES / "critical-path" / "services.case"
    with duckdb.connect(str(fresh_database)) as connection:
        fill_case(connection, case)
        connection.execute("UPDATE store.publisher SET topic_name = ' '")
        connection.execute("UPDATE store.subscription SET topic_name = ' '")
    with msgflow.open_db(fresh_database) as db:
        found = db.why(run=1)
    (path,) = set(found.paths.table["path"].to_pylist())
    assert set(found.slow_flow.table["path"].to_pylist()) <= {path, None}
    assert found.slow_flow.table["duration_ns"].to_pylist()


@pytest.mark.thorough
@pytest.mark.parametrize("name", PATHS)
def test_every_system_is_explained_or_has_no_flow(name: str, fresh_database: Path) -> None:
    found = why(fresh_database, PATHS[name])
    if found is not None:
        assert None not in found.verdict.table["sentence"].to_pylist()


def slow_at_first(database: Path, case: Path, period_ns: int) -> None:
    """Three of the first four of twenty flows take 0.3 periods, the others a hundredth."""
    moments = [(n, n * period_ns, 300 if n in (1, 2, 4) else 10) for n in range(1, 21)]
    tables = {
        "node": ["node_id,full_name", "1,/a", "2,/b"],
        "publisher": ["publisher_id,node_id,topic_name", "1,1,/t"],
        "subscription": ["subscription_id,node_id,topic_name", "1,2,/t"],
        "publication": [
            "publication_id,publisher_id,start_ns",
            *(f"{n},1,{at}" for n, at, _ in moments),
        ],
        "take": [
            "take_id,subscription_id,taken_ns",
            *(f"{n},1,{at + latency * period_ns // 1000}" for n, at, latency in moments),
        ],
        "link_transport": [
            "publication_id,take_id,publisher_id,subscription_id,method",
            *(f"{n},{n},1,1,exact" for n, *_ in moments),
        ],
    }
    case.write_text(
        "".join(f"== {name}\n" + "\n".join(rows) + "\n" for name, rows in tables.items())
    )
    with duckdb.connect(str(database)) as connection:
        fill_case(connection, case)


def test_a_warm_up_behind_the_end_of_what_is_asked_for_stays(
    fresh_database: Path, tmp_path: Path
) -> None:
    """It ends with half a second."""
    slow_at_first(fresh_database, tmp_path / "slow_at_first.case", SECOND // 50)
    with msgflow.open_db(fresh_database) as db:
        assert [db.why(run=1, end=end).start for end in ("0.45s", "0.5s")] == [None, None]


def test_a_warm_up_stays_out_and_is_said(fresh_database: Path, tmp_path: Path) -> None:
    slow_at_first(fresh_database, tmp_path / "slow_at_first.case", SECOND)
    with msgflow.open_db(fresh_database) as db:
        warm, whole = db.why(run=1), db.why(run=1, start="0s")
    said = "without the first 4.5 s, a warm-up"
    assert [why.start for why in (warm, whole)] == ["4.5s", "0s"]
    assert [why.paths.table["max_ns"][0].as_py() for why in (warm, whole)] == [
        SECOND // 100,
        3 * SECOND // 10,
    ]
    assert [any(said in note for note in why.notes) for why in (warm, whole)] == [True, False]
    assert all("--start" in step for step in warm.steps if step[0] == "query")
