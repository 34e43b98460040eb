"""The comparison behind `make truth`: it finds what is wrong, and nothing is."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import duckdb
import pytest
from ingested import ingest_one
from scoring import compare_recorded, compare_simulated

from msgflow.sim import Recording, simulate

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "truth.py"


@pytest.fixture(scope="module")
def simulation(tmp_path_factory):
    directory = tmp_path_factory.mktemp("scoring")
    recording = Recording(lost_event_share=0.3)
    return simulate("two_hosts", directory / "trace", factor=0.1, recording=recording)


@pytest.fixture
def database(simulation, tmp_path):
    path = tmp_path / "run.duckdb"
    ingest_one(simulation.directory, path).connection.close()
    return path


def _scores(simulation, database):
    scores, _ = compare_simulated(database, simulation.truth)
    return {score.kind: score for score in scores}


def _change(database, sql):
    with duckdb.connect(str(database)) as connection:
        connection.execute(sql)


def test_quick_comparison_is_faultless():
    done = subprocess.run(
        [sys.executable, SCRIPT, "--quick"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "two_hosts" in done.stdout
    assert ", 0 of them not what they must be" in done.stdout


def test_lost_events_are_not_asked_for(simulation, database):
    scores = _scores(simulation, database)
    kinds = ("publication", "take", "callback_instance", "transport", "direct")
    assert any(scores[kind].decided < scores[kind].happened for kind in kinds)
    for kind in kinds:
        score = scores[kind]
        assert 100 < score.decided <= score.happened
        assert (score.wrong, score.missing, score.precision, score.recall) == (0, 0, 1, 1)
    assert scores["transport"].labels.startswith("exact")


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


def test_a_row_at_another_time_is_wrong(simulation, database):
    _change(
        database,
        "UPDATE store.publication SET start_ns = start_ns + 1 WHERE publication_id = 40",
    )
    score = _scores(simulation, database)["publication"]
    assert (score.wrong, score.missing) == (1, 1)


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
    simulation = simulate("losses", directory / "trace", factor=0.3)
    path = directory / "run.duckdb"
    ingest_one(simulation.directory, path).connection.close()
    return simulation, path


def test_reasons_are_judged_where_the_trace_decides_them(losses):
    simulation, path = losses
    _, drops = compare_simulated(path, simulation.truth)
    judged = {drop.truth for drop in drops if not drop.undecided}
    assert {"before_subscription", "before_discovery", "lost_in_transport"} <= judged
    assert all(drop.is_right for drop in drops if not drop.undecided)
    assert {drop.undecided for drop in drops if not drop.is_right} <= {
        "nothing later taken", "nothing earlier taken", "no event of expiry",
        "no event of destruction",
    }  # fmt: skip


@pytest.mark.parametrize("truth", ["before_subscription", "before_discovery", "lost_in_transport"])
def test_a_wrong_reason_is_found(losses, tmp_path, truth):
    simulation, path = losses
    changed = tmp_path / "changed.duckdb"
    shutil.copyfile(path, changed)
    _change(changed, "UPDATE store.undelivered SET reason = 'overwritten'")
    _, drops = compare_simulated(changed, simulation.truth)
    assert any(drop.truth == truth and not drop.undecided and not drop.is_right for drop in drops)


@pytest.mark.parametrize("name", ["sync_1_1", "sync_1_1_jazzy", "pingpong", "services"])
def test_recorded_systems(shared_traces, tmp_path, name):
    path = tmp_path / "run.duckdb"
    ingest_one(shared_traces / name, path).connection.close()
    scores = compare_recorded(path, shared_traces / name / "truth.jsonl.gz")
    assert {"transport", "direct"} <= {score.kind for score in scores}
    for score in scores:
        assert score.decided + score.not_built > 300
        assert (score.wrong, score.repeated) == (0, 0), score
        assert score.missing == 0, score
