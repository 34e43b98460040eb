"""What `why --fix` proposes is what helps, and what `predict` keeps is a run like any other."""

from __future__ import annotations

import json
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from ruamel.yaml import YAML
from support.robots import FAST, SINK, sources

import msgflow
from msgflow.errors import UsageError
from msgflow.ingest import ingest
from msgflow.replay.change import Change, read_change
from msgflow.view.pages import Pages
from msgflow_sim import (
    Executor,
    Host,
    Node,
    Process,
    Scenario,
    Subscription,
    Work,
)
from msgflow_sim import simulate as simulated
from msgflow_sim.entity import MILLISECOND

_SLOW = Node("slow", subscriptions=(Subscription("/seldom", work=Work(45_000_000, 9_000_000)),))


def _database(folder: Path, name: str, slow: Node = _SLOW) -> Path:
    """Return a recording of two nodes that share an executor, unless the slow one has its own."""
    scenario = Scenario(
        name,
        "Two nodes with one executor.",
        (Host("alpha", cpu_count=16),),
        (
            Process("sources", "alpha", 1101, (sources(50, 93),)),
            Process(
                "pair",
                "alpha",
                1201,
                (FAST, slow),
                executors=(Executor(), Executor())[: 1 + slow.executor],
            ),
            Process("sink", "alpha", 1301, (SINK,)),
        ),
        layout="jazzy",
        overwrites=True,
    )
    simulated(scenario, folder / name)
    ingest([folder / name], folder / f"{name}.duckdb")
    return folder / f"{name}.duckdb"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _database(tmp_path_factory.mktemp("remedy"), "recorded")


def test_the_best_remedy_gains_what_it_gains_when_it_is_made(recorded, tmp_path):
    made = _database(tmp_path, "made", replace(_SLOW, executor=1))
    with msgflow.open_db(recorded) as before, msgflow.open_db(made) as after:
        asked: list[str] = []
        found = before.remedies("/answer", progress=lambda number, of, text: asked.append(text))
        latencies = [each.query("e2e-latency", to="/answer") for each in (before, after)]
        suggestion = before.why("/answer").suggestion
    best = found.remedies.to_arrow().to_pylist()[0]
    assert best["remedy"] == "own_executor"
    assert best["node"] in ("/slow", "/fast")
    assert (best["paths"], best["of_paths"]) == (1, 1)
    assert best["change"] in asked
    (was,), (now,) = (each.to_arrow().to_pylist() for each in latencies)
    truth = was["p95_ns"] - now["p95_ns"]
    assert truth > 20 * MILLISECOND
    assert best["p95_gain_ns"] == pytest.approx(truth, rel=0.2)
    assert best["p95_low_ns"] <= best["p95_gain_ns"] <= best["p95_high_ns"]
    gains = found.gains.to_arrow().to_pylist()
    (own,) = [
        each for each in gains if (each["change"], each["path"]) == (best["change"], was["path"])
    ]
    assert own["p95_gain_ns"] == best["p95_gain_ns"]
    assert suggestion is not None
    assert suggestion.startswith(f"try: {best['headline'].partition(':')[0]}")


def test_what_is_kept_is_a_run_like_any_other(recorded, tmp_path):
    kept = tmp_path / "kept.duckdb"
    with msgflow.open_db(recorded) as database:
        found = database.predict(changes=["executor(/slow)=1"], keep=kept)
        with pytest.raises(UsageError, match="the file exists"):
            database.predict(keep=kept)
        unchanged = database.predict("/sink", keep=tmp_path / "same.duckdb")
        (was,) = database.query("e2e-latency", to="/sink").to_arrow().to_pylist()
    assert len(found) == 2
    assert "recorded-predicted" in found.notes[-1]
    (same,) = unchanged.to_arrow().to_pylist()
    assert same["recorded_p95_ns"] == was["p95_ns"]
    with msgflow.open_db(tmp_path / "same.duckdb") as database:
        assert database.check() == []
        runs = database.runs()
        both = [
            database.query("e2e-latency", to="/sink", run=run.run_id).to_arrow().to_pylist()[0]
            for run in runs
        ]
        assert [run.name for run in runs] == ["recorded", "recorded-predicted"]
        assert both[0]["p95_ns"] == was["p95_ns"]
        # As recorded, since nothing was changed.
        assert both[1]["p95_ns"] == pytest.approx(was["p95_ns"], rel=0.05)
        assert both[1]["reached"] == pytest.approx(was["reached"], abs=3)
    with msgflow.open_db(kept) as database:
        compared = database.compare("recorded", "recorded-predicted")
        executors = [
            len(database.query("executor-usage", run=name))
            for name in ("recorded", "recorded-predicted")
        ]
    (path,) = [
        row
        for row in compared.result.to_arrow().to_pylist()
        if row["subject"].endswith("/sink") and row["statistic"] == "p95"
    ]
    assert path["b_ns"] < 0.3 * path["a_ns"]
    assert executors == [3, 4]


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("threads(/slow)", "threads(/perception)=2"),
        ("threads(/slow)*2", "threads(/slow)=2"),
        ("threads(/slow)=0", "threads(/slow)=2"),
        ("thread(/slow)=2", "threads"),
        ("duration(/slow)=0.7", "duration(/slow)*0.7"),
        ("period(/sources)=fast", "period(/sources)=20ms"),
        ("awaits(/slow)=2", "awaits(/slow)=0.9"),
        ("threads(/slo)=2", "/slow"),
        ("threads(/slow)=1", "why --fix"),
        ("depth(/oftn)=1", "/often"),
        ("reacts(/sources)=/often", "msgflow graph"),
    ],
)
def test_what_cannot_be_changed_is_refused_with_a_proposal(recorded, text, hint):
    with msgflow.open_db(recorded) as database, pytest.raises(UsageError) as raised:
        database.predict(changes=[text])
    assert hint in str(raised.value.hint)


