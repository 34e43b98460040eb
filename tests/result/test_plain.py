"""Values of all types that DuckDB has, in all formats: shown, or refused in words."""

from __future__ import annotations

import io
from pathlib import Path

import duckdb
import pyarrow as pa
import pytest
from support.thorough import few

import msgflow.result.plain
from msgflow.database import Database
from msgflow.errors import QueryError
from msgflow.export.formats import Format, write_result
from msgflow.view.sql_page import encoded_rows

TYPES = [name for name, *_ in duckdb.sql("DESCRIBE FROM test_all_types()").fetchall()]


def ask(database: Path, value: str, source: str) -> list[str]:
    """Return the values as JSON has them, after all other formats were written."""
    with Database(database) as opened:
        result = opened.sql(f"SELECT {value} AS v FROM {source}")
    shown = {}
    for form in Format:
        stream = io.BytesIO()
        write_result(result, form, stream)
        shown[form] = stream.getvalue()
    assert str(result)
    encoded_rows(result)
    result.to_pandas()
    return shown[Format.JSONL].decode().splitlines()


@pytest.mark.parametrize("name", few(TYPES, *TYPES[::4]))
def test_extremes_of_each_type(small_database: Path, name: str) -> None:
    assert len(ask(small_database, f'"{name}"', "test_all_types()")) == 3


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        ("make_timestamp(1_700_000_000_000_000_000)", "55840-11-08 22:13:20"),
        ("DATE '-infinity'", "-infinity"),
        ("DATE '9999-12-31' + 1", "10000-01-01"),
        ("DATE '0001-01-01 (BC)'", "0001-01-01 (BC)"),
        ("TIME '24:00'", "24:00:00"),
        ("[DATE 'infinity']", "[infinity]"),
        ("INTERVAL '1 month 2 days'", "1 month 2 days"),
        ("{'a': INTERVAL 1 day}", "{'a': 1 day}"),
        ("MAP {INTERVAL 1 day: 'x'}", "{1 day=x}"),
        ("MAP {}", "{}"),
        ("row()", "{}"),
        ("[union_value(k := 1)]", "[1]"),
    ],
)
def test_what_others_do_not_have_is_the_text_of_duckdb(
    small_database: Path, value: str, shown: str
) -> None:
    assert ask(small_database, value, "range(1)") == [f'{{"v": "{shown}"}}']


def test_nanoseconds_without_pandas(small_database: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    value = "make_timestamp_ns(1_700_000_000_123_456_789)"
    with Database(small_database) as database:
        assert database.sql(f"SELECT {value} AS v").table["v"].type == pa.timestamp("ns")
    monkeypatch.setattr(msgflow.result.plain, "find_spec", lambda _: None)
    shown = ask(small_database, value, "range(1)")
    assert shown == ['{"v": "2023-11-14 22:13:20.123456789"}']


def test_a_type_that_arrow_does_not_have_is_refused_in_words(small_database: Path) -> None:
    with pytest.raises(QueryError, match="TYPE"):
        ask(small_database, "TYPE 'INTEGER'", "range(1)")
