"""Tables survive being packed."""

from __future__ import annotations

import subprocess
import sys

import pyarrow as pa
from hypothesis import given, settings
from hypothesis import strategies as st
from support.tables import decoded
from support.thorough import examples

from msgflow.view.table_encoding import LARGEST_EXACT, encode

# Text that no page escapes.
TEXT = st.text().filter(lambda text: text.replace("\n", "").isprintable())
WHOLE = st.integers(-LARGEST_EXACT, LARGEST_EXACT)


@settings(deadline=None, max_examples=examples(40, 100))
@given(
    st.lists(
        st.tuples(
            st.none() | WHOLE,
            st.none() | TEXT,
            st.none() | st.booleans(),
            st.none() | st.floats(allow_nan=False),
            st.none() | st.lists(TEXT, max_size=3),
        )
    )
)
def test_what_goes_in_comes_out(rows: list[tuple[object, ...]]) -> None:
    types = (pa.int64(), pa.string(), pa.bool_(), pa.float64(), pa.list_(pa.string()))
    names = ("whole", "text", "truth", "real", "several")
    table = pa.table(
        {
            name: pa.array([row[place] for row in rows], kind)
            for place, (name, kind) in enumerate(zip(names, types, strict=True))
        }
    )
    assert decoded(encode(table)).rows == table.to_pylist()


def test_control_characters_are_text() -> None:
    name, shown = "a\u202e\x1b[31m\x9b\u2066\nb", "a\\u202e\\x1b[31m\\x9b\\u2066\nb"
    table = pa.table({"name": [name], "several": [[name]], "pair": [{"name": name}]})
    assert decoded(encode(table)).rows == [
        {"name": shown, "several": [shown], "pair": {"name": shown}}
    ]


def test_what_a_browser_would_round_is_text() -> None:
    table = pa.table({"handle": pa.array([2**63 + 1, 5], pa.uint64())})
    assert decoded(encode(table)).rows == [{"handle": str(2**63 + 1)}, {"handle": "5"}]


def test_points_in_time_are_offsets() -> None:
    origin = 1_741_944_413_589_793_238
    table = pa.table({"at_ns": pa.array([origin, origin + 1, None], pa.int64())})
    content = decoded(encode(table, origin_ns=origin, units={"at_ns": "epoch ns"}))
    assert [row["at_ns"] for row in content.rows] == [0, 1, None]
    assert content.columns[0]["unit"] == "epoch ns"


def test_what_follows_in_steps_takes_few_bytes() -> None:
    table = pa.table({"start": pa.array(range(0, 10_000_000, 1_000), pa.int64())})
    assert len(encode(table)) < 2 * table.num_rows + 200


def test_pandas_is_not_imported_where_it_is_installed() -> None:
    """The server would hold it for nothing."""
    # Not pa.array: that one does import it.
    program = (
        "import sys, duckdb; from msgflow.view.table_encoding import encode;"
        "rows = duckdb.sql('SELECT unnest([1, NULL]) AS a, a::DOUBLE, a = 1, a::TEXT');"
        "encode(rows.to_arrow_table()); print('pandas' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("False\n", "")


def test_a_slice_is_encoded_as_its_own_rows_are() -> None:
    columns = (
        [True, None, False, True],
        [1, 2, None, 4],
        [0.5, None, 1.5, 2.5],
        ["a", None, "b", ""],
    )
    table = pa.table({str(place): column for place, column in enumerate(columns)})
    part = table.slice(1, 2)
    assert decoded(encode(part)).rows == part.to_pylist()