@pytest.mark.parametrize(
    "text",
    [
        "executor(/a Subscription(/points))=1",
        "threads(/a)=2",
        "duration(/a on_image)*0.7",
        "depth(/points)=1",
        "period(/a)=20ms",
        "phase(/a Timer(5 ms))=2500us",
        "way(/points)*0.25",
        "awaits(/a)=0.9",
        "reacts(/a)=/points",
    ],
)
def test_a_change_reads_what_it_writes(text):
    assert str(read_change(text)) == text
    assert read_change(f"  {text} ") == read_change(text)


def test_the_command_line_tries_and_predicts(recorded, msgflow):
    fixed = msgflow("why", "/answer", "--fix", "--db", str(recorded))
    first, *_ = fixed.stdout.splitlines()
    assert first.startswith("1. own executor for ")
    assert "next: msgflow predict --set 'executor(" in fixed.stdout
    asked = msgflow(
        "predict", "/sink", "--set", "executor(/slow)=1", "--db", str(recorded), "--format", "csv"
    )
    assert asked.stdout.splitlines()[1].startswith('"executor(/slow)=1","')
    refused = msgflow("why", "/answer", "--fix", "--at", "1s", "--db", str(recorded))
    assert refused.exit_code == 2


def test_what_was_observed_is_within_the_bound(recorded, tmp_path):
    with msgflow.open_db(recorded) as database:
        written = database.export_timing_model(tmp_path / "timing.yaml")
    assert written.exceeded == 0
    model = YAML(typ="safe").load(tmp_path / "timing.yaml")
    assert [len(model[name]) for name in ("executors", "chains")] == [3, written.chains]
    callbacks = {each["name"]: each for one in model["executors"] for each in one["callbacks"]}
    often = callbacks["/fast Subscription(/often)"]
    # It waits for the slow one, and at most for two of them.
    response = often["response_ns"]
    assert 45 * MILLISECOND < response["observed_at_most"] < response["bound"]
    assert response["observed_at_least"] < response["observed_at_most"]
    assert often["execution_ns"]["longest"] == pytest.approx(2 * MILLISECOND, rel=0.1)
    assert callbacks["/sources Timer(50 ms)"]["response_ns"]["bound_holds"]


def test_the_page_asks_for_remedies_and_what_they_do(recorded):
    changes = json.dumps(["executor(/slow)=1"])
    pages = Pages()
    with msgflow.open_db(recorded) as database, closing(pages):
        remedies, paths, parts = (
            pages.answer(database.connection, name, params)
            for name, params in (
                ("remedy", {}),
                ("what_if", {"changes": changes}),
                ("what_if_part", {"changes": changes}),
            )
        )
        with pytest.raises(UsageError):
            pages.answer(database.connection, "what_if", {"changes": '"executor(/slow)=1"'})
    assert b"executor(/slow)=1" in remedies
    assert b"/answer" in paths
    assert b"/sources \xe2\x86\x92 /often" in parts


def test_of_a_real_recording_the_slowest_callback_is_said(real):
    with msgflow.open_db(real("real_pipeline")) as database:
        best, *_ = database.remedies("/sink").remedies.to_arrow().to_pylist()
    assert (best["remedy"], best["node"], best["paths"]) == ("faster", "/filter", 1)
    assert best["low_ns"] > 0


def test_timers_react_and_calls_are_awaited(recorded):
    with msgflow.open_db(recorded) as database:

        def p95(*changes: str) -> int:
            rows = database.predict("/sink", changes=changes).to_arrow().to_pylist()
            value: int = rows[0]["predicted_p95_ns"]
            return value

        before = p95()
        # While the slow one awaits, the fast one runs.
        assert p95("awaits(/slow)=0.9") < 0.6 * before
        assert p95("way(/answer)*3") > before
    assert Change("way", "/answer", 3) == read_change("way(/answer)*3")
