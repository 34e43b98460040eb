"""Questions to many runs have the answers that all their rows together give."""

from __future__ import annotations

import dataclasses
import shutil
import subprocess
import sys
from pathlib import Path

import duckdb
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.thorough import few
from typer.testing import CliRunner, Result

from msgflow import Database
from msgflow.cli.app import app
from msgflow.errors import DatabaseError, QueryError, UsageError
from msgflow.fleet.lake import Lake
from msgflow.fleet.lake_connection import Reading, choose
from msgflow.fleet.lake_query import (
    STATEMENTS,
    fleet_query,
    fleet_sql,
    fleet_worst,
    header_of,
    lake_names,
    names,
)
from msgflow.fleet.part import ANSWERS, write_part
from msgflow.ingest import ingest
from msgflow.query.catalogue import load_query
from msgflow.query.selection import make_selection
from msgflow_sim import simulate

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "fleet.md").read_text(encoding="utf-8")


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["fleet", *map(str, arguments)])


def rows(table: pa.Table, columns: list[str]) -> list[tuple[object, ...]]:
    return sorted(zip(*(table[name].to_pylist() for name in columns), strict=True), key=repr)


def test_headers_are_those_of_the_statements(night: Lake) -> None:
    groups = duckdb.sql("SELECT $key AS run, ['r1'] AS label_group", params={"key": "c" * 20})
    with Reading(choose(night), ANSWERS, groups=groups.to_arrow_table()) as reading:
        con = reading.connection
        for name in STATEMENTS.names():
            header = STATEMENTS.header(name)
            if not header.columns:
                continue
            relation = STATEMENTS.run(con, name, {"path": "x", "count": 1})
            described = list(zip(relation.columns, map(str, relation.types), strict=True))
            assert described == [(column.name, column.type) for column in header.columns], name


def test_names_are_those_of_the_queries_of_one_run() -> None:
    for name in names():
        assert f"`{load_query(name).words}`" in PAGE


@pytest.mark.parametrize(
    "name",
    few(
        [name for name in names() if name not in ("info-findings", "info-quality")],
        "e2e-latency",
        "timers",
    ),
)
def test_one_run_is_what_its_database_says(
    night: Lake, databases: tuple[Path, Path], name: str
) -> None:
    found = fleet_query(night, name, where="name = 'second'", internal=True)
    assert found.notes == ["1 of 3 runs"]
    with Database(databases[1]) as database:
        expected = database.query(name, internal=True).to_arrow()
    if name == "executor-usage":
        assert sum(found.table["callback_ns"].to_pylist()) == sum(
            expected["callback_ns"].to_pylist()
        )
        return
    shared = [column for column in found.columns if column in expected.column_names]
    assert len(shared) >= 3
    assert rows(found.table, shared) == rows(expected, shared)


def test_a_text_is_a_name_with_commas_or_several_names() -> None:
    given = {"node": "/a, /b", "topic": "/a", "host": ["x,y"], "via": "/a,/b"}
    chosen = make_selection(given, lake_names)
    assert chosen.node == ("/a, /b", "/a", "/b")
    assert (chosen.topic, chosen.host, chosen.via) == (("/a",), ("x,y",), ("/a", "/b"))


def test_findings_of_one_run_are_added_up(night: Lake, databases: tuple[Path, Path]) -> None:
    found = fleet_query(night, "info-findings", where="name = 'second'").table.to_pylist()
    with Database(databases[1]) as database:
        rows = database.query("info-findings").to_arrow().to_pylist()
    assert len(rows) >= len(found) > 0
    for row in found:
        places = [each["count"] for each in rows if each["name"] == row["name"]]
        assert (row["places"], row["count"]) == (len(places), sum(places))
        assert row["cause"]
        assert row["cure"]


