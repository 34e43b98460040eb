"""Recordings with kernel traces, of LTTng and of perf, against what is known of their callbacks."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import duckdb
import pytest
from support.ingested import made_once
from support.thorough import few

from msgflow.ingest import ingest

ByLttng = Callable[[str], duckdb.DuckDBPyConnection]

RECORDED = ("pipeline", "mutex", "cond", "autoware", "nodump")

TRUTH = """
CREATE TEMP TABLE compared AS
SELECT
    t.*,
    s.running_ns,
    s.preempted_ns AS lost_ns,
    s.runnable_ns AS woken_ns,
    s.sleeping_ns + s.uninterruptible_ns AS waited_ns,
    s.unknown_ns,
    s.preemption_count,
    s.migration_count,
    s.irq_ns AS interrupt_ns,
    s.softirq_ns AS later_ns,
    s.callback_instance_id,
    i.end_ns - i.start_ns AS duration_ns
FROM read_csv($truth) AS t
LEFT JOIN (
    SELECT i.*, x.tid AS thread_number, p.pid
    FROM callback_instance AS i
    JOIN thread AS x ON i.thread_id = x.thread_id
    JOIN process AS p ON i.process_id = p.process_id
) AS i ON t.vpid = i.pid AND t.vtid = i.thread_number AND t.start = i.start_ns
LEFT JOIN callback_schedule AS s ON i.callback_instance_id = s.callback_instance_id
WHERE t.covered = 1 AND t.repaired = 0
"""


# The truth has the kernel's number of each thread, ours that of its namespace: names and times have
# to be equal. It calls an idle CPU by its number.
PREEMPTORS = """
WITH ours AS (
    SELECT
        p.callback_instance_id AS id, coalesce(o.name, t.name) AS name,
        p.preempted_ns + p.runnable_ns AS length_ns
    FROM callback_preemptor AS p
    LEFT JOIN thread AS t ON p.preemptor_thread_id = t.thread_id
    LEFT JOIN other_thread AS o ON p.preemptor_other_thread_id = o.other_thread_id
),
theirs AS (
    SELECT id, regexp_replace(thread, '/[0-9]+$', '') AS name, sum(length_ns)::BIGINT AS length_ns
    FROM (
        SELECT
            callback_instance_id AS id,
            CASE WHEN who NOT LIKE 'swapper%' THEN regexp_replace(who, '=[0-9]+$', '') END
                AS thread,
            regexp_extract(who, '[0-9]+$')::BIGINT AS length_ns
        FROM (
            SELECT callback_instance_id, unnest(string_split(preemptors, ';')) AS who FROM compared
        )
    )
    GROUP BY id, thread
)
SELECT * FROM (
    SELECT * FROM ours WHERE id IN (SELECT callback_instance_id FROM compared)
    EXCEPT ALL SELECT * FROM theirs
) UNION ALL (SELECT * FROM theirs EXCEPT ALL SELECT * FROM ours) LIMIT 5
"""


# The kernel counts for each thread how often it lost its CPU. The moments at which callbacks read
# that are not quite their begin and end. (The table of the truth counts waits by CPU.)
COUNTED = """
SELECT count(*) FILTER (WHERE c.preemption_count <> t.nivcsw) < 0.008 * count(*)
FROM compared AS c
JOIN callback_instance AS i ON c.callback_instance_id = i.callback_instance_id
JOIN thread AS x ON i.thread_id = x.thread_id
JOIN process AS p ON x.process_id = p.process_id
JOIN read_json($truth, format = 'newline_delimited', columns = {
    'vpid': 'INTEGER', 'vtid': 'INTEGER', 'start': 'BIGINT', 'nivcsw': 'BIGINT'
}) AS t
    ON p.pid = t.vpid AND x.tid = t.vtid AND i.start_ns = t.start
