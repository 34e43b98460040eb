"""Traces of OpenTelemetry, read back by the messages of opentelemetry-proto."""

from __future__ import annotations

import base64
import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import duckdb
import pytest
from support.golden import fill_case

from msgflow import Database, UsageError

trace_service_pb2 = pytest.importorskip("opentelemetry.proto.collector.trace.v1.trace_service_pb2")
json_format = pytest.importorskip("google.protobuf.json_format")

SYSTEM = "services"
SYSTEMS = Path(__file__).resolve().parents[1] / "support" / "systems"
_IDS = ("traceId", "spanId", "parentSpanId")


def read_file(path: Path) -> list[Any]:
    """Return the requests of a file. OTLP/JSON differs from other messages in its ids alone."""

    def as_protobuf(fields: dict[str, Any]) -> dict[str, Any]:
        return {
            name: base64.b64encode(bytes.fromhex(value)).decode() if name in _IDS else value
            for name, value in fields.items()
        }

    return [
        json_format.ParseDict(
            json.loads(line, object_hook=as_protobuf),
            trace_service_pb2.ExportTraceServiceRequest(),
        )
        for line in path.read_text().splitlines()
    ]


def spans_of(requests: list[Any]) -> list[dict[str, Any]]:
    """Return all spans as mappings, with the attributes of their resources."""
    return [
        {
            "trace": span.trace_id.hex(),
            "id": span.span_id.hex(),
            "parent": span.parent_span_id.hex(),
            "name": span.name,
            "kind": span.kind,
            "start": span.start_time_unix_nano,
            "end": span.end_time_unix_nano,
            "links": [link.span_id.hex() for link in span.links],
            "status": (span.status.code, span.status.message),
            **values(resource.resource.attributes),
            **values(span.attributes),
        }
        for request in requests
        for resource in request.resource_spans
        for scope in resource.scope_spans
        for span in scope.spans
    ]


def values(attributes: Any) -> dict[str, Any]:
    return {each.key: getattr(each.value, each.value.WhichOneof("value")) for each in attributes}


@pytest.fixture
def database(simulated: Callable[..., Path]) -> Iterator[Database]:
    with Database(simulated(SYSTEM, 0.1)) as opened:
        yield opened


def test_a_file_has_everything_that_is_not_of_ros_itself(
    database: Database, tmp_path: Path
) -> None:
    written = database.export_otlp(tmp_path / "traces.json")
    spans = spans_of(read_file(tmp_path / "traces.json"))
    assert (len(spans), len({span["trace"] for span in spans})) == (written.spans, written.traces)
    assert len({span["id"] for span in spans}) == len(spans)
    found = {
        (kind, span[f"msgflow.{kind}_id"])
        for span in spans
        for kind in ("callback_instance", "publication", "take", "request", "response")
        if f"msgflow.{kind}_id" in span
    }
    assert found == set(
        database.connection.sql(
            "SELECT 'callback_instance', callback_instance_id FROM callback_instance"
            " JOIN callback_label USING (callback_id) WHERE NOT is_internal"
            " UNION ALL SELECT 'publication', publication_id FROM publication"
            " LEFT JOIN publisher USING (publisher_id) WHERE is_internal IS NOT true"
            " UNION ALL SELECT 'take', take_id FROM take"
            " LEFT JOIN subscription USING (subscription_id) WHERE is_internal IS NOT true"
            " UNION ALL SELECT 'request', request_id FROM request"
            " JOIN client USING (client_id) WHERE NOT is_internal"
            " UNION ALL SELECT 'response', response_id FROM response"
            " JOIN client USING (client_id) WHERE NOT is_internal"
        ).fetchall()
    )
    assert len(found) > 50


