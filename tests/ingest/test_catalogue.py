"""The catalogue is sound in itself, in DuckDB, and against recorded traces."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, get_args

import duckdb
import pyarrow as pa
import pytest

import msgflow.trace
from msgflow.backports import tomllib
from msgflow.files.resources import resource_directory
from msgflow.ingest import catalogue, staging
from msgflow.ingest.cpus import Cpus
from msgflow.ingest.load import without_thread
from msgflow.ingest.sequences import Sequences
from msgflow.trace.columns import COMMON_SCHEMA

TYPES = {"UBIGINT", "BIGINT", "INTEGER", "VARCHAR", "UTINYINT[]", "UBIGINT[]", "INTEGER[]"}
TRACEPOINT_KEYS = {
    "aliases",
    "name",
    "description",
    "fields",
    "since",
    "until",
    "where",
    "is_kernel",
    "is_lasting",
    "role",
    "interrupt",
    "label",
    "sequences",
    "predecessors",
    "is_translated",
    "is_staged",
}
FIELD_KEYS = {"name", "type", "aliases", "since", "until", "where"}
VERSION = re.compile(r"\d+\.\d+\.\d+")
PROVIDERS = {"ros2", "dds", "ros2_caret", "agnocast"}


@pytest.fixture(scope="module")
def entries() -> list[dict[str, Any]]:
    """The file as it is."""
    path = Path(catalogue.__file__).with_name("tracepoints.toml")
    content = tomllib.loads(path.read_text(encoding="utf-8"))
    assert set(content) == {"tracepoint"}
    return list(content["tracepoint"])


def test_entries_are_well_formed(entries: list[dict[str, Any]]) -> None:
    for entry in entries:
        name = entry["name"]
        assert {"name", "description", "fields"} <= set(entry) <= TRACEPOINT_KEYS, name
        assert entry.get("role", "begin") in get_args(catalogue.CpuRole), name
        if entry.get("is_kernel"):
            assert re.fullmatch(r"[a-z_]+", name), name
            assert not {"sequences", "predecessors", "label"} & set(entry), name
        else:
            assert re.fullmatch(r"[a-z0-9_]+:[a-z0-9_]+", name), name
            assert name.partition(":")[0] in PROVIDERS, name
        assert re.fullmatch(r"[A-Z][^\n]*[^.\s]", entry["description"]), name
        assert name.startswith("ros2:") >= ("since" in entry), name
        check_versions(entry, name)


def test_fields_are_well_formed(entries: list[dict[str, Any]]) -> None:
    common = {name for name, _ in catalogue.COMMON_COLUMNS}
    for entry in entries:
        for field in entry["fields"]:
            where = f"{entry['name']}.{field.get('name')}"
            assert {"name", "type"} <= set(field) <= FIELD_KEYS, where
            assert re.fullmatch(r"[a-z_][a-z0-9_]*", field["name"]), where
            assert field["type"] in TYPES, where
            assert field["name"] not in common, where
            check_versions(field, where)


def check_versions(entry: dict[str, Any], where: str) -> None:
    for key in ("since", "until"):
        assert VERSION.fullmatch(entry.get(key, "0.0.0")), where
    numbers = [tuple(map(int, entry[key].split("."))) for key in ("since", "until") if key in entry]
    assert numbers == sorted(numbers), where


def test_names_are_unique(entries: list[dict[str, Any]]) -> None:
    names = [entry["name"] for entry in entries]
    assert len(set(names)) == len(names)
    tables = [tracepoint.table for tracepoint in catalogue.load().tracepoints.values()]
    assert len(set(tables)) == len(tables)
    for entry in entries:
        names = [
            name for field in entry["fields"] for name in (field["name"], *field.get("aliases", ()))
        ]
        assert len(set(names)) == len(names), entry["name"]


def test_pointers_are_unsigned_and_times_signed() -> None:
    for tracepoint in catalogue.load().tracepoints.values():
        for field in tracepoint.fields:
            if field.name.endswith(("_handle", "_addr")):
                assert field.type == "UBIGINT", (tracepoint.name, field.name)
            if field.name.endswith(("stamp", "_length", "depth", "period", "timeout")):
                assert field.type == "BIGINT", (tracepoint.name, field.name)


def test_parts_of_a_name() -> None:
    tracepoint = catalogue.load().tracepoints["ros2_caret:dds_write"]
    assert tracepoint.event == "dds_write"
    assert tracepoint.table == "ros2_caret_dds_write"
    assert [field.name for field in tracepoint.fields] == ["message"]


def test_predecessors_are_of_sequences_that_exist() -> None:
    known = catalogue.load()
    for tracepoint in known.tracepoints.values():
        for before in tracepoint.predecessors:
            members = [t for t in known.tracepoints.values() if before.sequence in t.sequences]
            assert members, tracepoint.name
            assert before.origin in get_args(catalogue.Origin), tracepoint.name
            if before.origin == "label":
                assert all(member.label for member in members), tracepoint.name


def test_tables_take_the_readers_batches() -> None:
    """Once `Sequences` or `Cpus` has put what it finds in the place of the contexts."""
    con = duckdb.connect()
    con.execute("ATTACH ':memory:' AS staging")
    known = catalogue.load()
    sequences, cpus = Sequences(known, [0]), Cpus(known)
    for tracepoint in known.staged.values():
        con.execute(tracepoint.create_table_sql("staging", known))
        schema = pa.schema([*COMMON_SCHEMA, *tracepoint.arrow_schema()])
        row = {"event_id": 1, "ts_ns": 2, "trace_index": 0, "vpid": 3, "vtid": 4}
        batch = pa.RecordBatch.from_pylist([row], schema)
        if tracepoint.role is not None:
            ((_, placed),) = cpus.place([(tracepoint, batch)])
        elif tracepoint.is_kernel:
            _, placed = without_thread(tracepoint, batch)
        else:
            _, placed = sequences.place([(tracepoint, batch)])[0]
        con.register("batch", placed)
        con.execute(f'INSERT INTO staging."{tracepoint.table}" SELECT * FROM batch')
        table = con.execute(f'DESCRIBE staging."{tracepoint.table}"').fetchall()
        given = con.execute("DESCRIBE SELECT * FROM batch").fetchall()
        assert [row[0] for row in table] == placed.schema.names
        types = {row[0]: row[1] for row in table if not row[1].startswith("ENUM")}
        assert types.items() <= {row[0]: row[1] for row in given}.items()


def test_the_alias_of_8_0_0() -> None:
    schema = catalogue.load().arrow_schemas()["ros2:rmw_publish"]
    assert schema.field("rmw_publisher_handle").metadata == {b"aliases": b"publisher_handle"}
    assert schema.field("message").metadata is None


@pytest.mark.thorough
def test_every_recorded_event_is_listed_whole(shared_traces: Path) -> None:
    """Every event and every field that the recorded traces declare."""
    known = catalogue.load().tracepoints
    with msgflow.trace.open([shared_traces]) as traces:
        assert {name for info in traces.traces for name in info.event_names} <= set(known)
        for batch in traces.batches():
            if batch.name != msgflow.trace.PACKET:
                declared = batch.batch.schema.names[len(COMMON_SCHEMA) :]
                fields = known[batch.name].fields
                names = {name for field in fields for name in (field.name, *field.aliases)}
                assert set(declared) <= names, batch.name


def test_everything_that_is_staged_is_read() -> None:
    """By a step of the model or of what comes before it, or as initialisation reported again."""
    known = catalogue.load()
    # `caret_initialisation` puts these into the tables of those of ROS 2.
    again = {f"ros2_caret_{t.event}" for t in known.staged.values() if t.name.startswith("ros2:")}
    text = "\n".join(
        path.read_text(encoding="utf-8")
        for path in resource_directory("schema").rglob("*.sql")
        if path.name not in {"model.sql", "store.sql"}
    )
    words = set(re.findall(r"\w+", re.sub(r"--.*", "", text)))
    assert {t.table for t in known.staged.values()} - words <= again


def test_interrupts_have_the_kinds_of_the_catalogue() -> None:
    with duckdb.connect() as con:
        staging.attach(con, None)
        ((kind,),) = con.execute(
            "SELECT data_type FROM duckdb_columns() WHERE table_name = 'interrupt' "
            "AND column_name = 'kind'"
        ).fetchall()
    assert kind == catalogue.enum_type(catalogue.load().interrupts)
