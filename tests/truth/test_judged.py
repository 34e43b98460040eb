"""Which figures `make truth` takes."""

from __future__ import annotations

import pytest
from scoring import Score
from truth import Judged


def _judged(
    system: str,
    wrong: int,
    loss_affected: int,
    found: int = 1_000,
    kind: str = "transport",
    **others: float,
) -> Judged:
    values = {"misguessed": 0, "repeated": 0, "missing": 0, "doubted": 0, "recall": 1.0, **others}
    score = Score(
        kind,
        found,
        found,
        found,
        wrong,
        loss_affected,
        **values,
        precision=1 - wrong / found,
        labels="",
    )
    return Judged(system, "iron", "loss", score)


@pytest.mark.parametrize(
    ("system", "wrong", "loss_affected", "is_good"),
    [
        pytest.param("rivals", 1, 1, True, id="marked"),
        pytest.param("rivals", 2, 2, False, id="too_many"),
        pytest.param("rivals", 1, 0, False, id="not_marked"),
        pytest.param("pipeline", 1, 1, False, id="without_rivals"),
        pytest.param("pipeline", 0, 0, True, id="none"),
    ],
)
def test_of_rivals_one_link_in_a_thousand_may_be_wrong(system, wrong, loss_affected, is_good):
    assert _judged(system, wrong, loss_affected).is_good is is_good


@pytest.mark.parametrize("fault", ["repeated", "doubted"])
def test_other_faults_of_rivals_are_not_excused(fault):
    assert not _judged("rivals", 0, 0, **{fault: 1}).is_good


@pytest.mark.parametrize(
    ("system", "recall", "is_good"),
    [
        ("pipeline", 0.9999, False),
        ("long_recording", 0.999, True),
        ("long_recording", 0.998, False),
    ],
)
def test_a_known_system_may_lack_links(system, recall, is_good):
    assert _judged(system, 0, 0, recall=recall).is_good is is_good


@pytest.mark.parametrize(
    ("kind", "missing", "is_good"),
    [("approximate_sync", 6, True), ("approximate_sync", 7, False), ("transport", 6, False)],
)
def test_of_several_sets_a_marked_link_may_name_another(kind, missing, is_good):
    judged = _judged("approximate_sync", 0, 0, kind=kind, missing=missing, misguessed=6, recall=0.9)
    assert judged.is_good is is_good
