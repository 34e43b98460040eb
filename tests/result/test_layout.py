"""What a terminal shows of a result, at several widths: `screens/NAME.WIDTH.txt` has the lines."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest
from rich.cells import cell_len

from msgflow.query.catalogue import load_query
from msgflow.result.layout import MOST_ROWS, lay_out
from msgflow.result.query_result import QueryResult
from msgflow.result.screen import screen_lines
from msgflow.run.choice import Run
from msgflow.sql.header import Header

SCREENS = Path(__file__).parent / "screens"
BEGIN = 1_700_000_000_000_000_000
RUN = Run(1, "morning", BEGIN)
OTHER = Run(2, "evening", BEGIN + 10**12)
TYPES = {
    "MAP(VARCHAR, BIGINT)": pa.map_(pa.string(), pa.int64()),
    "BIGINT": pa.int64(),
    "INTEGER": pa.int32(),
    "DOUBLE": pa.float64(),
    "BOOLEAN": pa.bool_(),
}
CAMERA = (
    "/camera/driver → /camera/image → /perception/detector → /perception/detections"
    " → /perception/tracker → /perception/objects → /planning/planner → /planning/trajectory"
    " → /control/controller → /control/cmd → /base/motors"
)
SHORT = "/camera/driver → /camera/camera_info → /perception/detector"
LIKE = CAMERA.replace("/base/motors", "/base/brakes")


def result_of(
    query: str, rows: list[dict[str, Any]], runs: tuple[Run, ...] = (RUN,)
) -> QueryResult:
    """Return rows of a query; what they do not name is 0, false or missing."""
    header = load_query(query)
    empty = {"BIGINT": 0, "INTEGER": 0, "BOOLEAN": False}
    fields, columns = [], []
    for column in header.columns:
        kind = TYPES.get(column.type, pa.string())
        fields.append(pa.field(column.name, kind))
        default = 1 if column.name == "run_id" else empty.get(column.type)
        columns.append(pa.array([row.get(column.name, default) for row in rows], kind))
    return QueryResult(pa.table(columns, pa.schema(fields)), header, runs)


def latency(path: str, median_ns: int, **more: Any) -> dict[str, Any]:
    return {
        "roots": 300,
        "reached": 298,
        "cut_by_recording": 2,
        "pairs": 298,
        "path": path,
        "min_ns": median_ns // 2,
        "median_ns": median_ns,
        "mean_ns": median_ns + 1_234,
        "p95_ns": 2 * median_ns,
        "p99_ns": 3 * median_ns,
        "max_ns": 4 * median_ns,
        "sink_event": "callback_end",
        **more,
    }


LATENCIES = [
    latency(SHORT, 13_035_000),
    latency(CAMERA, 21_070_000),
    latency(LIKE, 797_095, roots=301),
]
WAITS = [
    {
        "start_ns": BEGIN + 1_234_567_891,
        "node": "/localization/state_estimator",
        "callback": "Subscription(/localization/odometry)",
        "since": "publication",
        "wait_ns": 96_249,
        "busy_min_ns": 1_000,
        "busy_max_ns": 90_000,
        "rest_min_ns": 6_249,
        "rest_max_ns": 95_249,
        "callback_instance_id": 4711,
        "callback_id": 12,
        "meanwhile": "Subscription(/imu/data) 80.000 µs, Timer(10 ms) of /control/controller"
        " 10.000 µs",
    },
    {
        "start_ns": BEGIN - 1,
        "node": "/planning/planner",
        "callback": "Timer(100 ms)",
        "wait_ns": None,
        "busy_min_ns": 0,
        "busy_max_ns": 0,
        "rest_min_ns": 0,
        "rest_max_ns": 0,
        "callback_instance_id": 4712,
        "callback_id": 13,
    },
]
HOSTILE = [
    {
        "topic_name": "/\x1b[31mred\n/x",
        "publisher_count": 1,
        "take_count": 12,
        "publication_count": 7,
    },
    {"topic_name": "/深い/話題", "publisher_count": 1, "take_count": 3, "publication_count": 9},
]
FINDING = [
    {
        "severity": "warning",
        "name": "clock_not_synchronised",
        "count": 1,
        "detail": "x" * 130 + " y",
    }
]
LIDAR = (
    "/front → /front → /filter → /filter → /fusion → /fusion → /ground → /ground → /planner"
    " → /planner → /control → /control → /vehicle → /vehicle → /wheels"
)
# Nodes that publish topics of their own names, as in the Autoware reference system.
ALIKE = [
    latency(LIDAR, 332_613_000),
    latency(LIDAR.replace(" → /control → /control", ""), 332_613_000),
    latency(LIDAR.replace("/ground", "/voxels"), 432_662_000),
    latency(LIDAR.replace("/front", "/rear"), 307_238_000),
]
CASES = {
    "paths": result_of("e2e-latency", LATENCIES),
    "alike_paths": result_of("e2e-latency", ALIKE),
    "one_path": result_of("e2e-latency", LATENCIES[1:2]),
    "waits": result_of("waits-instance", WAITS),
    "runs": result_of(
        "e2e-latency", [*LATENCIES, {**LATENCIES[0], "run_id": 2}], runs=(RUN, OTHER)
    ),
    "hostile": result_of("topics", HOSTILE),
    "finding": result_of("info-findings", FINDING),
}


def lines_of(result: QueryResult, width: int, **more: Any) -> list[str]:
    shown = lay_out(result, width, **more)
    said = [] if shown.not_shown is None else [shown.not_shown]
    return [*screen_lines(shown, width), *said, *(f"note: {note}" for note in shown.notes)]


@pytest.mark.parametrize("width", [80, 100, 120])
@pytest.mark.parametrize("name", CASES)
def test_what_is_shown(name: str, width: int) -> None:
    """MSGFLOW_WRITE_SCREENS=1 in the environment writes them; read the difference then."""
    lines = lines_of(CASES[name], width)
    file = SCREENS / f"{name}.{width}.txt"
    if os.environ.get("MSGFLOW_WRITE_SCREENS"):
        file.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    assert lines == file.read_text(encoding="utf-8").splitlines()


@pytest.mark.parametrize("width", range(40, 200, 7))
@pytest.mark.parametrize("name", CASES)
def test_no_line_is_wider_than_the_terminal(name: str, width: int) -> None:
    shown = lay_out(CASES[name], width)
    assert max(map(cell_len, screen_lines(shown, width))) <= width


def test_one_line_says_what_is_not_shown() -> None:
    for name, result in CASES.items():
        for width in (80, 100, 120, 1000):
            said = lay_out(result, width).not_shown
            assert said is None or cell_len(said) <= width, name
            assert said is None or said.endswith("; --wide shows all")
    narrow = lay_out(CASES["paths"], 80).not_shown
    assert narrow is not None
    assert narrow.startswith("not shown: ")
    assert " more; --wide" in narrow
    wide = lay_out(CASES["paths"], 1000).not_shown
    assert wide is not None
    assert "lost (empty), " in wide
    assert "sink_event" not in wide


@pytest.mark.parametrize("query", ["callbacks-each", "flows", "waits-instance"])
def test_the_column_that_rows_are_sorted_by_is_always_shown(query: str) -> None:
    header = load_query(query)
    rows = [
        {
            header.slowest or "": n + 1,
            **{c.name: f"{c.name} {n}" * 2 for c in header.columns if c.type == "VARCHAR"},
        }
        for n in range(2)
    ]
    last: Header = replace(
        header, brief=tuple(c.name for c in header.columns if c.name != header.slowest)
    )
    shown = lay_out(replace(result_of(query, rows), header=last), 90)
    assert header.slowest in [column.name for column in shown.columns]
    assert shown.widths is not None


def test_long_results_stop_and_say_how_many_rows_there_are() -> None:
    result = result_of("topics", [{"topic_name": f"/{n}", "take_count": n} for n in range(60)])
    shown = lay_out(result, 100)
    assert len(shown.columns[0].cells) == MOST_ROWS == 50
    assert shown.notes[0] == "the first 50 of 60 rows: --wide shows all"
    assert len(lay_out(result, 100, most_rows=None).columns[0].cells) == 60
    assert len(lay_out(result, 100, most_rows=55).columns[0].cells) == 55


@pytest.mark.parametrize("width", [80, 100, 120])
def test_a_zero_that_is_the_answer_is_shown(width: int) -> None:
    quality = result_of(
        "info-quality",
        [{"scope": "run", "subject": "morning", "measure": "orphan_takes", "total": 4214}] * 2,
    )
    assert "affected" in [column.title for column in lay_out(quality, width).columns]
    assert "affected (empty)" not in (lay_out(quality, width).not_shown or "")
    delivery = result_of(
        "topics-delivery",
        [
            {
                "topic_name": "/perception/camera/image",
                "subscriber": "/perception/detector",
                "published": 299,
                "delivered": 298,
                "not_connected": 1,
                "delivered_percent": 100.0,
                "lost_percent": 0.0,
                "reasons": [("pending_at_end", 1)],
                "subscription_id": 4,
            },
        ]
        * 2,
    )
    titles = {column.title for column in lay_out(delivery, width).columns}
    assert {"delivered", "dropped", "lost"} <= titles
    assert width < 100 or "unknown" in titles
    assert width < 100 or "reasons" in titles


def pieces(rank: int, latency_ns: int, path: str) -> list[dict[str, Any]]:
    return [
        {
            "rank": rank,
            "at_ns": at_ns,
            "duration_ns": 7,
            "node": "/n",
            "share": 0.5,
            "activity": "callback",
            "take_id": 10 * rank,
            "latency_ns": latency_ns,
            "path": None if at_ns else path,
        }
        for at_ns in (0, 7)
    ]


def test_what_holds_of_several_rows_stands_above_them_once() -> None:
    lines = lines_of(result_of("critical-path", pieces(1, 12_000_000, CAMERA)), 100)
    assert lines[0] == "latency 12.000 ms, take_id 10"
    assert "take_id" not in lines[1]
    assert any(line.startswith("path  /camera/driver") for line in lines)
    rows = pieces(1, 12_000_000, CAMERA) + pieces(2, 11_000_000, SHORT)
    several = result_of("critical-path", rows)
    lines = lines_of(several, 100)
    assert lines[:2] == [
        "rank 1: latency 12.000 ms, take_id 10, path 1",
        "rank 2: latency 11.000 ms, take_id 20, path 2",
    ]
    assert lines[2].split()[:2] == ["rank", "at"]
    assert any(line.startswith("path 2  /camera/driver") for line in lines)
    assert lay_out(several, 100, is_chosen=True).headings == ()
    assert lay_out(several.with_columns(["rank", "share"]), 100).headings == ()


def test_rows_of_which_each_has_its_own_heading_have_none() -> None:
    rows = [pieces(rank, 12_000_000, CAMERA)[0] for rank in (1, 2)]
    assert lay_out(result_of("critical-path", rows), 100).headings == ()
    assert lay_out(result_of("critical-path", []), 100).headings == ()


def test_columns_that_somebody_chose_are_all_shown() -> None:
    chosen = CASES["paths"].with_columns(["lost", "run_id", "p95", "path"])
    shown = lay_out(chosen, 100, is_chosen=True)
    assert {column.name for column in shown.columns} == {"lost", "run_id", "p95_ns", "path"}
    assert shown.notes == ()
    narrow = lay_out(CASES["paths"], 60, is_chosen=True)
    assert narrow.widths is None
    assert len(narrow.columns) == len(CASES["paths"].columns)


def callbacks(*nodes: str) -> QueryResult:
    return result_of(
        "callbacks",
        [
            {
                "node": node,
                "callback": f"Subscription({node}/topic)",
                "count": 299,
                "median_ns": 800_000,
                "p95_ns": 900_000 + place,
                "max_ns": 950_000,
                "min_ns": 700_000,
                "p99_ns": 940_000,
                "mean_ns": 800_001,
            }
            for place, node in enumerate(nodes)
        ],
    )


def titles_of(result: QueryResult, width: int) -> list[str]:
    return [column.title for column in lay_out(result, width).columns]


def test_names_are_broken_for_the_six_most_important_columns_alone() -> None:
    long = callbacks("/localization/state_estimator", "/perception/ground_filter")
    # Whole names leave room for four of them, and broken ones for all.
    assert titles_of(long, 84) == ["node", "callback", "count", "median", "p99", "max"]
    # A seventh would have room as well, if names were broken for it.
    assert titles_of(long, 100) == ["node", "callback", "count", "median", "p99", "max"]
    assert "p95" in titles_of(callbacks("/a", "/b"), 100)


def test_widths_are_those_with_which_rows_take_few_lines() -> None:
    nodes = ("/perception", "/localization_of_a_robot", "/localization/state_estimator")
    lines = lines_of(callbacks(*nodes), 100)
    # The last node is broken in any case, and takes no more room from the callbacks than it needs.
    assert lines[2].startswith("/perception               Subscription(/perception/topic)  ")
    assert lines[5].startswith("/localization             Subscription(/localization  ")
    assert not lines[7].startswith((" ", "/"))


def test_short_text_is_not_broken_for_a_less_important_column() -> None:
    rows = [
        {
            "node": "/a",
            "callback": "Timer(10 ms)",
            "wait_ns": n + 10**6,
            "start_ns": BEGIN + n,
            "busy_min_ns": n,
            "busy_max_ns": n,
            "since": f"of the last timer {n}",
        }
        for n in range(2)
    ]
    waits = result_of("waits-instance", rows)
    least = next(width for width in range(60, 99) if "since" in titles_of(waits, width))
    assert "of the last timer 0" in lines_of(waits, least)[2]
    assert least > 60


def test_what_a_note_says_of_all_rows_takes_no_room_from_the_rest() -> None:
    rows = [latency(SHORT, 13_035_000), latency(CAMERA, 21_070_000)]
    shown = lay_out(result_of("e2e-latency", rows), 100)
    titles = [column.title for column in shown.columns]
    assert {"min", "mean", "p99"} <= set(titles)
    assert "cut_by_recording" not in titles
    assert "cut_by_recording (2 in all rows)" in (lay_out(CASES["paths"], 100).not_shown or "")
    # Of the most important columns it is an answer that they are alike.
    assert {"roots", "reached"} <= set(titles)


def test_plain_sql_is_a_table_where_broken_names_make_it_one() -> None:
    label = "Service(/camera/driver/get_parameter_types_atomically)"
    table = pa.table({"id": [1, 2], "node": ["/camera/driver"] * 2, "label": [label] * 2})
    assert lay_out(QueryResult(table), 60).widths is not None
    assert lay_out(QueryResult(table), 40).widths is None


def test_plain_sql_keeps_every_column() -> None:
    table = pa.table({"a": [0, 0], "b": [None, None], "path": ["x x" * 10, "y"]})
    shown = lay_out(QueryResult(table), 60)
    assert [column.title for column in shown.columns] == ["a", "b", "path"]
    assert lay_out(QueryResult(table), 30).widths is not None
    assert lay_out(QueryResult(pa.table({f"c{n}": [1] for n in range(40)})), 80).widths is None


def test_a_result_without_rows_has_no_lines() -> None:
    assert lines_of(result_of("e2e-latency", []), 80) == []
    assert lines_of(QueryResult(pa.table({"a": pa.array([], pa.int64())})), 80) == []


def test_moments_are_whole_where_the_rows_tell_when_runs_began() -> None:
    rows = [{"name": "morning", "start_ns": BEGIN, "end_ns": BEGIN + 10**9, "duration_ns": 10**9}]
    lines = lines_of(result_of("info", rows), 200)
    assert "2023-11-14T22:13:20.000000000Z" in "".join(lines)
    # Rounded down: --start with it leaves nothing out.
    (start,) = (c.cells for c in lay_out(CASES["waits"], 120).columns if c.name == "start_ns")
    assert start == ("1.234567 s", "-0.000001 s")


def test_the_order_of_importance_is_that_of_the_header() -> None:
    header = load_query("e2e-latency")
    first = lay_out(CASES["paths"], 60)
    assert "median" in [column.title for column in first.columns]
    turned: Header = replace(header, brief=("path", "min_ns", "mean_ns", "sink_event"))
    other = lay_out(replace(CASES["paths"], header=turned), 60)
    titles = [column.title for column in other.columns]
    assert {"min", "mean", "sink_event"} <= set(titles)
    assert "loss_affected" not in titles