def test_latencies_of_several_runs_are_those_of_all_their_flows(night: Lake) -> None:
    for case, is_counted in (("first", "is_first"), ("every_pair", "true")):
        found = fleet_query(night, "e2e-latency", case=case).table
        expected = duckdb.sql(
            "SELECT path, count(*), min(latency_ns), quantile_disc(latency_ns, 0.5), "
            "round(avg(latency_ns))::BIGINT, quantile_disc(latency_ns, 0.95), "
            "quantile_disc(latency_ns, 0.99), max(latency_ns) "
            f"FROM read_parquet('{night.store.url}/flow/*.parquet') "
            f"WHERE status = 'reached' AND {is_counted} GROUP BY path"
        ).fetchall()
        columns = ["path", "pairs", "min_ns", "median_ns", "mean_ns", "p95_ns", "p99_ns", "max_ns"]
        assert rows(found, columns) == sorted(expected, key=repr)
    # Half of the first run takes twice as long: no average of two medians is the median.
    grouped = fleet_query(night, "e2e-latency", group_by=["software_version"]).table.to_pylist()
    (path,) = {row["path"] for row in grouped if row["software_version"] == "1.1"}
    of_path = {row["software_version"]: row for row in grouped if row["path"] == path}
    assert of_path["1.1"]["median_ns"] == 2 * of_path["1.0"]["median_ns"]
    assert {row["runs"] for row in of_path.values()} == {1}


def test_times_of_several_runs_are_off_by_less_than_a_hundredth(night: Lake) -> None:
    where = "name IN ('first', 'second')"
    found = fleet_query(night, "callbacks", where=where, internal=True)
    assert "medians and other quantiles of several runs are off by less than 1 %" in found.notes
    exact = fleet_sql(
        night,
        "SELECT l.node, l.label, count(*), quantile_disc(i.end_ns - i.start_ns, 0.5), "
        "quantile_disc(i.end_ns - i.start_ns, 0.99), max(i.end_ns - i.start_ns), "
        "sum(i.end_ns - i.start_ns)::BIGINT FROM view.callback_instance AS i "
        "JOIN view.callback_label AS l USING (run, callback_id) GROUP BY ALL",
        where=where,
    ).table
    expected = {(row[0], row[1]): row[2:] for row in zip(*exact.to_pydict().values(), strict=True)}
    assert len(found) == len(expected) > 3
    for row in found.table.to_pylist():
        count, median, p99, longest, total = expected[row["node"], row["callback"]]
        assert (row["count"], row["max_ns"], row["total_ns"]) == (count, longest, total)
        assert row["median_ns"] == pytest.approx(median, rel=0.0101)
        assert row["p99_ns"] == pytest.approx(p99, rel=0.0101)


@pytest.mark.thorough
def test_quantiles_of_the_same_run_twice_are_its_own(night: Lake) -> None:
    """All times of a run and its copy have the quantiles of the run, counts are doubled."""
    for name, count, times in (
        ("callbacks", "count", ["period_median_ns", "median_ns", "p95_ns", "p99_ns"]),
        ("waits", "count", ["wait_median_ns"]),
        ("topics-latency", "takes", ["median_ns", "p95_ns", "p99_ns"]),
    ):
        one, both = (
            fleet_query(night, name, where=where, internal=True).table.to_pylist()
            for where in ("name = 'first'", "robot = 'r1'")
        )
        assert len(one) == len(both) > 2
        for alone, twice in zip(one, both, strict=True):
            assert twice["runs"] == 2
            assert twice[count] == 2 * alone[count]
            assert [twice[time] for time in times] == pytest.approx(
                [alone[time] for time in times], rel=0.0101
            )


def test_reasons_and_shares_are_of_sums(night: Lake) -> None:
    one, both = (
        fleet_query(night, "topics-delivery", where=where, internal=True).table.to_pylist()
        for where in ("name = 'first'", "robot = 'r1'")
    )
    assert any(row["reasons"] for row in one)
    for alone, twice in zip(one, both, strict=True):
        assert twice["delivered_percent"] == alone["delivered_percent"]
        doubled = [(reason, 2 * number) for reason, number in alone["reasons"] or ()]
        assert (twice["reasons"] or []) == doubled


@pytest.mark.thorough
def test_goals_of_several_runs_are_added_up(tmp_path: Path) -> None:
    """Quantiles are the largest of any run; the goals themselves are in the views of each run."""
    lake, commits, alone = Lake.open(tmp_path / "lake", create=True), [], []
    for seed in (0, 1):
        recording, path = tmp_path / f"r{seed}", tmp_path / f"{seed}.duckdb"
        simulate("actions", recording, factor=0.2, seed=seed)
        ingest([recording], path)
        with Database(path) as database:
            part = write_part(database.connection, path, lake.store, tmp_path)
            alone += database.query("action-latency").to_arrow().to_pylist()
        commits.append({**part, "labels": {}, "source": str(seed)})
    lake.commit(commits)
    found = fleet_query(lake, "action-latency").table.to_pylist()
    assert [(row["action_name"], row["runs"]) for row in found] == [
        ("/dock", 2), ("/move", 2), ("/move", 2)
    ]  # fmt: skip
    for row in found:
        same = ("action_name", "server", "client")
        of_run = [each for each in alone if all(each[name] == row[name] for name in same)]
        for name in row.keys() - {*same, "runs"}:
            values = [each[name.replace("_most", "")] for each in of_run]
            added = max(values) if name.endswith("_ns") else sum(values)
            assert row[name] == (min(values) if name == "result_min_ns" else added), name
    counted = fleet_sql(lake, "SELECT count(*) AS goals FROM view.goal").table.to_pylist()
    assert counted == [{"goals": sum(row["goals"] for row in found)}]
    assert sum(row["finished"] for row in found) > 10


