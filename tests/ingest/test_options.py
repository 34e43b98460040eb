"""Options of an ingest, and what it reports."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path

import duckdb
import pytest
from support.ingested import rows
from support.thorough import thorough

from msgflow import open_db
from msgflow.ingest import IngestProgress, ingest
from msgflow.ingest.hostnames import hostnames_of
from msgflow.trace import open as open_traces

Make = Callable[..., Path]
FIELDS = {
    "ros2:rclcpp_publish": {"message": "u64"},
    "ros2:rcl_publish": {"publisher_handle": "u64", "message": "u64"},
    "ros2:rmw_publish": {"message": "u64"},
    "dds:write_pre": {"writer": "u64", "data": "u64"},
    "dds:write": {"writer": "u64", "timestamp": "i64"},
    "ros2:from_the_future": {"x": "i32"},
    "my_app:started": {"x": "i32"},
}
EVENTS = [
    ("ros2:rclcpp_publish", (0xA,)),
    ("ros2:rcl_publish", (0x10, 0xA)),
    ("ros2:rmw_publish", (0xA,)),
    ("dds:write_pre", (0x20, 0xA)),
    ("dds:write", (0x20, 777)),
    ("ros2:from_the_future", (1,)),
    ("ros2:from_the_future", (2,)),
    ("my_app:started", (1,)),
]


@pytest.mark.parametrize(
    ("ignore", "stamp", "is_layer"), [thorough((), 777, True), (("dds:*",), None, False)]
)
def test_events_may_be_ignored(
    make_trace: Make, new_database: Path, ignore: tuple[str, ...], stamp: int | None, is_layer: bool
) -> None:
    """Everything is counted all the same; only what the catalogue lacks is reported."""
    report = ingest([make_trace(FIELDS, EVENTS)], new_database, ignore=ignore)
    assert report.event_count == len(EVENTS)
    assert rows(
        new_database, "SELECT source_timestamp_ns, dds_ns IS NOT NULL FROM publication"
    ) == [(stamp, is_layer)]
    assert rows(new_database, "SELECT event_count FROM trace") == [(len(EVENTS),)]
    (unknown,) = (d for d in report.findings if d.name == "unknown_event")
    assert (unknown.severity, unknown.count) == ("info", 3)
    assert "my_app:started (1), ros2:from_the_future (2)" in unknown.detail


@pytest.mark.parametrize(
    ("calls", "ignore", "has_both"),
    [
        thorough(("send_request", "take_request"), (), True),
        (("send_request",), (), False),
        thorough(("take_request",), (), False),
        thorough(("send_request", "take_request"), ("*:rmw_send_request",), False),
    ],
)
def test_a_trace_says_whether_it_would_show_requests(
    make_trace: Make,
    new_database: Path,
    calls: tuple[str, ...],
    ignore: tuple[str, ...],
    has_both: bool,
) -> None:
    """At both ends, and also if there were none."""
    fields = {f"ros2:rmw_{call}": {"sequence_number": "i64"} for call in calls}
    ingest([make_trace(FIELDS | fields, EVENTS)], new_database, ignore=ignore)
    assert rows(new_database, "SELECT has_request_events FROM trace") == [(has_both,)]


@pytest.mark.thorough
def test_what_was_ignored_is_told(make_trace: Make, new_database: Path) -> None:
    """And what is ignored in vain, as a mistyped name is."""
    report = ingest(
        [make_trace(FIELDS, EVENTS)],
        new_database,
        ignore=("dds:*", "dds:write", "dsd:*", "ros2:rcl_take"),
    )
    told = {d.name: (d.severity, d.count, d.detail) for d in report.findings}
    assert told["ignored_events"] == (
        "warning",
        2,
        "events that were left out on request: dds:* (2), dds:write (1)",
    )
    assert told["ignored_nothing"] == (
        "warning",
        2,
        "patterns of events to leave out that match none: dsd:*, ros2:rcl_take",
    )
    assert rows(new_database, "SELECT count(*) FROM finding WHERE name LIKE 'ignored_%'") == [(2,)]


@pytest.mark.thorough
def test_staging_can_be_kept_and_progress_is_told(
    trace: Path, new_database: Path, tmp_path: Path
) -> None:
    """Events as read and the objects of the model, as Parquet; nothing else is left.

    The program has its own handlers of signals again.
    """
    kept = tmp_path / "kept" / "staging"
    seen: list[IngestProgress] = []
    handlers = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    report = ingest([trace], new_database, keep_staging=kept, progress=seen.append)
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == handlers
    files = {path.name for path in kept.iterdir()}
    assert {"raw.ros2_rcl_publish.parquet", "raw.packet.parquet"} <= files
    assert {"staging.publication.parquet", "staging.take_chain.parquet"} <= files
    with duckdb.connect() as connection:
        (count,) = connection.execute(
            f"SELECT count(*) FROM '{kept}/raw.ros2_rcl_publish.parquet'"
        ).fetchone()
        (events,) = connection.execute(
            f"SELECT sum(event_count) FROM '{kept}/raw.packet.parquet'"
        ).fetchone()
    assert (count,) == rows(
        new_database, "SELECT count(*) FROM publication WHERE rcl_ns IS NOT NULL"
    )[0]
    assert events == report.event_count
    assert [path.name for path in new_database.parent.iterdir()] == [new_database.name]

    stages = list(dict.fromkeys(state.stage for state in seen))
    assert stages == list(report.stage_seconds)
    assert stages[:2] == ["opening the traces", "reading the traces"]
    fractions = [state.fraction for state in seen if state.fraction is not None]
    assert fractions == sorted(fractions)
    assert all(0 <= fraction <= 1 for fraction in fractions)
    assert max(state.events for state in seen) <= report.event_count
    assert report.seconds == pytest.approx(sum(report.stage_seconds.values()))
    with open_db(new_database) as opened:
        assert opened.check() == []
    assert rows(new_database, "SELECT run_id, name, event_count FROM store.run") == [
        (report.run_id, report.run_name, report.event_count)
    ]


def test_hosts_can_be_named(other_trace: Path, new_database: Path) -> None:
    """All traces below a path; the others keep the name that they recorded.

    A session is found from any directory above; the same one named twice is read once.
    """
    report = ingest(
        [other_trace.parent, other_trace / "alpha"],
        new_database,
        hosts={"robot": str(other_trace / "alpha")},
    )
    assert rows(
        new_database,
        "SELECT hostname, count(*) FROM host JOIN process USING (host_id) GROUP BY 1 ORDER BY 1",
    ) == [("beta", 1), ("robot", 2)]
    assert rows(new_database, "SELECT sum(event_count)::BIGINT FROM trace") == [
        (report.event_count,)
    ]
    assert report.run_name == other_trace.parent.name


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"base": [""], "arm": ["beta"]}, {"alpha": "base", "beta": "arm"}),
        ({"arm": ["beta"], "base": [""]}, {"alpha": "base", "beta": "arm"}),
        ({"robot": ["alpha", "beta"]}, {"alpha": "robot", "beta": "robot"}),
    ],
)
def test_the_deepest_of_several_paths_names_a_host(
    other_trace: Path, given: dict[str, list[str]], expected: dict[str, str]
) -> None:
    hosts = {name: [other_trace / path for path in paths] for name, paths in given.items()}
    with open_traces([other_trace]) as traces:
        # What an ingest does with it is shown above.
        names = hostnames_of(traces.traces, hosts)
        found = {
            trace.path.relative_to(other_trace).parts[0]: names[trace.index]
            for trace in traces.traces
        }
    assert found == expected
