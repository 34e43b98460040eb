"""A recording that starts late attributes callbacks as the simulation had them, or says unknown."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.ingested import ingest_one
from support.thorough import few

from msgflow_sim import Recording, simulate
from msgflow_sim.entity import MILLISECOND

# (system, layout) -> true kinds of the callbacks that nothing decides.
CASES = {
    ("intra_process", "jazzy"): set(),
    ("intra_process", "humble"): set(),
    ("mixed_intra_process", "rolling"): set(),
    ("multi_threaded", "jazzy"): set(),
    ("nested", "jazzy"): set(),
    ("services", "rolling"): set(),
    ("services", "jazzy"): set(),
    # Loaned messages.
    ("layers", "rolling"): {"subscription"},
    # Executors have no events, and takes neither.
    ("intra_process", "galactic"): {"timer"},
}


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("system", "layout"),
    few(CASES, ("intra_process", "galactic"), ("layers", "rolling")),
)
def test_owners(system: str, layout: str, tmp_path: Path) -> None:
    simulation = simulate(
        system,
        tmp_path / "trace",
        factor=0.15,
        layout=layout,
        recording=Recording(start_ns=150 * MILLISECOND),
    )
    ingested = ingest_one(simulation.directory, tmp_path / "run.duckdb")
    ingested.connection.execute(
        f"CREATE TEMP VIEW truth AS FROM '{simulation.truth['callback_instance']}'"
    )
    ingested.connection.execute(
        "CREATE TEMP TABLE judged AS SELECT DISTINCT t.host, t.pid, t.callback_handle, "
        "t.kind AS true_kind, c.kind, c.callback_id, "
        "coalesce(c.timer_id, c.subscription_id, c.service_id) AS owner_id FROM truth AS t "
        "JOIN main.thread AS h ON t.tid = h.tid JOIN main.callback_instance AS i "
        "ON h.thread_id = i.thread_id AND t.start_ns = i.start_ns "
        "JOIN main.callback AS c ON i.callback_id = c.callback_id"
    )
    assert ingested.rows("SELECT * FROM judged WHERE kind NOT IN ('unknown', true_kind)") == []
    unknown = ingested.rows("SELECT DISTINCT true_kind FROM judged WHERE kind = 'unknown'")
    assert {kind for (kind,) in unknown} == CASES[system, layout]
    assert ingested.rows("SELECT count(*) > 2 FROM judged") == [(True,)]
    # Every callback of its own, as it is with these systems.
    assert (
        ingested.rows(
            "SELECT kind FROM judged WHERE kind <> 'unknown' GROUP BY kind "
            "HAVING count(DISTINCT owner_id) <> count(*)"
        )
        == []
    )
    ingested.connection.close()