@pytest.mark.thorough
def test_groups_are_of_labels_and_of_columns(night: Lake) -> None:
    found = fleet_query(night, "e2e-latency", group_by=["robot", "soft-ware", "name"])
    assert found.columns[:4] == ("robot", "soft-ware", "name", "runs")
    assert {row["soft-ware"] for row in found.table.to_pylist()} == {None, "a'b"}
    assert {row["name"] for row in found.table.to_pylist()} == {"first", "second", "copy"}
    # A column of the query has its name first.
    assert "label_run" not in fleet_query(night, "topics-delivery", group_by=["run"]).columns
    assert fleet_query(night, "info-findings", group_by=["name"]).columns[0] == "label_name"
    with pytest.raises(UsageError, match=r"(?s)such a label — robo.*did you mean robot"):
        fleet_query(night, "e2e-latency", group_by=["robo"])
    with pytest.raises(UsageError, match="such a label — labels"):
        fleet_query(night, "e2e-latency", group_by=["labels"])
    # Of one run each, quantiles are its own.
    assert "off by less" in str(fleet_query(night, "callbacks").notes)
    assert "off by less" not in str(fleet_query(night, "callbacks", group_by=["run"]).notes)


def test_rows_are_chosen(night: Lake) -> None:
    whole = fleet_query(night, "callbacks")
    node = whole.table["node"][0].as_py()
    some = fleet_query(
        night, "callbacks", selection={"node": node, "sort": "max_ns:desc", "limit": 1}
    )
    assert some.table["node"].to_pylist() == [node]
    assert "is_internal" not in some.columns
    with pytest.raises(UsageError, match="no such parameter — case"):
        fleet_query(night, "topics-delivery", case="last")
    with pytest.raises(UsageError, match="no such value — best"):
        fleet_query(night, "e2e-latency", case="best")


def test_what_a_lake_cannot_answer(night: Lake) -> None:
    for name, words in (
        ("flows", r"does not hold what this query needs — flows\n\nhint: it answers action-"),
        ("e2e", "no such query — e2e\n\nhint: did you mean e2e-latency"),
        ("cpu-usage", "fleet open RUN, then msgflow query scheduling --measure cpu"),
        ("bottleneck", "fleet open RUN, then msgflow query critical-path"),
        ("jitter", "msgflow fleet query timers or msgflow fleet query topics --measure rate"),
    ):
        with pytest.raises(UsageError, match=words):
            fleet_query(night, name)
    result = run("query", "flows", "--lake", night.store.url)
    assert result.exit_code == 2
    assert "a lake does not hold what this query needs" in result.stderr
    listed = run("query").stdout
    assert all(header_of(name).words in listed for name in names())
    result = CliRunner().invoke(
        app, ["fleet", "query", "topics", "--measure", "delivery"], env={"MSGFLOW_LAKE": ""}
    )
    assert result.exit_code == 2
    assert "no lake is named" in result.stderr


