"""The recording that comes with the sources: what msgflow finds is what its nodes wrote down."""

from __future__ import annotations

from pathlib import Path

import pytest
from scoring import compare_real

from msgflow.ingest import ingest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.mark.thorough
def test_every_link_is_found_and_right(tmp_path: Path) -> None:
    ingest([EXAMPLES / "pipeline.tar.xz"], tmp_path / "run.duckdb")
    scores = compare_real(tmp_path / "run.duckdb", EXAMPLES / "pipeline-truth.jsonl.gz")
    assert {one.kind: one.found for one in scores} == {
        "direct": 273,
        "transport": 267,
        "lost": 0,
    }
    assert all(one.wrong == one.missing == one.doubted == 0 for one in scores), scores
