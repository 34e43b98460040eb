"""What changed between two runs: a row for each subject of a comparison."""

from __future__ import annotations

from typing import Any

import pyarrow as pa

from msgflow.query.differences import Differences
from msgflow.result.query_result import QueryResult
from msgflow.run.choice import Run

A_TO_B = "/a → /t → /b"


def compared(subject: str, verdicts: dict[str, str], difference_ns: int | None, **more: Any) -> Any:
    return [
        {
            "subject": subject,
            "statistic": statistic,
            "verdict": verdict,
            "a_ns": 1_000,
            "b_ns": None if difference_ns is None else 1_000 + difference_ns,
            "change_percent": None if difference_ns is None else difference_ns / 10,
            "a_share": 1.0,
            "b_share": 0.5,
            "a_count": 30,
            "b_count": 20,
            "a_ambiguous": 0,
            "b_ambiguous": 0,
            **more,
        }
        for statistic, verdict in verdicts.items()
    ]


ROWS = [
    *compared(A_TO_B, {"median": "B is longer", "p95": "no difference shown"}, 100),
    *compared("/same", {"median": "no difference shown", "p95": "too few values"}, 500),
    *compared("/both", {"median": "B is shorter", "p95": "B is longer"}, -300),
    *compared("/gone", {"median": "only in A", "p95": "only in A"}, None, b_count=0),
]
RESULT = QueryResult(pa.Table.from_pylist(ROWS), notes=["a note"])


def test_a_row_for_each_that_differs_the_greatest_change_first() -> None:
    found = Differences(result=RESULT).changes(only_different=True)
    rows = found.to_arrow().to_pylist()
    assert [(row["path"], row["change"], row["of"]) for row in rows] == [
        ("/gone", "only in A", None),
        ("/both", "both", "median, p95"),
        (A_TO_B, "longer", "median"),
    ]
    assert rows[2]["a_median_ns"] == 1_000
    assert rows[2]["b_median_ns"] == 1_100
    assert rows[2]["median_percent"] == 10.0
    assert (rows[1]["median_verdict"], rows[1]["p95_verdict"]) == ("B is shorter", "B is longer")
    assert found.notes == ["4 compared, 1 with no difference shown: --all lists them", "a note"]
    assert found.when_empty == "no rows"


def test_no_difference_says_how_much_was_compared_and_what_could_not_be() -> None:
    rows = [
        *compared("/same", {"median": "no difference shown", "p95": "too few values"}, 0),
        *compared("/few", {"median": "too few values", "max": "not estimated"}, 0),
        *compared("/alike", {"median": "too few independent values"}, 0),
    ]
    runs = (Run(1, "before", 0), Run(2, "after", 0))
    result = QueryResult(pa.Table.from_pylist(rows), runs=runs)
    found = Differences(result=result).changes(only_different=True)
    assert not len(found)
    assert found.when_empty == (
        "no difference is shown between before and after: 3 compared, 1 with no difference shown,"
        " 1 with too few independent values, 1 with too few values: --all lists them"
    )
    assert "note: no difference is shown" in str(found)
    every = Differences(result=result).changes(only_different=False).to_arrow().to_pylist()
    assert {row["path"]: row["change"] for row in every} == {
        "/same": "none shown",
        "/few": "too few values",
        "/alike": "too few independent values",
    }


def test_all_of_them() -> None:
    found = Differences(result=RESULT).changes(only_different=False)
    rows = found.to_arrow().to_pylist()
    # The greatest change of a median comes last: it is not shown to differ.
    assert [row["path"] for row in rows] == ["/gone", "/both", A_TO_B, "/same"]
    assert (rows[3]["change"], rows[3]["of"]) == ("none shown", "median")
    assert rows[3]["p95_verdict"] == "too few values"
    assert rows[3]["max_verdict"] is None
    assert found.notes == ["a note"]
    assert found.columns == tuple(column.name for column in (found.header or 0).columns)  # type: ignore[union-attr]


def test_the_maximum_has_values_and_a_word() -> None:
    rows = compared("/max", {"median": "no difference shown", "max": "not estimated"}, 100)
    (row,) = (
        Differences(result=QueryResult(pa.Table.from_pylist(rows)))
        .changes(only_different=False)
        .to_arrow()
        .to_pylist()
    )
    assert (row["a_max_ns"], row["b_max_ns"], row["max_percent"]) == (1_000, 1_100, 10.0)
    assert row["max_verdict"] == "not estimated"
