"""What holds for every system: random ones, a few each."""

from __future__ import annotations

from collections import defaultdict
from random import Random
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.analysis import Analysis
from support.fates import FATES
from support.random_system import random_system
from support.ros_system import RosSystem
from support.thorough import examples

from msgflow.db.store_table import store_tables
from msgflow.ingest.catalogue import load
from msgflow.query.catalogue import load_query
from msgflow.query.runner import run_query

SEEDS = st.integers(0, 10_000)
FEW = settings(
    max_examples=examples(1, 2),
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
FLOWS = (
    "SELECT * FROM end_to_end([1], NULL, NULL, 'callback_start', 'callback_end', "
    "-9223372036854775808, 9223372036854775807) ORDER BY ALL"
)
# Payload fields that hold a time, or an object that other events refer to.
STAMPS = {"timestamp", "source_timestamp", "source_stamp"}
HANDLES = {
    field.name
    for tracepoint in load().tracepoints.values()
    for field in tracepoint.fields
    if field.type == "UBIGINT"
}


def outputs(analysis: Analysis, hidden: frozenset[str] = frozenset()) -> dict[str, Any]:
    """All rows of the model and its flows, without the columns named."""
    result = {}
    # All of it at once, not what one table needs after the other.
    assert analysis.connection
    for table in store_tables().values():
        if "run_id" not in table.columns or table.name == "run":
            continue
        names = [name for name in table.columns if name not in hidden]
        result[table.name] = analysis.rows(
            f"SELECT {', '.join(names)} FROM store.{table.name} ORDER BY ALL"
        )
    result["end_to_end"] = analysis.rows(FLOWS)
    return result


def changed(system: RosSystem, change: Any) -> RosSystem:
    """Return the system with `change` applied to the columns of every event."""
    copy = RosSystem()
    copy.sources = dict(system.sources)
    for name, row in system.ordered():
        values = {key: change(key, value) for key, value in row.items()}
        copy.add_row(name, values)
    return copy


@pytest.mark.thorough
@FEW
@given(seed=SEEDS, shift=st.sampled_from([-900, 1, 1_700_000_000_000_000_000]))
def test_shifting_all_times_shifts_all_outputs(analysis: Analysis, seed: int, shift: int) -> None:
    system = random_system(seed)
    analysis.build(system)
    before = outputs(analysis)

    def later(key: str, value: Any) -> Any:
        return value + shift if key == "ts_ns" or (key in STAMPS and value) else value

    analysis.build(changed(system, later))
    after = outputs(analysis)
    columns = {
        name: [row[0] for row in analysis.rows(f"SELECT column_name FROM (DESCRIBE {query}) ")]
        for name, query in {
            **{n: f"FROM store.{n}" for n in before if n != "end_to_end"},
            "end_to_end": FLOWS,
        }.items()
    }
    durations = {"latency_ns", "period_ns", "offset_ns", "uncertainty_ns"}
    for name, rows in before.items():
        assert after[name] == [
            tuple(
                value + shift
                if column.endswith("_ns")
                and column not in durations
                and value is not None
                and not (name == "clock" and value == 0)
                else value
                for column, value in zip(columns[name], row, strict=True)
            )
            for row in rows
        ]


@pytest.mark.thorough
@FEW
@given(seed=SEEDS)
def test_the_values_of_handles_do_not_matter(analysis: Analysis, seed: int) -> None:
    """Any other addresses, with another order among them, give the same."""
    system = random_system(seed)
    found = sorted(
        {
            value
            for _, row in system.ordered()
            for key, value in row.items()
            if key in HANDLES and value
        }
    )
    others = [2**63 + 16 * n for n in range(len(found))]
    Random(seed).shuffle(others)
    permuted = dict(zip(found, others, strict=True))
    hidden = frozenset(
        name
        for table in store_tables().values()
        for name in table.columns
        if name.endswith("_handle")
    )
    analysis.build(system)
    before = outputs(analysis, hidden)
    analysis.build(
        changed(system, lambda key, value: permuted.get(value, value) if key in HANDLES else value)
    )
    assert outputs(analysis, hidden) == before


def exact_links(analysis: Analysis) -> set[tuple[Any, ...]]:
    """Links by equal stamps, named by the events that carry the stamps."""
    return set(
        analysis.rows(
            "SELECT b.rmw_ns, t.taken_ns FROM link_transport JOIN publication AS b "
            "USING (publication_id) JOIN take AS t USING (take_id)"
        )
    )


@settings(FEW, max_examples=examples(1, 4))
@given(seed=SEEDS, share=st.sampled_from([0.02, 0.3, 0.7]))
def test_removing_events_creates_no_link(analysis: Analysis, seed: int, share: float) -> None:
    system = random_system(seed)
    before = exact_links(analysis.build(system))
    random = Random(seed)
    copy = RosSystem()
    copy.sources = dict(system.sources)
    for name, row in system.ordered():
        if random.random() > share:
            copy.add_row(name, row)
    assert exact_links(analysis.build(copy)) <= before


@settings(FEW, max_examples=examples(1, 3))
@given(seed=SEEDS, deleted=st.sampled_from([0.0, 0.1, 0.5]))
def test_completeness_adds_up(analysis: Analysis, seed: int, deleted: float) -> None:
    """Every root of every path is counted once, though messages and callbacks are missing."""
    random = Random(seed)
    system = RosSystem()
    whole = random_system(seed, actions=60)
    system.sources = dict(whole.sources)
    for name, row in whole.ordered():
        if not name.endswith(("_take", "_publish", "callback_end")) or random.random() >= deleted:
            system.add_row(name, row)
    analysis.build(system)
    roots: dict[int, set[int]] = defaultdict(set)
    for publisher, root in analysis.rows(
        "SELECT DISTINCT b.publisher_id, coalesce(i.callback_instance_id, -b.publication_id)"
        " FROM publication AS b JOIN publisher AS p USING (publisher_id) "
        "LEFT JOIN link_causal AS l USING (publication_id) "
        "LEFT JOIN callback_instance AS i ON l.callback_instance_id = i.callback_instance_id "
        "WHERE NOT p.is_internal AND i.take_id IS NULL"
    ):
        roots[publisher].add(root)
    paths = analysis.rows(
        "SELECT path, publishers[1] FROM flow_path([1], NULL, NULL) WHERE is_path ORDER BY ALL"
    )
    result = run_query(analysis.connection, load_query("e2e-latency"), {}).to_arrow().to_pylist()
    # Paths with the same nodes and topics are one row: roots of all their publishers.
    started: dict[str, set[int]] = defaultdict(set)
    for path, publisher in paths:
        started[path] |= roots[publisher]
    assert {row["path"]: row["roots"] for row in result} == {
        path: len(those) for path, those in started.items()
    }
    for row in result:
        assert row["roots"] == sum(row[name] for name in FATES), row
        assert row["pairs"] == row["reached"]
        assert (row["min_ns"] is None) == (row["reached"] == 0)


@FEW
@given(seed=SEEDS)
def test_edges_are_what_the_walker_walks(analysis: Analysis, seed: int) -> None:
    """The public view and the links behind the walker are the same."""
    analysis.build(random_system(seed))
    columns = "run_id, from_kind, from_id, to_kind, to_id, link_kind"
    assert analysis.rows(f"SELECT {columns} FROM flow_edge ORDER BY ALL") == analysis.rows(
        f"SELECT {columns} FROM derive.flow_link ORDER BY ALL"
    )
    assert analysis.value("SELECT count(*) FROM flow_edge") > 0


@pytest.mark.thorough
def test_random_systems_are_worth_it(analysis: Analysis) -> None:
    """They have flows of several steps, losses, and callbacks that never ended."""
    depths, statuses, open_callbacks = set(), set(), 0
    for seed in range(2):
        analysis.build(random_system(seed, actions=60))
        depths |= set(analysis.column("SELECT depth FROM flow_path([1], NULL, NULL)"))
        statuses |= set(analysis.column(f"SELECT status FROM ({FLOWS})"))
        open_callbacks += analysis.value(
            "SELECT count(*) FROM callback_instance WHERE end_ns IS NULL"
        )
    assert max(depths) >= 2
    assert {"reached", "lost", "not_connected", "no_output", "unknown"} <= statuses
    assert open_callbacks


@pytest.mark.thorough
def test_the_same_events_give_the_same_rows(analysis: Analysis) -> None:
    analysis.build(random_system(1))
    before = outputs(analysis)
    analysis.build(random_system(2))
    analysis.build(random_system(1))
    assert outputs(analysis) == before
