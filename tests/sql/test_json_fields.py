"""Fields of events as JSON: labels of enumerations."""

from __future__ import annotations

from typing import Any

import duckdb
import pyarrow as pa
import pytest

from msgflow.sql.json_fields import label_of
from msgflow.trace.columns import field_metadata

Labels = dict[str, list[tuple[int, int]]]
FARTHEST = 1 << 200


def labelled(labels: Labels, values: list[int], data_type: pa.DataType) -> list[str | None]:
    field = pa.field("state", data_type, metadata=field_metadata(10, labels))
    table: Any = pa.table({"x": pa.array(values, data_type)})
    with duckdb.connect(config={"threads": 1}) as con:
        con.register("given", table)
        found = con.execute(f"SELECT {label_of('x', field) or 'NULL'} FROM given").fetchall()
    return [label for (label,) in found]


@pytest.mark.parametrize(
    ("labels", "expected"),
    [
        ({"a": [(1, 3)]}, [None, "a", "a", "a", None]),
        ({"a": [(1, 1)], "b": [(2, 2)]}, [None, "a", "b", None, None]),
        # The inner one does not end the outer one.
        ({"a": [(0, 4)], "b": [(2, 2)]}, ["a", "a", None, "a", "a"]),
        ({"a": [(0, 2)], "b": [(2, 4)]}, ["a", "a", None, "b", "b"]),
        # Two labels for every value give no label. The same label twice gives that label.
        ({"a": [(0, 4)], "b": [(0, 4)]}, [None] * 5),
        ({"a": [(0, 2), (1, 3)]}, ["a", "a", "a", "a", None]),
        # From its end to its begin there is nothing.
        ({"a": [(3, 1)], "b": [(2, 2)]}, [None, None, "b", None, None]),
        ({"a": [(-FARTHEST, 1), (3, FARTHEST)]}, ["a", "a", None, "a", "a"]),
        ({"a": [(FARTHEST, FARTHEST)], "b": [(0, 0)]}, ["b", None, None, None, None]),
        ({"it's": [(4, 4)]}, [None, None, None, None, "it's"]),
    ],
)
def test_a_value_with_one_label_has_it(labels: Labels, expected: list[str | None]) -> None:
    for data_type in (pa.int8(), pa.uint8(), pa.int64(), pa.uint64()):
        assert labelled(labels, [0, 1, 2, 3, 4], data_type) == expected


def test_the_least_and_the_greatest_value_have_labels() -> None:
    least, most = -(1 << 63), (1 << 64) - 1
    assert labelled({"a": [(least, least)]}, [least, least + 1], pa.int64()) == ["a", None]
    assert labelled({"a": [(-FARTHEST, -1)]}, [least, 0], pa.int64()) == ["a", None]
    assert labelled({"a": [(most, most)]}, [most, most - 1], pa.uint64()) == ["a", None]
    assert labelled({"a": [(1, FARTHEST)]}, [most, 0], pa.uint64()) == ["a", None]


def test_far_limits_do_not_blur_near_ones() -> None:
    """All are compared as integers: as floating point numbers these two are equal."""
    large = 1 << 62
    for labels in ({"a": [(-FARTHEST, large)]}, {"a": [(large + 1, FARTHEST)]}):
        found = labelled(labels, [large, large + 1], pa.int64())
        assert sorted(found, key=str) == [None, "a"]


@pytest.mark.parametrize("labels", [None, {}, {"a": []}])
def test_fields_without_labels_have_none(labels: Labels | None) -> None:
    assert label_of("x", pa.field("x", pa.int8(), metadata=field_metadata(16, labels))) is None
    assert label_of("x", pa.field("x", pa.int8())) is None