def test_sql_reads_the_chosen_runs_and_nothing_else(night: Lake, tmp_path: Path) -> None:
    found = fleet_sql(
        night,
        "SELECT labels['robot'] AS robot, count(DISTINCT run) AS runs "
        "FROM flow JOIN run USING (run) GROUP BY ALL ORDER BY ALL",
    )
    assert found.table.to_pylist() == [{"robot": "r1", "runs": 2}, {"robot": "r2", "runs": 1}]
    chosen = fleet_sql(night, "SELECT count(*) AS n FROM run", where="robot = 'r1'")
    assert chosen.table["n"].to_pylist() == [2]
    tables = fleet_sql(night, "SHOW ALL TABLES").table
    assert {"flow", "timers", "run"} <= set(tables["name"].to_pylist())
    listed = fleet_sql(night, "SELECT table_name FROM information_schema.tables").table
    assert {"flow", "timers", "run"} <= set(listed["table_name"].to_pylist())
    capped = fleet_sql(night, "FROM view.topic", limit=1)
    assert (len(capped), len(capped.notes)) == (1, 1)
    target = tmp_path / "x.csv"
    for text in (
        f"COPY run TO '{target}'",
        "FROM read_parquet('/etc/passwd')",
        "CREATE TABLE x AS FROM run",
        "SET threads = 1",
        "DROP VIEW flow",
        "ATTACH ':memory:' AS x",
        "FROM 'x.parquet'",
        "SELECT getenv('HOME')",
        "SELECT nothing FROM run",
        "FROM no_table",
    ):
        with pytest.raises(QueryError):
            fleet_sql(night, text)
    assert not target.exists()
    with pytest.raises(UsageError, match="no SQL to run"):
        fleet_sql(night, " -- nothing")
    result = run("sql", "SELECT count(*) AS n FROM run", "--lake", night.store.url, "--format=csv")
    assert result.stdout.split() == ['"n"', "3"]


def test_the_worst_flows_come_with_what_opens_them(night: Lake) -> None:
    flows = fleet_sql(
        night,
        "SELECT run, latency_ns FROM flow WHERE is_first AND status = 'reached' AND path = "
        "(SELECT min(path) FROM flow WHERE run = repeat('c', 20)) ORDER BY latency_ns DESC LIMIT 5",
        where="robot = 'r1'",
    ).table
    (path,) = (
        fleet_sql(night, "SELECT min(path) AS path FROM flow WHERE run = repeat('c', 20)")
        .table["path"]
        .to_pylist()
    )
    found = fleet_worst(night, path, where="robot = 'r1'", limit=5)
    assert found.table["latency_ns"].to_pylist() == flows["latency_ns"].to_pylist()
    assert found.table["name"][0].as_py() == "copy"
    assert found.table["labels"][0].as_py() == ["robot=r1", "software_version=1.1"]
    # Its database is not in the lake.
    assert found.table["command"][0].as_py() is None
    assert found.notes == ["runs without a command were written with --no-database"]
    first = fleet_worst(night, path.split(" ")[2], where="name = 'first'", limit=1)
    (row,) = first.table.to_pylist()
    assert first.notes == [f"the slowest one: {row['command']}"]
    kind = row["root_kind"].replace("_", "-")
    assert row["command"] == (
        f"msgflow fleet open {row['run']} --lake {night.store.url} && "
        f"msgflow flow --db {row['run']}.duckdb --{kind} {row['root_id']}"
    )
    with pytest.raises(UsageError, match=r"no flow of these runs .* — /nowhere"):
        fleet_worst(night, "/nowhere")
    result = run(
        "worst", path, "--lake", night.store.url, "--where", "name = 'copy'", "--format", "json"
    )
    assert '"name": "copy"' in result.stdout or '"name":"copy"' in result.stdout


def test_nobody_waits_for_pandas(night: Lake) -> None:
    """It is imported by pyarrow for values of Python, and takes longer than a small question."""
    program = (
        "import sys; from msgflow.fleet.lake_query import fleet_query; "
        "from msgflow.fleet.lake import Lake; "
        "fleet_query(Lake.open(sys.argv[1]), 'e2e-latency', where=\"robot = 'r1'\"); "
        "assert 'pandas' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", program, night.store.url], check=True)


def test_columns_of_headers_have_meanings() -> None:
    for name in STATEMENTS.names():
        header = STATEMENTS.header(name)
        assert all(dataclasses.astuple(column)[3] for column in header.columns), name


def test_a_lake_of_an_earlier_version_that_lacks_a_column(night: Lake, tmp_path: Path) -> None:
    """The error names the column and what to do; what does not need it is answered."""
    folder = tmp_path / "lake"
    shutil.copytree(night.store.url, folder)
    for file in folder.glob("topics_delivery/*.parquet"):
        rows = pq.read_table(file, partitioning=None)
        pq.write_table(rows.drop_columns(["cut_by_recording"]), file)
    lake = Lake.open(folder)
    assert len(fleet_query(lake, "e2e-latency"))
    with pytest.raises(DatabaseError) as refused:
        fleet_query(lake, "topics-delivery")
    assert "lacks what topics-delivery needs (cut_by_recording): an earlier" in str(refused.value)
    assert "msgflow fleet ingest SOURCE --lake" in str(refused.value.hint)
