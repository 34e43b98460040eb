from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from support.ingested import contents
from typer.testing import CliRunner, Result

from msgflow import open_db
from msgflow.cli.app import app
from msgflow.database import Database
from msgflow.errors import UsageError
from msgflow_sim import Host, Simulation, simulate
from msgflow_sim.scenario import scenarios

Msgflow = Callable[..., Result]

BETWEEN_HOSTS = """
SELECT fh.hostname AS sender, min(l.latency_ns) AS shortest_ns
FROM link_transport AS l
JOIN publication AS b USING (publication_id)
JOIN take AS t USING (take_id)
JOIN process AS f ON b.process_id = f.process_id
JOIN process AS o ON t.process_id = o.process_id
JOIN host AS fh ON f.host_id = fh.host_id
WHERE f.host_id <> o.host_id
GROUP BY fh.hostname
ORDER BY fh.hostname
"""


@pytest.fixture(scope="module")
def drifting(tmp_path_factory: pytest.TempPathFactory) -> Simulation:
    """Two hosts; the clock of the second is 7 ms ahead and runs 20 ppm too fast."""
    return simulate(
        "two_hosts",
        tmp_path_factory.mktemp("drifting") / "traces",
        factor=0.3,
        clock_offset_ns=7_000_000,
        clock_drift_ppm=20,
    )


