"""The comparison behind `make truth`: it finds what is wrong, and nothing is."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import duckdb
import pytest
from scoring import compare, compare_recorded, compare_simulated
from support.ingested import ingest_one
from support.thorough import few, thorough

from msgflow_sim import Recording, simulate

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "truth.py"


@pytest.fixture(scope="module")
def simulation(tmp_path_factory):
    directory = tmp_path_factory.mktemp("scoring")
    recording = Recording(lost_event_share=0.2)
    return simulate("two_hosts", directory / "trace", factor=0.1, recording=recording)


@pytest.fixture(scope="module")
def ingested(simulation, tmp_path_factory):
    path = tmp_path_factory.mktemp("scoring") / "run.duckdb"
    ingest_one(simulation.directory, path).connection.close()
    return path


@pytest.fixture
def database(ingested, tmp_path):
    """A copy, to change it."""
    return Path(shutil.copy(ingested, tmp_path / "run.duckdb"))


def _scores(simulation, database):
    scores, _ = compare_simulated(database, simulation.truth)
    return {score.kind: score for score in scores}


def _change(database, sql):
    with duckdb.connect(str(database)) as connection:
        connection.execute(sql)


@pytest.mark.parametrize(
    "chosen",
    [
        ("--system", "two_hosts", "--layout", "jazzy", "--recording", "loss", "--factor", "0.05"),
        thorough(("--quick",)),
    ],
)
def test_quick_comparison_is_faultless(chosen, tmp_path):
    done = subprocess.run(
        [sys.executable, SCRIPT, *chosen, "--traces", tmp_path],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "two_hosts" in done.stdout
    assert ", 0 of them not what they must be" in done.stdout


@pytest.mark.thorough
def test_lost_events_are_not_asked_for(simulation, database):
    scores = _scores(simulation, database)
    kinds = ("publication", "take", "callback_instance", "transport", "direct")
    assert any(scores[kind].decided < scores[kind].happened for kind in kinds)
    for kind in kinds:
        score = scores[kind]
        assert 100 < score.decided <= score.happened
        assert (score.wrong, score.missing, score.precision, score.recall) == (0, 0, 1, 1)
    assert scores["transport"].labels.startswith("exact")


@pytest.mark.thorough
@pytest.mark.parametrize("share", few([0, 0.3], 0.3))
@pytest.mark.parametrize("layout", few(["foxy", "galactic"], "galactic"))
def test_takes_without_an_event_are_no_loss(tmp_path, layout, share):
    """Before Humble nothing but the callback shows a take, and nothing whose message it was."""
    recording = Recording(lost_event_share=share)
    simulation = simulate(
        "two_hosts", tmp_path / "trace", layout=layout, factor=0.1, recording=recording
    )
    path = tmp_path / "run.duckdb"
    ingest_one(simulation.directory, path).connection.close()
    scores, drops = compare_simulated(path, simulation.truth)
    (excused,) = (score for score in scores if score.kind == "excused")
    assert excused.wrong == 0
    assert share or excused.found == 0
    assert [drop for drop in drops if not drop.undecided and not drop.is_right] == []
    reasons = {drop.reason: drop.messages for drop in drops if drop.truth == "no event"}
    assert reasons.keys() == {"no_stamp"}
    assert reasons["no_stamp"] > 100


@pytest.mark.thorough
def test_of_writes_that_go_on_at_the_same_time_none_is_decided(tmp_path):
    """Threads of rclpy share a publisher, and have no event until they take the next message."""
    simulation = simulate("python_timers", tmp_path / "trace", layout="humble", factor=0.1)
    path = tmp_path / "run.duckdb"
    ingest_one(simulation.directory, path).connection.close()
    scores, drops = compare_simulated(path, simulation.truth)
    (score,) = (score for score in scores if score.kind == "transport")
    assert (score.wrong, score.missing) == (0, 0)
    assert 0 < score.decided < score.found < score.happened
    assert [drop for drop in drops if not drop.undecided and not drop.is_right] == []


@pytest.mark.thorough
def test_a_link_that_is_gone_is_missing(simulation, database):
    before = _scores(simulation, database)
    _change(
        database,
        "DELETE FROM store.link_transport WHERE take_id IN "
        "(SELECT take_id FROM store.link_transport ORDER BY take_id LIMIT 3)",
    )
    _change(
        database,
        "DELETE FROM store.link_causal WHERE publication_id IN "
        "(SELECT publication_id FROM store.link_causal ORDER BY publication_id LIMIT 2)",
    )
    scores = _scores(simulation, database)
    assert scores["transport"].missing == 3
    assert scores["transport"].recall == pytest.approx(1 - 3 / before["transport"].decided)
    assert scores["transport"].precision == 1
    assert scores["direct"].missing == 2


@pytest.mark.thorough
def test_a_link_to_another_message_is_wrong(simulation, database):
    _change(
        database,
        """
        UPDATE store.link_transport AS l SET publication_id = o.publication_id
        FROM (
            SELECT take_id, lead(publication_id) OVER (ORDER BY take_id) AS publication_id
            FROM store.link_transport
        ) AS o
        WHERE l.take_id = o.take_id AND o.publication_id IS NOT NULL
            AND l.take_id IN (SELECT take_id FROM store.link_transport ORDER BY take_id LIMIT 4)
        """,
    )
    score = _scores(simulation, database)["transport"]
    assert score.wrong == 4
    assert score.precision == pytest.approx(1 - 4 / score.found)
    assert score.missing == 4


@pytest.mark.thorough
def test_a_wrong_link_by_time_may_say_that_events_are_missing(simulation, database):
    """Only a link by time may. One that is right is not counted."""
    _change(
        database,
        """
        UPDATE store.link_transport AS l
        SET publication_id = o.publication_id,
            method = CASE WHEN o.place <= 3 THEN 'nearest' ELSE 'exact' END,
            is_loss_affected = o.place <> 1
        FROM (
            SELECT
                take_id, lead(publication_id) OVER (ORDER BY take_id) AS publication_id,
                row_number() OVER (ORDER BY take_id) AS place
            FROM store.link_transport
        ) AS o
        WHERE l.take_id = o.take_id AND o.place <= 4
        """,
    )
    _change(
        database,
        "UPDATE store.link_transport SET method = 'nearest', is_loss_affected = true "
        "WHERE take_id = (SELECT max(take_id) FROM store.link_transport)",
    )
    score = _scores(simulation, database)["transport"]
    assert (score.wrong, score.loss_affected, score.misguessed) == (4, 2, 0)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("end_shift_ns", "is_marked", "wrong"), [(1, True, 0), (1, False, 1), (0, True, 1)]
)
def test_what_is_wrong_in_a_run_with_a_doubtful_wrong_end_is_a_guess(
    simulation, database, end_shift_ns, is_marked, wrong
):
    _change(
        database,
        f"""
        UPDATE store.callback_instance
        SET end_ns = end_ns + {end_shift_ns}, is_loss_affected = {is_marked}
        WHERE callback_instance_id = (
            SELECT min(callback_instance_id) FROM store.link_causal WHERE kind = 'direct'
        )
        """,
    )
    _change(
        database,
        """
        UPDATE store.link_causal
        SET publication_id = (SELECT max(publication_id) FROM store.link_causal)
        WHERE callback_instance_id = (SELECT min(callback_instance_id) FROM store.link_causal)
        """,
    )
    score = _scores(simulation, database)["direct"]
    assert (score.wrong, score.misguessed) == (wrong, 1 - wrong)


@pytest.mark.thorough
def test_a_row_at_another_time_is_wrong(simulation, database):
    _change(
        database,
        "UPDATE store.publication SET start_ns = start_ns + 1 WHERE publication_id = 40",
    )
    score = _scores(simulation, database)["publication"]
    assert (score.wrong, score.missing) == (1, 1)


@pytest.mark.thorough
def test_a_row_twice_is_repeated(simulation, database):
    _change(
        database,
        "INSERT INTO store.link_transport SELECT * FROM store.link_transport LIMIT 5",
    )
    score = _scores(simulation, database)["transport"]
    assert (score.repeated, score.wrong, score.missing) == (5, 0, 0)


@pytest.fixture(scope="module")
def losses(tmp_path_factory):
    directory = tmp_path_factory.mktemp("losses")
    simulation = simulate("losses", directory / "trace", factor=0.2)
    path = directory / "run.duckdb"
    ingest_one(simulation.directory, path).connection.close()
    return simulation, path


@pytest.mark.thorough
def test_reasons_are_judged_where_the_trace_decides_them(losses):
    simulation, path = losses
    _, drops = compare_simulated(path, simulation.truth)
    judged = {drop.truth for drop in drops if not drop.undecided}
    assert {"before_subscription", "before_discovery", "lost_in_transport"} <= judged
    assert all(drop.is_right for drop in drops if not drop.undecided)
    # Nothing is missing.
    assert not any(drop.undecided == "events are missing" for drop in drops)
    assert {drop.undecided for drop in drops if not drop.is_right} <= {
        "nothing later taken",
        "nothing earlier taken",
        "no event of expiry",
        "no event of destruction",
    }


@pytest.mark.thorough
@pytest.mark.parametrize("truth", ["before_subscription", "before_discovery", "lost_in_transport"])
def test_a_wrong_reason_is_found(losses, tmp_path, truth):
    simulation, path = losses
    changed = tmp_path / "changed.duckdb"
    shutil.copyfile(path, changed)
    _change(changed, "UPDATE store.undelivered SET reason = 'overwritten'")
    _, drops = compare_simulated(changed, simulation.truth)
    assert any(drop.truth == truth and not drop.undecided and not drop.is_right for drop in drops)


@pytest.mark.thorough
@pytest.mark.parametrize("reason", ["unknown", "receiver_gap"])
def test_no_loss_excuses_anything_where_none_was(losses, tmp_path, reason):
    """Not a reason of what was not taken, nor one of what was."""
    simulation, path = losses
    changed = tmp_path / "changed.duckdb"
    shutil.copyfile(path, changed)
    _change(changed, f"UPDATE store.undelivered SET reason = '{reason}'")
    _change(
        changed,
        f"""
        INSERT INTO store.undelivered
        SELECT run_id, publication_id, publisher_id, subscription_id, '{reason}'
        FROM store.link_transport
        ORDER BY take_id
        LIMIT 3
        """,
    )
    _change(
        changed,
        "DELETE FROM store.link_transport WHERE take_id IN "
        "(SELECT take_id FROM store.link_transport ORDER BY take_id LIMIT 3)",
    )
    _, drops = compare_simulated(changed, simulation.truth)
    wrong = {drop.truth for drop in drops if drop.reason == reason and not drop.undecided}
    assert {"before_subscription", "lost_in_transport", "delivered, recorded"} <= wrong
    assert not any(drop.is_right for drop in drops if drop.reason == reason)


@pytest.mark.thorough
def test_a_loss_excuses_what_is_near_it(simulation, database):
    """Where every message is said to be hidden by a gap, those within are excused, and few more."""
    scores, drops = compare_simulated(database, simulation.truth)
    assert all(drop.is_right for drop in drops if not drop.undecided)
    excused = {score.kind: score for score in scores}["excused"]
    allowed = int(excused.labels.removeprefix("at most "))
    assert excused.wrong == 0
    assert excused.found <= allowed < excused.happened / 2
    _change(database, "UPDATE store.undelivered SET reason = 'receiver_gap'")
    _change(database, "UPDATE store.orphan_take SET reason = 'unknown'")
    _, drops = compare_simulated(database, simulation.truth)
    said = {(drop.truth, drop.reason): drop for drop in drops}
    assert said["before_subscription", "receiver_gap"].undecided is None
    assert said["delivered, loss", "receiver_gap"].is_right
    assert said["sent, loss", "unknown"].undecided is None


@pytest.mark.thorough
def test_excuses_where_nothing_is_missing_are_wrong(losses, monkeypatch):
    simulation, path = losses
    monkeypatch.setattr(compare, "EXCUSE", None)
    scores, drops = compare_simulated(path, simulation.truth)
    excused = {score.kind: score for score in scores}["excused"]
    assert excused.labels == "at most 0"
    assert excused.wrong == sum(drop.messages for drop in drops if drop.undecided is None) > 0


LOSS = Recording(lost_event_share=0.3)
STEPS = Recording(realtime_steps=((200_000_000, 7_000), (500_000_000, -40_000_000)))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("system", "layout", "factor", "recording"),
    few(
        [
            # Copies of what a ring buffer overwrites are no deliveries; of a publication that a
            # loss tore in two, one part names no publisher; a message may be taken before its
            # publication ends.
            ("overwritten_copies", "humble", 1, LOSS),
            ("overwritten_copies", "iron", 1, LOSS),
            ("overwritten_copies", "jazzy", 1, LOSS),
            # Takes whose links count as missing.
            ("losses", "iron", 0.3, STEPS),
            # A take that has no event of its own, beside a hole.
            ("layers", "iron", 1, LOSS),
            # A host whose initialisation is missing may have sent anything in a hole; how long
            # after its events a message is stamped.
            ("bursts_two_hosts", "iron", 0.1, Recording(lost_packet_share=0.2)),
            ("bursts_two_hosts", "humble", 1, LOSS),
        ],
        ("overwritten_copies", "iron", 1, LOSS),
    ),
)
def test_what_a_trace_leaves_open_is_excused(tmp_path, system, layout, factor, recording):
    simulation = simulate(
        system,
        tmp_path / "trace",
        layout=layout,
        factor=factor,
        recording=recording,
        clock_offset_ns=350_000_000,
    )
    path = tmp_path / "run.duckdb"
    ingest_one(simulation.directory, path).connection.close()
    scores, drops = compare_simulated(path, simulation.truth)
    assert [score for score in scores if score.wrong] == []
    assert [drop for drop in drops if not drop.undecided and not drop.is_right] == []


@pytest.mark.thorough
def test_what_follows_from_a_missing_link_is_not_judged_twice(tmp_path):
    """The take that comes after a message that was lost may be of it."""
    simulation = simulate("losses", tmp_path / "trace", layout="humble", factor=0.2)
    path = tmp_path / "run.duckdb"
    ingest_one(simulation.directory, path).connection.close()
    with duckdb.connect(str(path)) as connection:
        ((take,),) = connection.execute(
            """
            SELECT min(l.take_id)
            FROM (
                SELECT publisher_id, subscription_id, min(publication_id) AS publication_id
                FROM store.undelivered
                WHERE reason = 'not_delivered'
                GROUP BY ALL
                ORDER BY count(*) DESC
                LIMIT 1
            ) AS u
            JOIN store.link_transport AS l
                ON u.publisher_id = l.publisher_id AND u.subscription_id = l.subscription_id
                AND u.publication_id < l.publication_id
            """
        ).fetchall()

    def lost():
        _, drops = compare_simulated(path, simulation.truth)
        return {d.undecided: d.messages for d in drops if d.truth == "lost_in_transport"}

    _change(path, "UPDATE store.undelivered SET reason = 'unknown'")
    before = lost()
    assert "takes of unknown messages" not in before
    _change(path, f"DELETE FROM store.link_transport WHERE take_id = {take}")
    after = lost()
    assert after[None] > 0
    assert after[None] + after["takes of unknown messages"] == before[None]


TRUNCATED = Recording(cut_streams=1, unfinished_streams=1)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("system", "layout"),
    few(
        [
            ("rivals", "jazzy"),
            ("nested", "humble"),
            ("layers", "humble"),
            ("rtabmap", "humble"),
            ("equal_stamps", "humble"),
            ("mixed_intra_process", "humble"),
        ],
        ("rivals", "jazzy"),
    ),
)
def test_streams_that_end_early_are_judged(tmp_path, system, layout):
    """One stream ends within a packet, the other has lost its last one, which may be all it had.

    A tenth of mixed_intra_process has 14 messages before the cut. If the clock had jumped by one
    period, 13 of them would fit, so none is linked.
    """
    simulation = simulate(
        system,
        tmp_path / "trace",
        layout=layout,
        factor=0.2,
        recording=TRUNCATED,
        clock_offset_ns=350_000_000,
    )
    database = tmp_path / "run.duckdb"
    ingest_one(simulation.directory, database).connection.close()
    with duckdb.connect(str(database), read_only=True) as connection:
        ((count,),) = connection.execute("SELECT sum(event_count) FROM trace").fetchall()
    assert count == simulation.event_count
    scores, drops = compare_simulated(database, simulation.truth)
    assert [score for score in scores if score.wrong or score.missing] == []
    assert [drop for drop in drops if not drop.undecided and not drop.is_right] == []
    found = {score.kind: score for score in scores}
    assert found["callback_instance"].decided > 100
    # A state that begins later is wrong, and so is the one before, which lasts until then.
    _change(
        database,
        "UPDATE store.executor_state SET start_ns = start_ns + 1 WHERE start_event_id = ("
        " SELECT min(start_event_id) FROM store.executor_state WHERE state = 'execute')",
    )
    assert _scores(simulation, database)["executor_state"].wrong == 2


@pytest.fixture(scope="module")
def caches(tmp_path_factory):
    directory = tmp_path_factory.mktemp("caches")
    simulation = simulate("partial_sync", directory / "trace", factor=0.1)
    path = directory / "run.duckdb"
    ingest_one(simulation.directory, path).connection.close()
    return simulation, path


@pytest.mark.thorough
def test_a_decided_link_is_the_only_candidate(caches, tmp_path):
    simulation, path = caches
    assert _scores(simulation, path)["partial_sync"].doubted == 0
    changed = tmp_path / "changed.duckdb"
    shutil.copyfile(path, changed)
    _change(changed, "UPDATE store.link_causal SET candidate_count = 2")
    score = _scores(simulation, changed)["partial_sync"]
    assert 0 < score.doubted <= score.decided


@pytest.mark.thorough
def test_a_message_that_another_firing_may_have_used_is_not_decided(tmp_path):
    """On several threads, caches are emptied while messages come."""
    simulation = simulate("reentrant", tmp_path / "trace", factor=0.1, clock_offset_ns=350_000_000)
    database = tmp_path / "run.duckdb"
    ingest_one(simulation.directory, database).connection.close()
    score = _scores(simulation, database)["partial_sync"]
    assert (score.doubted, score.missing, score.wrong) == (0, 0, 0)
    assert 10 < score.decided < score.happened / 2


@pytest.mark.thorough
def test_an_indirect_link_stored_twice_is_repeated(caches, tmp_path):
    """Also where two annotations give some links twice."""
    simulation, path = caches
    changed = tmp_path / "changed.duckdb"
    shutil.copyfile(path, changed)
    _change(
        changed,
        "INSERT INTO store.link_causal SELECT * FROM store.link_causal "
        "WHERE kind = 'partial_sync' ORDER BY ALL LIMIT 5",
    )
    assert _scores(simulation, path)["partial_sync"].repeated == 0
    assert _scores(simulation, changed)["partial_sync"].repeated == 5


@pytest.mark.thorough
@pytest.mark.parametrize(
    "name", few(["sync_1_1", "sync_1_1_jazzy", "pingpong", "services"], "services")
)
def test_recorded_systems(shared_traces, recordings, name):
    path = recordings(name).path
    scores = compare_recorded(path, shared_traces / name / "truth.jsonl.gz")
    assert {"transport", "direct"} <= {score.kind for score in scores}
    for score in scores:
        assert score.decided > 300
        assert (score.wrong, score.repeated) == (0, 0), score
        assert score.missing == 0, score
