"""Links are derived run by run: what the others hold is not looked at."""

from __future__ import annotations

from pathlib import Path

import pytest

from msgflow import Database
from msgflow.db import objects
from msgflow.db.connection import connect

LINKS = """
links:
  - kind: periodic_async
    node: /fusion
    inputs: [/a, /b]
    outputs: [/c, /d]
"""
MACROS = [header for header in objects.load("link") if "(only_run) AS TABLE" in header.body]
FILLED = {
    "derive.annotated_publication",
    "derive.annotated_run",
    "derive.link_causal",
    "derive.link_causal_annotated",
    "derive.link_causal_direct",
    "derive.link_causal_indirect",
}


@pytest.fixture
def declared(database: Path, tmp_path: Path) -> Path:
    """A run with direct and indirect links, the only one of its database."""
    file = tmp_path / "links.yaml"
    file.write_text(LINKS)
    with Database(database) as opened:
        opened.apply_links(file)
    return database


def test_of_another_run_there_is_nothing(declared: Path) -> None:
    con = connect(declared, read_only=True)
    counts = {
        header.name: tuple(
            con.execute(f"SELECT count(*) FROM {header.name}(?)", [run]).fetchall()[0][0]
            for run in (1, 2)
        )
        for header in MACROS
    }
    con.close()
    assert len(counts) > 15
    assert {name for name, (own, _) in counts.items() if own} >= FILLED
    assert {name for name, (_, other) in counts.items() if other} == set()