@pytest.fixture(scope="module")
def direct(drifting: Simulation, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A database whose clocks were brought together when it was ingested: read it only."""
    database = tmp_path_factory.mktemp("direct") / "direct.duckdb"
    arguments = ("ingest", str(drifting.directory), "--name", "run", "--quiet")
    options = ("--db", str(database), "--clock-sync", "messages")
    assert CliRunner().invoke(app, [*arguments, *options]).exit_code == 0
    return database


def clocks(database: Path) -> list[dict[str, Any]]:
    with open_db(database) as opened:
        return opened.query("clocks").to_arrow().to_pylist()


def shortest(database: Path) -> list[int]:
    with open_db(database) as opened:
        return opened.sql(BETWEEN_HOSTS).to_arrow()["shortest_ns"].to_pylist()


def test_offset_and_drift_are_recovered(drifting: Simulation, direct: Path) -> None:
    alpha, beta = clocks(direct)
    assert (alpha["offset_ns"], alpha["uncertainty_ns"], alpha["method"]) == (0, 0, "reference")
    assert (beta["reference"], beta["method"]) == ("alpha", "messages")
    hosts = json.loads(drifting.meta.read_text())["hosts"]
    assert hosts["beta"]["clock_drift_ppb"] == 20_000
    # On alpha's clock, which is the true time; beta's shows (1 + drift) times that, and 7 ms.
    begin = hosts["alpha"]["begin_of_tracing_ns"]
    elapsed = (beta["reference_ns"] - begin - 7_000_000) / (1 + 20e-6)
    offset = -7_000_000 - elapsed * 20e-6
    there, back = shortest(direct)
    assert abs(beta["offset_ns"] - offset) <= beta["uncertainty_ns"]
    # The shortest messages come at other moments, where what is left of the drift counts.
    assert beta["uncertainty_ns"] <= 1.01 * (there + back) / 2
    assert abs(beta["drift_ppb"] + 20_000) <= beta["drift_uncertainty_ppb"]
    assert beta["drift_uncertainty_ppb"] <= 1.2 * (there + back) / 3
    assert there > 0
    assert back > 0


@pytest.mark.thorough
def test_a_database_is_corrected_and_restored(
    msgflow: Msgflow, drifting: Simulation, direct: Path, tmp_path: Path
) -> None:
    database = tmp_path / "later.duckdb"
    arguments = ("ingest", drifting.directory, "--name", "run", "--quiet", "--db", database)
    assert msgflow(*arguments).exit_code == 0
    recorded = contents(database)
    assert min(shortest(database)) < -6_000_000

    result = msgflow("clocks", "apply", "messages", "--db", database)
    assert result.exit_code == 0, result.stderr
    assert "1 of 2 clocks corrected" in result.stderr
    assert contents(database)["clock"] == contents(direct)["clock"]
    assert contents(database)["undelivered"] == contents(direct)["undelivered"]
    assert min(shortest(database)) > 0
    shown = msgflow("clocks", "show", "--db", database, "--format", "json")
    assert [clock["hosts"] for clock in json.loads(shown.stdout)] == ["alpha", "beta"]
    pairs = json.loads(
        msgflow("clocks", "--by", "pair", "--db", database, "--format", "json").stdout
    )
    assert [(pair["from_hosts"], pair["to_hosts"]) for pair in pairs] == [
        ("alpha", "beta"),
        ("beta", "alpha"),
    ]
    assert [pair["shortest_message_ns"] for pair in pairs] == shortest(database)
    count = sum(pair["message_count"] for pair in pairs)
    assert f"by {count:,} messages and 0 network packets" in result.stderr

    for words in (("clocks", "show"), ("check",)):
        said = msgflow(*words, "--db", database).stderr
        assert "the clocks of alpha, beta are together within ±0." in said

    assert msgflow("clocks", "apply", "none", "--db", database).exit_code == 0
    assert contents(database) == recorded
    for words in (("clocks", "show"), ("check",)):
        said = msgflow(*words, "--db", database).stderr
        assert "the clocks of alpha | beta are not synchronised: times between them cannot" in said
        assert "be compared; cure: msgflow clocks apply messages\n" in said


@pytest.mark.thorough
def test_a_file_with_offsets(
    msgflow: Msgflow, drifting: Simulation, direct: Path, tmp_path: Path
) -> None:
    database, file = tmp_path / "given.duckdb", tmp_path / "clocks.yaml"
    shutil.copyfile(direct, database)
    file.write_text("beta: {offset_ns: -7000000, drift_ppb: -20000, uncertainty_ns: 5}\n")
    assert msgflow("clocks", "apply", file, "--db", database).exit_code == 0
    beta = clocks(database)[1]
    assert (beta["offset_ns"], beta["drift_ppb"], beta["uncertainty_ns"]) == (
        -7_000_000,
        -20_000,
        5,
    )
    assert min(shortest(database)) > 0
    before = contents(database)

    file.write_text("beta: 1\ngamma: 2\n")
    result = msgflow("clocks", "apply", file, "--db", database)
    assert result.exit_code == 2
    assert "line 2: the run has no host or clock of that name — gamma" in result.stderr
    assert "alpha (" in result.stderr
    assert contents(database) == before
    (tmp_path / "unsure.yaml").write_text("beta: -7000000\n")
    msgflow("clocks", "apply", tmp_path / "unsure.yaml", "--db", database)
    said = msgflow("clocks", "show", "--db", database).stderr
    assert "alpha, beta are together, as far as the file with their offsets is right" in said
    refused = tmp_path / "refused.duckdb"
    result = msgflow("ingest", drifting.directory, "--db", refused, "--clock-sync", file)
    assert result.exit_code == 2
    assert not refused.exists()


@pytest.mark.parametrize("arguments", [("later",), ("messages", "--run", "nothing")])
def test_what_is_not_there_is_named(
    msgflow: Msgflow, small_database: Path, arguments: tuple[str, ...]
) -> None:
    result = msgflow("clocks", "apply", *arguments, "--db", small_database)
    assert result.exit_code == 2
    assert arguments[-1] in result.stderr


@pytest.mark.thorough
def test_containers_share_a_clock_and_have_equal_pids(msgflow: Msgflow, tmp_path: Path) -> None:
    """Two containers on one machine: two hosts of one clock, whose processes have the same id."""
    system = scenarios()["two_hosts"]
    names = {"alpha": "box-1", "beta": "box-2"}
    system = replace(
        system,
        hosts=tuple(Host(name, boot="machine") for name in names.values()),
        processes=tuple(
            replace(process, hostname=names[process.hostname]) for process in system.processes
        ),
    )
    done = simulate(system, tmp_path / "traces", factor=0.05)
    database = tmp_path / "containers.duckdb"
    arguments = ("ingest", done.directory, "--db", database, "--clock-sync", "messages", "--quiet")
    assert msgflow(*arguments).exit_code == 0
    (clock,) = clocks(database)
    assert (clock["hosts"], clock["method"]) == ("box-1, box-2", "none")
    shown = msgflow("clocks", "show", "--db", database).stderr
    assert "one clock (box-1, box-2): all times can be compared\n" in shown
    said = msgflow("check", "--db", database).stderr
    assert "clock" not in said.replace(str(database), "")
    with open_db(database) as opened:
        processes = opened.sql(
            "SELECT count(*), count(DISTINCT pid), count(DISTINCT (host_id, pid)) FROM process"
        ).to_arrow()
        links = opened.sql("SELECT count(*) FROM link_transport WHERE latency_ns > 0").to_arrow()
    all_, pids, places = (column[0].as_py() for column in processes.columns)
    assert all_ == places > pids
    assert links.columns[0][0].as_py() > 0

    # The same traces, where both containers bear one name and the user tells them apart.
    for path in done.directory.rglob("metadata"):
        path.write_bytes(path.read_bytes().replace(b'"box-2"', b'"box-1"'))
    named = tmp_path / "named.duckdb"
    result = msgflow(
        "ingest",
        done.directory,
        "--db",
        named,
        "--quiet",
        "--host",
        f"one={done.directory / 'box-1'}",
        "--host",
        f"two={done.directory / 'box-2'}",
    )
    assert result.exit_code == 0, result.stderr
    with open_db(named) as opened:
        hosts = opened.sql("SELECT hostname FROM host ORDER BY host_id").to_arrow()
        assert hosts["hostname"].to_pylist() == ["one", "two"]
        again = opened.sql("SELECT count(*) FROM link_transport WHERE latency_ns > 0").to_arrow()
    assert again == links


def test_one_name_for_two_paths_is_one_host(
    msgflow: Msgflow, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[Any] = []

    def ingest(self: Database, *paths: object, **options: Any) -> None:
        given.append(options["hosts"])
        raise UsageError("enough")

    monkeypatch.setattr(Database, "ingest", ingest)
    hosts = ("--host", "one=box-1", "--host", "one=box-2", "--host", "x=y")
    msgflow("ingest", tmp_path, "--together", *hosts)
    assert given == [{"one": ["box-1", "box-2"], "x": ["y"]}]
