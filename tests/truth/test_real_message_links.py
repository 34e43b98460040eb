"""Nodes that declare by tracepoints what a trace does not show, by LTTng's own macros."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from recording.recorder import NotPossibleError, require_lttng, session
from recording.tracetools import build_tracetools

from msgflow import open_db

HERE = Path(__file__).parent
ROUNDS = 40


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    try:
        require_lttng()
    except NotPossibleError as error:
        pytest.skip(f"cannot record: {error}")
    library = build_tracetools(tmp_path)
    program = tmp_path / "program"
    command = ["gcc", f"-I{HERE}", "-o", program, HERE / "message_links.c", library, "-llttng-ust"]
    subprocess.run([*command, f"-Wl,-rpath,{tmp_path}"], check=True)
    with session(tmp_path / "trace"):
        subprocess.run([program], env={"LTTNG_UST_REGISTER_TIMEOUT": "-1"}, check=True)
    return tmp_path / "trace"


@pytest.mark.thorough
def test_what_nodes_declare_is_linked(trace: Path, tmp_path: Path) -> None:
    with open_db(tmp_path / "run.duckdb") as db:
        db.ingest(trace)

        def rows(query: str) -> list[tuple[object, ...]]:
            return db.connection.execute(query).fetchall()

        assert rows(
            "SELECT l.kind, s.topic_name, p.topic_name, count(*)"
            " FROM link_causal AS l"
            " JOIN publication AS b ON l.publication_id = b.publication_id"
            " JOIN publisher AS p ON b.publisher_id = p.publisher_id"
            " JOIN take AS t ON l.take_id = t.take_id"
            " JOIN subscription AS s ON t.subscription_id = s.subscription_id"
            " GROUP BY ALL ORDER BY ALL"
        ) == [
            ("direct", "/b", "/fused", ROUNDS),
            ("partial_sync", "/a", "/fused", ROUNDS),
            ("periodic_async", "/a", "/plan", ROUNDS // 2),
            ("periodic_async", "/b", "/plan", ROUNDS // 2),
        ]
        reached = db.query("e2e-latency").to_arrow()
        assert dict(
            zip(reached["path"].to_pylist(), reached["reached"].to_pylist(), strict=True)
        ) == {
            "/source → /a → /fusion → /fused → /sink": ROUNDS,
            "/source → /b → /fusion → /fused → /sink": ROUNDS,
            "/source → /a → /planner → /plan → /sink": ROUNDS // 2,
            "/source → /b → /planner → /plan → /sink": ROUNDS // 2,
        }
