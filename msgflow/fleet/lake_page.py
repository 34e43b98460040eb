"""The page of a lake: paths by label over time, runs that stand out, slowest flows, failures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

from msgflow.errors import UsageError
from msgflow.files.atomic import replacing
from msgflow.fleet.lake import Lake, list_failures
from msgflow.fleet.lake_connection import Reading, choose, lake_errors
from msgflow.fleet.lake_query import STATEMENTS, fleet_query, header_of
from msgflow.result.query_result import QueryResult
from msgflow.text.shell import shell_quoted
from msgflow.view.assets import single_page
from msgflow.view.table_encoding import encode

# Most labels with a table on the page; each takes a query over all flows.
MOST_LABELS = 8
_STATEMENTS = ("page_run", "page_point", "page_outlier", "page_worst")
_LATENCY, _FINDINGS = "e2e-latency", "info-findings"


@dataclass(frozen=True)
class LakePage:
    """The page of a lake."""

    content: str  # HTML
    runs: int  # number of runs on it
    notes: tuple[str, ...]  # what it leaves out, one sentence each


def lake_page(lake: Lake, *, where: str | None = None) -> LakePage:
    """Return the page of the runs of a lake, with its data inside."""
    choice = choose(lake, where)
    notes = []
    if len(choice.runs) < choice.total:
        notes.append(f"{len(choice.runs):,} of {choice.total:,} runs: {where}")
    parts: dict[str, bytes] = {}
    option = f"--lake {shell_quoted(lake.store.url)}"
    option += f" --where {shell_quoted(where)}" if where else ""
    with Reading(choice, ["flow"]) as reading, lake_errors(lake, is_query=True):
        tables = {
            name: STATEMENTS.run(reading.connection, name, {"count": 10}).to_arrow_table()
            for name in _STATEMENTS
        }
    for name, table in tables.items():
        parts[f"{name}?"] = _encoded(QueryResult(table, STATEMENTS.header(name)))
    result = fleet_query(lake, _LATENCY, where=where)
    command = f"msgflow fleet query {_LATENCY} {option}"
    parts["page_path?"] = _encoded(result, command=command)
    used = {key for pairs in choice.runs["labels"].to_pylist() for key, _ in pairs or ()}
    labels = sorted(used)[:MOST_LABELS]
    if len(used) > len(labels):
        notes.append(f"tables of {MOST_LABELS} of {len(used)} labels: {', '.join(labels)}")
    for label in labels:
        result = fleet_query(lake, _LATENCY, where=where, group_by=[label])
        table = result.table.rename_columns(["value", *result.columns[1:]])
        meta = {"command": f"{command} --group-by {shell_quoted(result.columns[0])}"}
        parts[f"page_group?label={label}"] = encode(table, units=result.units, meta=meta)
    wrong = {"where": "severity <> 'info'"}
    result = fleet_query(lake, _FINDINGS, where=where, selection=wrong)
    command = f"msgflow fleet query {header_of(_FINDINGS).words} {option}"
    parts["page_finding?"] = _encoded(result, command=command)
    failures = list_failures(lake).table
    failed = f"msgflow fleet failures --lake {shell_quoted(lake.store.url)}"
    parts["page_failure?"] = encode(_with_time(failures), meta={"command": failed})
    name = lake.store.url.rstrip("/").rpartition("/")[2] or lake.store.url
    # The row that the head of a page shows; here it names the lake.
    parts["run"] = encode(
        pa.table({"run_id": [0], "name": [name], "start_text": ["0"], "runs": [len(choice.runs)]})
    )
    head: dict[str, Any] = {
        "notes": notes,
        "pages": ["lake"],
        "address": "#/lake",
        "lake": lake.store.url,
        "open": f"--lake {shell_quoted(lake.store.url)}",
        "labels": labels,
    }
    return LakePage(single_page(parts, head), len(choice.runs), tuple(notes))


def write_lake_page(lake: Lake, path: Path, *, where: str | None = None, max_size: int) -> LakePage:
    """Write the page of a lake into one file that any browser opens."""
    page = lake_page(lake, where=where)
    content = page.content.encode()
    if len(content) > max_size:
        raise UsageError(
            f"the page takes {len(content):,} bytes, more than {max_size:,}",
            "give a larger --max-size, or choose runs with --where",
        )
    with replacing(path) as temporary:
        temporary.write_bytes(content)
    return page


def _encoded(result: QueryResult, **meta: str) -> bytes:
    assert result.header is not None
    described = {column.name: column.description for column in result.header.columns}
    return encode(result.table, units=result.units, meta={**meta, "columns": described})


def _with_time(failures: pa.Table) -> pa.Table:
    moments = pc.cast(failures["failed_ns"], pa.timestamp("ns"))
    texts = pc.strftime(pc.cast(moments, pa.timestamp("s"), safe=False), "%Y-%m-%d %H:%M:%S")
    names = ["source", "reason", "error", "hint", "labels", "stage", "tries", "worker"]
    return failures.select(names).add_column(1, "failed", texts)