WHERE t.nivcsw IS NOT NULL
"""


def compared(path: Path, recording: Path) -> duckdb.DuckDBPyConnection:
    """Join what an ingest found with the truth in the table `compared`."""
    con = duckdb.connect(str(path), read_only=True)
    con.execute(TRUTH, {"truth": str(recording / "kernel_truth.csv.gz")})
    return con


@pytest.fixture
def by_lttng(shared_kernel: Path, tmp_path_factory: pytest.TempPathFactory) -> ByLttng:
    """Compares a recording as LTTng has made it, which is read once for all tests."""

    def get(name: str) -> duckdb.DuckDBPyConnection:
        def make(path: Path) -> None:
            ingest([shared_kernel / name / "trace-chrisnux"], path)

        return compared(made_once(tmp_path_factory, f"kernel_{name}", make), shared_kernel / name)

    return get


# The threads of the emulated middleware have the name of their process, as those of old versions of
# Fast DDS: any other thread of it may have that. They get the names that real ones have today.
NAMED = """
CREATE TEMP TABLE named AS SELECT name FROM store.process;
UPDATE store.other_thread SET name = 'dds.' || name WHERE name IN (FROM named);
UPDATE store.thread SET name = 'dds.' || name
WHERE name IN (FROM named) AND thread_id NOT IN (SELECT thread_id FROM store.callback_instance);
"""


@pytest.fixture
def named(shared_kernel: Path, by_lttng: ByLttng, tmp_path: Path) -> ByLttng:
    """The same, with threads of the middleware that show what they are."""

    def get(name: str) -> duckdb.DuckDBPyConnection:
        with by_lttng(name) as con:
            ((path,),) = con.execute(
                "SELECT path FROM duckdb_databases() WHERE database_name = current_database()"
            ).fetchall()
        copy = tmp_path / "named.duckdb"
        shutil.copyfile(path, copy)
        with duckdb.connect(str(copy)) as con:
            con.execute(NAMED)
        return compared(copy, shared_kernel / name)

    return get


@pytest.mark.parametrize("name", few(RECORDED, "pipeline"))
def test_of_lttng(shared_kernel: Path, by_lttng: ByLttng, name: str) -> None:
    con = by_lttng(name)
    wrong = con.execute(
        "SELECT count(*) FROM compared WHERE duration_ns IS NULL "
        "OR abs(running_ns - cpu_ns) > 1000 OR abs(lost_ns - preempted_ns) > 1000 "
        "OR abs(woken_ns - wakeup_ns) > 1000 OR abs(waited_ns - blocked_ns) > 1000 "
        "OR running_ns + lost_ns + woken_ns + waited_ns + unknown_ns <> duration_ns "
        "OR migration_count <> migrations OR preemption_count > preemptions "
        "OR interrupt_ns <> irq_ns OR later_ns <> softirq_ns"
    ).fetchall()
    assert wrong == [(0,)]
    assert con.execute("SELECT count(*) > 1000 FROM compared").fetchall() == [(True,)]
    assert con.execute(PREEMPTORS).fetchall() == []
    counters = {"truth": str(shared_kernel / name / "truth.jsonl.gz")}
    assert con.execute(COUNTED, counters).fetchall() == [(True,)]


@pytest.mark.parametrize("name", few(RECORDED, "cond"))
def test_of_perf(shared_kernel: Path, tmp_path: Path, name: str) -> None:
    """As recorded: what a virtual machine hid is not known, and nothing else differs."""
    recording = shared_kernel / name
    ingest([recording / "trace-chrisnux/ust", recording / "perf"], tmp_path / "run.duckdb")
    con = compared(tmp_path / "run.duckdb", recording)
    assert con.execute(
        "SELECT count(*) FROM compared WHERE unknown_ns = 0 AND (duration_ns IS NULL "
        "OR abs(running_ns - cpu_ns) > 1000 OR abs(waited_ns - blocked_ns) > 1000)"
    ).fetchall() == [(0,)]
    assert con.execute(
        "SELECT count(*) FILTER (WHERE unknown_ns > 0) < 0.01 * count(*) FROM compared"
    ).fetchall() == [(True,)]


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(("pipeline", "autoware"), "pipeline"))
def test_arrivals(by_lttng: ByLttng, named: ByLttng, name: str) -> None:
    """All that are exact have the waker that the truth has before their callback."""
    exactly = "SELECT count(*) FROM arrival WHERE is_exact AND waker_kind = 'thread'"
    ((unnamed,),) = by_lttng(name).execute(exactly).fetchall()
    assert unnamed <= 1
    con = named(name)
    ((callbacks, exact, wrong),) = con.execute(
        "SELECT count(*), count(*) FILTER (a.is_exact), count(*) FILTER (a.is_exact AND "
        "split_part(c.start_wake_waker, '/', 1) IS DISTINCT FROM "
        "a.waker_kind || ':' || replace(a.waker_name, 'dds.', '')) "
        "FROM compared AS c "
        "JOIN callback_instance AS i ON c.callback_instance_id = i.callback_instance_id "
        "LEFT JOIN arrival AS a ON i.take_id = a.take_id WHERE i.take_id IS NOT NULL"
    ).fetchall()
    assert wrong == 0
    # Of others the thread was awake, or did something else first.
    assert exact > 0.45 * callbacks


@pytest.mark.thorough
@pytest.mark.parametrize("name", few(("pipeline", "autoware"), "pipeline"))
def test_waits(named: ByLttng, name: str) -> None:
    """Where the arrival is exact, the time in the run queue is that of the truth.

    What is left of such a wait is the work of the executor: it looks for what is ready, and takes.
    Once in thousands a page is missing meanwhile, and the thread waits for a CPU again.
    """
    con = named(name)
    ((waits, equal, wrong, shortest, longest),) = con.execute(
        "SELECT count(*), count(*) FILTER (w.run_queue_ns = c.start_wake_ns), "
        "count(*) FILTER (w.run_queue_ns < c.start_wake_ns OR w.busy_max_ns > 0 "
        "OR list_sum(w.cpu_taken_ns) > w.run_queue_ns + w.preempted_ns), "
        "min(rest_ns), max(rest_ns) "
        "FROM compared AS c "
        "JOIN (SELECT *, wait_ns - until_arrival_ns - run_queue_ns - preempted_ns AS rest_ns "
        "FROM executor_wait_explained([1]) WHERE until_arrival_ns IS NOT NULL) AS w "
        "ON c.callback_instance_id = w.callback_instance_id"
    ).fetchall()
    assert wrong == 0
    assert waits > 1000
    assert equal > 0.999 * waits
    assert 4_000 < shortest < longest < 80_000


@pytest.mark.parametrize("name", few(("real_jazzy_pipeline", "real_py_timer")))
def test_arrivals_of_real_systems(shared_traces: Path, tmp_path: Path, name: str) -> None:
    path, recording = tmp_path / "run.duckdb", shared_traces / name
    ingest([recording / "ust", recording / "kernel.tar.xz"], path)
    with duckdb.connect(str(path), read_only=True) as con:
        ((takes, exact, wrong),) = con.execute(
            "SELECT count(*), count(*) FILTER (a.is_exact), count(*) FILTER ("
            "a.arrived_ns NOT BETWEEN p.start_ns AND t.taken_ns OR l.latency_ns <> "
            "a.until_arrival_ns + a.run_queue_ns + a.executor_ns) "
            "FROM link_transport AS l "
            "JOIN take AS t ON l.take_id = t.take_id "
            "JOIN publication AS p ON l.publication_id = p.publication_id "
            "LEFT JOIN arrival AS a ON l.take_id = a.take_id"
        ).fetchall()
    assert wrong == 0
    assert exact > 0.8 * takes
