"""What is not planned, as it can have no row: the same database comes out as if all of it were."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from ingested import contents
from thorough import thorough

from msgflow.db import conditions, objects
from msgflow.ingest import ingest, model
from msgflow.sim import Recording, simulate

# Services, ring buffers, losses, several hosts without stamps, annotations.
SYSTEMS = (
    ("demo", "jazzy", None),
    ("two_hosts", "humble-fastdds", None),
    ("services", "jazzy", Recording(lost_event_share=0.02)),
)


def of_ingest(trace: Path, database: Path) -> dict[str, object]:
    ingest([trace], database)
    found = contents(database)
    found.pop("run")  # the moment of the ingest
    return dict(found)


@pytest.fixture(params=[SYSTEMS[0], *map(thorough, SYSTEMS[1:])], ids=lambda system: system[0])
def trace(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    system, layout, recording = request.param
    simulate(system, tmp_path / "trace", factor=0.02, layout=layout, recording=recording)
    return tmp_path / "trace"


def test_nothing_is_missing(trace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = of_ingest(trace, tmp_path / "found.duckdb")
    unplanned: list[str] = []
    is_empty = conditions.is_empty

    def never(name: str, *rest: Callable[[str], bool]) -> bool:
        if is_empty(name, *rest):
            unplanned.append(name)
        return False

    monkeypatch.setattr(conditions, "is_empty", never)
    monkeypatch.setattr(model, "is_empty", never)
    monkeypatch.setattr("msgflow.db.noted.is_empty", never)
    assert of_ingest(trace, tmp_path / "planned.duckdb") == found
    kinds = {name.partition(".")[0] for name in unplanned}
    assert kinds == {"staging", "derive", "diagnostic"}
    assert len(set(unplanned)) > len(objects.load("model")) // 4