def test_parents_and_links_are_the_causes(database: Database, tmp_path: Path) -> None:
    database.export_otlp(tmp_path / "traces.json")
    spans = {span["id"]: span for span in spans_of(read_file(tmp_path / "traces.json"))}

    def vertex(span: dict[str, Any]) -> tuple[str, int]:
        (name,) = [name for name in span if name.startswith("msgflow.") and name.endswith("_id")]
        return name.removeprefix("msgflow.").removesuffix("_id"), span[name]

    found = {
        (*vertex(spans[cause]), *vertex(span))
        for span in spans.values()
        for cause in [*filter(None, [span["parent"]]), *span["links"]]
    }
    written = {vertex(span) for span in spans.values()}
    assert found == {
        (from_kind, from_id, to_kind, to_id)
        for from_kind, from_id, to_kind, to_id in database.connection.sql(
            "SELECT from_kind, from_id, to_kind, to_id FROM flow_edge"
        ).fetchall()
        if {(from_kind, from_id), (to_kind, to_id)} <= written
    }
    for span in spans.values():
        # Jaeger calls a span without a duration a damaged one.
        assert span["end"] > span["start"]
        if span["parent"]:
            assert spans[span["parent"]]["trace"] == span["trace"]


def test_spans_say_what_they_are_in_the_words_of_opentelemetry(
    database: Database, tmp_path: Path
) -> None:
    database.export_otlp(tmp_path / "traces.json")
    spans = spans_of(read_file(tmp_path / "traces.json"))
    kinds = {}
    for span in spans:
        # Of some publishers the topic is not known.
        if span["kind"] != 4 or "messaging.destination.name" in span:
            kinds.setdefault(span["kind"], span)
        assert {"service.name", "host.name", "process.pid", "thread.id"} <= span.keys()
    internal, server, client, producer, consumer = (kinds[kind] for kind in range(1, 6))
    assert internal["name"].startswith(("Timer(", "response "))
    assert server["rpc.method"] == client["rpc.method"]
    assert client["name"] == f"request {client['rpc.method']}"
    topic = producer["messaging.destination.name"]
    assert producer["name"] == f"publish {topic}"
    assert producer["messaging.operation.type"] == "send"
    assert consumer["messaging.operation.type"] in ("receive", "process")
    assert {span["messaging.system"] for span in (producer, consumer)} == {"ros2"}
    takes = {span["msgflow.take_id"]: span for span in spans if "msgflow.latency_ns" in span}
    latencies = {take: span["msgflow.latency_ns"] for take, span in takes.items()}
    assert (
        latencies.items()
        <= dict(
            database.connection.sql("SELECT take_id, latency_ns FROM link_transport").fetchall()
        ).items()
    )
    # Some messages are taken before the call that publishes them returns.
    for take, span in takes.items():
        assert span["end"] - span["start"] == max(latencies[take], 1)
    assert len(takes) > 5


def test_what_has_several_possible_causes_says_so(
    simulated: Callable[..., Path], tmp_path: Path
) -> None:
    path = Path(shutil.copy(simulated(SYSTEM, 0.1), tmp_path / "run.duckdb"))
    with duckdb.connect(str(path)) as connection:
        connection.execute("UPDATE store.link_transport SET candidate_count = 2")
        connection.execute(
            "UPDATE store.link_causal SET candidate_count = 3 WHERE publication_id % 2 = 0"
        )
    with Database(path) as database:
        database.export_otlp(tmp_path / "traces.json")
    for span in spans_of(read_file(tmp_path / "traces.json")):
        wanted = None
        if "msgflow.latency_ns" in span:
            wanted = 2
        elif span.get("msgflow.link") == "direct" and "msgflow.publication_id" in span:
            wanted = None if span["msgflow.publication_id"] % 2 else 3
        assert span.get("msgflow.candidate_count") == wanted, span


