"""MCAP files, read back by the readers of mcap and mcap-ros2-support."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.golden import fill_case
from support.thorough import thorough

from msgflow import Database, UsageError

reader = pytest.importorskip("mcap.reader")
decoder = pytest.importorskip("mcap_ros2.decoder")

SYSTEMS = Path(__file__).resolve().parents[1] / "support" / "systems"
LOG = "/msgflow/log"


def read(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """Return time and message of each topic, as any reader of ROS 2 messages decodes them."""
    found = defaultdict(list)
    with path.open("rb") as file:
        opened = reader.make_reader(file, decoder_factories=[decoder.DecoderFactory()])
        for schema, channel, message, decoded in opened.iter_decoded_messages():
            assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
            found[channel.topic].append((message.log_time, decoded))
    return dict(found)


def values(topics: dict[str, list[tuple[int, Any]]], begin: str, end: str) -> list[Any]:
    """Return times and values [ns] of all topics with such names, sorted."""
    return sorted(
        (time, round(message.data * 1_000_000))
        for topic, messages in topics.items()
        if topic.startswith(f"/msgflow/{begin}/") and topic.endswith(f"/{end}")
        for time, message in messages
    )


@pytest.fixture
def database(simulated: Callable[..., Path]) -> Iterator[Database]:
    with Database(simulated("demo", 0.1)) as opened:
        yield opened


@pytest.mark.parametrize(
    ("begin", "end", "expected"),
    [
        (
            "path",
            "latency_ms",
            "SELECT root_ns, latency_ns FROM end_to_end([1], NULL, NULL, 'callback_start',"
            " 'callback_end', $start, 9223372036854775807) WHERE status = 'reached' AND is_first",
        ),
        thorough(
            "callback",
            "duration_ms",
            "SELECT start_ns, end_ns - start_ns FROM callback_instance"
            " JOIN callback_label USING (callback_id)"
            " WHERE end_ns IS NOT NULL AND NOT is_internal AND start_ns >= $start",
        ),
        thorough(
            "topic",
            "latency_ms",
            "SELECT taken_ns, latency_ns FROM link_transport JOIN take USING (take_id)"
            " JOIN subscription USING (subscription_id)"
            " WHERE NOT is_internal AND taken_ns >= $start",
        ),
    ],
)
def test_every_value_stands_once_in_its_topic(
    database: Database, tmp_path: Path, begin: str, end: str, expected: str
) -> None:
    database.export_mcap(tmp_path / "run.mcap", start="0.3")
    ((start,),) = database.connection.sql("SELECT start_ns + 300_000_000 FROM run").fetchall()
    rows = database.connection.execute(expected, {"start": start}).fetchall()
    assert values(read(tmp_path / "run.mcap"), begin, end) == sorted(rows)
    assert len(rows) > 10


@pytest.mark.thorough
def test_age_and_waits_have_topics(database: Database, tmp_path: Path) -> None:
    written = database.export_mcap(tmp_path / "run.mcap")
    topics = read(tmp_path / "run.mcap")
    ages = [value for _, value in values(topics, "path", "age_ms")]
    named = database.query("e2e-latency", measure="age").to_arrow().to_pylist()
    assert max(ages) == max(row["max_ns"] for row in named)
    assert len(ages) == sum(row["outputs"] for row in named)
    for end, column in (("wait_min_ms", "busy_min_ns"), ("wait_max_ms", "busy_max_ns")):
        (expected,) = database.connection.sql(
            f"SELECT list([start_ns, {column}] ORDER BY start_ns, {column})"
            " FROM executor_wait JOIN callback_label USING (callback_id)"
            " WHERE NOT is_internal AND busy_max_ns IS NOT NULL"
        ).fetchall()
        assert [list(each) for each in values(topics, "callback", end)] == expected[0]
    assert written.topics == len(topics.keys() - {LOG})
    assert written.values == sum(len(topics[topic]) for topic in topics.keys() - {LOG})


def test_names_are_those_of_topics_of_ros(database: Database, tmp_path: Path) -> None:
    database.export_mcap(tmp_path / "run.mcap")
    names = read(tmp_path / "run.mcap").keys()
    assert "/msgflow/topic/control/cmd/at/base/motors/latency_ms" in names
    assert "/msgflow/path/camera/driver/to/base/motors/latency_ms" in names
    assert "/msgflow/callback/base/motors/Subscription/control/cmd/duration_ms" in names
    assert all(name.replace("/", "").replace("_", "").isalnum() for name in names)


@pytest.mark.thorough
def test_what_was_lost_is_a_warning(fresh_database: Path, tmp_path: Path) -> None:
    with duckdb.connect(str(fresh_database)) as connection:
        fill_case(connection, SYSTEMS / "every_delivery.case")
        expected = connection.sql(
            "SELECT start_ns, reason FROM stat_delivery JOIN publication USING (publication_id)"
            " WHERE status IN ('dropped', 'lost') ORDER BY start_ns, reason"
        ).fetchall()
    with Database(fresh_database) as database:
        written = database.export_mcap(tmp_path / "run.mcap")
    messages = read(tmp_path / "run.mcap")[LOG]
    assert written.losses == len(expected) > 1
    found = sorted((time, message.msg.split("(")[1].split(")")[0]) for time, message in messages)
    assert found == expected
    for time, message in messages:
        assert message.level == 30
        assert message.stamp.sec * 1_000_000_000 + message.stamp.nanosec == time
    assert {message.name for _, message in messages} == {"/viewer", "[process 1]"}


def test_requirements_that_are_not_met_are_errors(database: Database, tmp_path: Path) -> None:
    targets = tmp_path / "targets.yaml"
    targets.write_text(
        "targets:\n"
        "  - path: [/camera/image, /control/cmd]\n"
        "    latency: [max < 1 us, median < 1000 s]\n"
        "  - topic: /camera/image\n"
        "    rate: 1000 kHz ± 1 %\n"
    )
    written = database.export_mcap(tmp_path / "run.mcap", targets=targets)
    failed = [
        row
        for row in database.verify(targets).result.to_arrow().to_pylist()
        if row["verdict"] == "failed"
    ]
    errors = [each for each in read(tmp_path / "run.mcap")[LOG] if each[1].level == 40]
    assert written.violations == len(errors) == len(failed) > 0
    # What is too rare has no worst case: it comes at the end.
    assert None in {row["worst_at_ns"] for row in failed}
    topics = read(tmp_path / "run.mcap")
    end = max(time for name in topics.keys() - {LOG} for time, _ in topics[name])
    assert {time for time, _ in errors} == {row["worst_at_ns"] or end for row in failed}
    assert any("required is max < 1 us" in message.msg for _, message in errors)


def test_a_file_is_of_one_run(tmp_path: Path, small_database: Path) -> None:
    with Database(small_database) as database, pytest.raises(UsageError, match="MCAP"):
        database.export_mcap(tmp_path / "run.mcap", run="all")
