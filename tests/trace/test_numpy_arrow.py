"""What goes from numpy to Arrow and back is what pyarrow makes of it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from msgflow.trace.numpy_arrow import (
    distinct,
    empty_batch,
    integers_to_arrow,
    is_valid,
    text_lengths,
    texts_to_arrow,
    to_arrow,
    to_numpy,
    without,
)
from msgflow_sim import simulate

TYPES = ["bool", "int8", "int32", "int64", "uint16", "uint64", "float32", "float64", ">u4", ">i8"]


@settings(deadline=None)
@given(
    kind=st.sampled_from(TYPES),
    rows=st.lists(st.tuples(st.integers(0, 127), st.booleans()), max_size=40),
    begin=st.integers(0, 20),
)
def test_there_and_back(kind: str, rows: list[tuple[int, bool]], begin: int) -> None:
    values = np.array([value for value, _ in rows], kind)
    is_missing = np.array([missing for _, missing in rows], np.bool_)
    expected = pa.array(values.astype(values.dtype.newbyteorder("=")), mask=is_missing)
    array = to_arrow(values, is_missing)
    array.validate(full=True)
    assert array.equals(expected)
    assert array.null_count == expected.null_count
    assert to_arrow(values).null_count == 0
    for part in (array.slice(begin), expected.slice(begin), to_arrow(values).slice(begin)):
        present = is_valid(part)
        assert present.tolist() == [value is not None for value in part.to_pylist()]
        kept = [value for value in part.to_pylist() if value is not None]
        assert to_numpy(part)[present].tolist() == kept


def test_values_apart_in_memory() -> None:
    values = np.arange(20, dtype=np.int32)[::3]
    assert to_arrow(values).to_pylist() == values.tolist()


def test_nulls_alone() -> None:
    nothing = pa.nulls(3, pa.int32())
    assert not is_valid(nothing).any()
    assert to_numpy(nothing).size == 3


@settings(deadline=None)
@given(st.lists(st.none() | st.integers(-(1 << 70), 1 << 70)))
def test_integers_are_wrapped(values: list[int | None]) -> None:
    low = [
        None if value is None else (value + (1 << 31)) % (1 << 32) - (1 << 31) for value in values
    ]
    assert integers_to_arrow(values, pa.int32()).to_pylist() == low
    truths = [None if value is None else bool(value) for value in values]
    assert integers_to_arrow(values, pa.bool_()).to_pylist() == truths


@settings(deadline=None)
@given(st.lists(st.none() | st.text(st.characters(exclude_categories=["Cs"]))))
def test_texts(texts: list[str | None]) -> None:
    array = texts_to_arrow(texts)
    array.validate(full=True)
    assert array.to_pylist() == texts


@settings(deadline=None)
@given(st.lists(st.none() | st.text(st.characters(exclude_categories=["Cs"]))), st.integers(0, 9))
def test_lengths_of_texts(texts: list[str | None], begin: int) -> None:
    array = pa.array(texts, pa.string()).slice(begin)
    lengths = text_lengths(array)
    assert lengths.dtype == np.int32
    expected = [None if text is None else len(text.encode()) for text in texts[begin:]]
    assert [
        length if valid else None
        for length, valid in zip(lengths.tolist(), is_valid(array), strict=True)
    ] == expected


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.none() | st.integers(0, 99), st.booleans())),
    st.sampled_from([pa.int64(), pa.string()]),
    st.integers(0, 20),
)
def test_values_left_out(
    rows: list[tuple[int | None, bool]], kind: pa.DataType, begin: int
) -> None:
    array = pa.array([value for value, _ in rows]).cast(kind).slice(begin)
    is_left_out = np.array([left_out for _, left_out in rows[begin:]], np.bool_)
    kept = without(array, is_left_out)
    kept.validate(full=True)
    assert kept.to_pylist() == [
        None if left_out else value
        for value, left_out in zip(array.to_pylist(), is_left_out, strict=True)
    ]


def test_each_value_once() -> None:
    assert distinct(np.array([3, 1, 3, 2, 1])).tolist() == [1, 2, 3]
    assert distinct(np.empty(0, np.int64)).size == 0
    script = (
        "import sys, numpy; from msgflow.trace.numpy_arrow import distinct\n"
        "distinct(numpy.array([3, 1, 3]))\n"
        "assert 'numpy.ma' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


def test_a_batch_without_rows() -> None:
    schema = pa.schema([("name", pa.string()), ("ids", pa.list_(pa.int64()))])
    assert empty_batch(schema).equals(pa.RecordBatch.from_pylist([], schema=schema))


@pytest.mark.thorough
def test_commands_import_nothing_that_takes_long(tmp_path: Path) -> None:
    """pandas, where it is installed, takes longer than reading a small trace."""
    simulate("pipeline", tmp_path / "trace", factor=0.02)
    script = (
        "import sys; from msgflow.__main__ import main\n"
        "try:\n"
        "    main()\n"
        "finally:\n"
        "    assert not {'pandas', 'numpy.ma'} & set(sys.modules)"
    )
    targets = tmp_path / "targets.yaml"
    targets.write_text("targets:\n  - topic: '*'\n    loss: < 100 %\n", encoding="utf-8")
    database = ["--db", tmp_path / "run.duckdb"]
    for command in (
        ["ingest", tmp_path / "trace"],
        ["query", "e2e-latency"],
        ["query", "flows", "--limit", "3", "--format", "csv"],
        ["export", "csv", "-o", tmp_path / "tables"],
        ["report", "-o", tmp_path / "report.html"],
        ["verify", targets],
    ):
        subprocess.run([sys.executable, "-c", script, *command, *database], check=True)
