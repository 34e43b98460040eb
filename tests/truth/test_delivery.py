"""Every message that was not delivered has the reason that it really had."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from scoring import compare_simulated
from support.ingested import Ingested, ingest_one
from support.thorough import few

from msgflow.db.finding import broken_rules
from msgflow_sim import Recording, scenarios, simulate

TRACES = (
    "partial_sync",
    "periodic_async_jazzy24",
    "pingpong",
    "services",
    "sync_1_1",
    "sync_1_1_humble",
    "sync_1_1_jazzy",
    "tracecompass-ros2",
)
# A process that computes until the trace ends, and is not heard of again, looks as if it had ended.
UNDECIDED = {("pending_at_end", "subscription_ended")}
UNDELIVERED = """
    SELECT ph.hostname AS publication_host, pp.pid AS publication_pid,
        b.rmw_ns AS publication_rmw_ns, sh.hostname AS subscription_host,
        sp.pid AS subscription_pid, s.subscription_handle, d.reason
    FROM stat_delivery AS d
    JOIN publication AS b USING (publication_id)
    JOIN process AS pp ON b.process_id = pp.process_id
    JOIN host AS ph ON pp.host_id = ph.host_id
    JOIN subscription AS s ON d.subscription_id = s.subscription_id
    JOIN process AS sp ON s.process_id = sp.process_id
    JOIN host AS sh ON sp.host_id = sh.host_id
    WHERE d.status <> 'delivered' AND s.is_internal = {internal}
"""
TRUE = """
    SELECT publication_host, publication_pid, publication_rmw_ns, subscription_host,
        subscription_pid, subscription_handle, reason
    FROM truth_undelivered
    WHERE is_internal = {internal}
"""


# Systems in which the trace decides every reason; `make truth` compares those of the others as far
# as their traces do.
DECIDED = ("pipeline", "fan_out", "two_hosts", "demo")


@pytest.fixture(params=few(DECIDED, "demo"))
def decided(request: pytest.FixtureRequest, simulations: Callable[[str], Ingested]) -> Ingested:
    return simulations(request.param)


def reasons(ingested: Ingested, internal: str) -> list[tuple[str | None, str | None]]:
    """Return the true reason and ours, of everything that either says is missing."""
    return ingested.rows(
        f"SELECT t.reason, m.reason FROM ({TRUE.format(internal=internal)}) AS t "
        f"FULL JOIN ({UNDELIVERED.format(internal=internal)}) AS m "
        "USING (publication_host, publication_pid, publication_rmw_ns, subscription_host, "
        "subscription_pid, subscription_handle)"
    )


@pytest.mark.thorough
def test_reasons_of_the_application(decided: Ingested) -> None:
    """What was published before the subscription was there is undelivered to us alone."""
    found = reasons(decided, "false")
    assert found
    wrong = [pair for pair in found if pair[1] != (pair[0] or "before_subscription")]
    assert all(pair in UNDECIDED for pair in wrong), wrong
    assert len(wrong) <= 1


def test_reasons_of_what_ros_publishes_once(decided: Ingested) -> None:
    """Where nothing ever came, it cannot be told that the two did not know each other yet."""
    for true, ours in reasons(decided, "true"):
        if true == "before_discovery":
            assert ours in ("before_discovery", "never_taken", "pending_at_end")
        else:
            assert ours == (true or "before_subscription")


def test_no_take_is_an_orphan(decided: Ingested) -> None:
    assert decided.rows("SELECT reason FROM stat_orphan") == []


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(TRACES, "services"))
def test_reasons_add_up(recordings: Callable[[str], Ingested], name: str) -> None:
    assert broken_rules(recordings(name).connection) == []


@pytest.mark.parametrize("simulated", few(scenarios(), "demo", "services"), indirect=True)
def test_simulated_systems_keep_every_rule(simulated: Ingested) -> None:
    """That reasons add up is one; none complains about what a sound system does."""
    assert broken_rules(simulated.connection) == []


@pytest.mark.thorough
def test_the_trace_of_trace_compass(recordings: Callable[[str], Ingested]) -> None:
    """The buffers of the process in the middle end 0.2 s before the others."""
    trace = recordings("tracecompass-ros2")
    assert trace.rows(
        "SELECT s.topic_name, o.reason, count(*) FROM stat_orphan AS o "
        "JOIN subscription AS s USING (subscription_id) GROUP BY ALL"
    ) == [("/topic_b", "publisher_trace_ends", 40)]
    assert trace.rows(
        "SELECT s.topic_name, d.reason, count(*) FROM stat_delivery AS d "
        "JOIN subscription AS s USING (subscription_id) "
        "WHERE d.status <> 'delivered' AND NOT s.is_internal GROUP BY ALL ORDER BY ALL"
    ) == [("/topic_a", "before_discovery", 5), ("/topic_a", "subscription_ended", 40)]


HANDOVER = 30_000_000
FAULTY = {
    "starved": Recording(),
    "overwritten_copies": Recording(),
    "pipeline": Recording(
        start_ns=100_000_000, pauses=((250_000_000, 300_000_000),), handover_ns=HANDOVER
    ),
    "two_hosts": Recording(start_ns=100_000_000, is_dual_session=True, handover_ns=HANDOVER),
    "mixed_intra_process": Recording(losses=((4_000_000, 6_000_000), (150_000_000, 170_000_000))),
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(FAULTY, "mixed_intra_process"))
def test_no_reason_is_false(tmp_path: Path, name: str) -> None:
    """Also where readers get no CPU, processes leave one by one, and events are lost."""
    simulation = simulate(name, tmp_path / "trace", factor=0.1, recording=FAULTY[name])
    path = tmp_path / "run.duckdb"
    ingest_one(simulation.directory, path).connection.close()
    _, drops = compare_simulated(path, simulation.truth)
    assert drops is not None
    assert sum(drop.messages for drop in drops if drop.is_right) >= 4
    assert [drop for drop in drops if not drop.is_right and not drop.undecided] == []