@pytest.mark.thorough
def test_further_causes_are_links(simulated: Callable[..., Path], tmp_path: Path) -> None:
    with Database(simulated("partial_sync", 0.1)) as database:
        written = database.export_otlp(tmp_path / "traces.json")
        (expected,) = database.connection.sql(
            "SELECT count(*) FROM flow_edge WHERE link_kind IN ('partial_sync', 'periodic_async')"
        ).fetchall()
    spans = {span["id"]: span for span in spans_of(read_file(tmp_path / "traces.json"))}
    links = [(span, spans[cause]) for span in spans.values() for cause in span["links"]]
    assert (written.links,) == expected
    assert len(links) == written.links > 0
    for span, cause in links:
        # The callback that it was published in is the parent.
        assert span["msgflow.link"] == "direct"
        assert span["trace"] != cause["trace"]


@pytest.mark.thorough
def test_a_chosen_flow_is_one_trace_through_a_cache(
    simulated: Callable[..., Path], tmp_path: Path
) -> None:
    with Database(simulated("partial_sync", 0.1)) as database:
        (slowest,) = database.query("flows", slowest=1).to_arrow().to_pylist()
        written = database.export_otlp(tmp_path / "traces.json", slowest=1)
    spans = spans_of(read_file(tmp_path / "traces.json"))
    ends = [span for span in spans if span.get("msgflow.take_id") == slowest["take_id"]]
    roots = [
        span
        for span in spans
        if span.get(f"msgflow.{slowest['root_kind']}_id") == slowest["root_id"]
    ]
    assert written.traces == 1
    assert [span["trace"] for span in ends] == [roots[0]["trace"]]
    assert [span["id"] for span in spans if not span["parent"]] == [roots[0]["id"]]
    assert roots[0]["start"] == slowest["root_ns"]
    assert max(span["end"] for span in spans) == slowest["sink_ns"]


@pytest.mark.thorough
def test_flows_are_chosen_by_their_paths(simulated: Callable[..., Path], tmp_path: Path) -> None:
    named = tmp_path / "paths.yaml"
    named.write_text("paths: [{name: drive, from: /camera/image, to: /base/motors}]")
    with Database(simulated("demo", 0.1)) as database:
        reached = [
            row
            for row in database.query("flows", from_="/camera/image", to="/base/motors")
            .to_arrow()
            .to_pylist()
            if row["take_id"] is not None
        ]
        written = database.export_otlp(tmp_path / "traces.json", path="drive", paths=named)
        some = database.export_otlp(tmp_path / "some.json", path="drive", paths=named, start="0.5")
        assert 0 < some.traces < written.traces
        with pytest.raises(UsageError, match="--path says where flows begin and end — drive"):
            database.export_otlp(tmp_path / "traces.json", path="drive", paths=named, to="/x")
        with pytest.raises(UsageError, match="/nowhere"):
            database.export_otlp(tmp_path / "traces.json", to="/nowhere")
    spans = spans_of(read_file(tmp_path / "traces.json"))
    assert len(reached) > 2
    assert {span["msgflow.take_id"] for span in spans if "msgflow.take_id" in span} >= {
        row["take_id"] for row in reached
    }
    assert written.traces == len({row["root_id"] for row in reached})


def test_a_message_that_was_lost_is_an_error(fresh_database: Path, tmp_path: Path) -> None:
    with duckdb.connect(str(fresh_database)) as connection:
        fill_case(connection, SYSTEMS / "every_delivery.case")
        expected = connection.sql(
            "SELECT DISTINCT publication_id FROM stat_delivery WHERE status IN ('dropped', 'lost')"
        ).fetchall()
    with Database(fresh_database) as database:
        database.export_otlp(tmp_path / "traces.json")
    spans = spans_of(read_file(tmp_path / "traces.json"))
    errors = {span["msgflow.publication_id"]: span for span in spans if span["status"][0] == 2}
    assert set(errors) == {publication for (publication,) in expected} != set()
    assert any(": overwritten" in span["status"][1] for span in errors.values())


def test_a_collector_is_no_file(database: Database) -> None:
    with pytest.raises(UsageError, match="written to a file") as raised:
        database.export_otlp("http://localhost:4318/v1/traces")
    assert "otlpjsonfile" in str(raised.value.hint)
