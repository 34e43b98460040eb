"""Questions of pages, and the page queries that answer them: the SQL below `sql`.

Their rows have the shape of a picture, not of an answer. They are no named queries, because their
rows mean nothing without the page: bins as wide as a pixel, keys of rows, times that count from the
begin of the run. They have the same headers, and read the public views alone. A file of kind
'inline' is put in front of each file that reads it.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import duckdb
import pyarrow as pa

from msgflow.errors import UsageError
from msgflow.query.flow import KINDS
from msgflow.run.choice import Run
from msgflow.run.slice import Slice
from msgflow.run.window import WHOLE, Window
from msgflow.sql.header import Param
from msgflow.sql.statement import Statements
from msgflow.sql.value import Value

Params = dict[str, Any]

_LARGEST = 2**62

DIRECTORY = Path(__file__).parent / "sql"
_PAGES = Statements(DIRECTORY)

page_query = _PAGES.header


def run_page_query(
    connection: duckdb.DuckDBPyConnection, name: str, values: Mapping[str, Value]
) -> pa.Table:
    """Return the rows of a page query; see `Statements.run`."""
    return _PAGES.run(connection, name, values).to_arrow_table()


@dataclass(frozen=True)
class Question:
    """What a page asks of one run. Times of pages are offsets from the first event of the run."""

    connection: duckdb.DuckDBPyConnection
    params: Params  # as the page gives them
    shown: Window = WHOLE  # the times that pages show

    @cached_property
    def run(self) -> Run:
        """The run, by default the latest."""
        return Slice(self.params.get("run")).one_run(self.connection, "a page")

    @property
    def origin_ns(self) -> int:
        """Time of the first event, epoch ns; 0 for a run without events."""
        return self.run.start_ns or 0

    @property
    def length_ns(self) -> int:
        """Time from the first event to the last."""
        return max((self.run.end_ns or 0) - self.origin_ns, 0)

    @cached_property
    def window(self) -> Window:
        """The window that is asked for, within the times that pages show."""
        start = self.whole("start") if "start" in self.params else 0
        end = self.whole("end") if "end" in self.params else self.length_ns + 1
        return Window(
            max(self.origin_ns + start, self.shown.start_ns),
            min(self.origin_ns + end, self.shown.end_ns),
        )

    @property
    def slice(self) -> Slice:
        """The run and the window; the whole run has no window."""
        # Only those ends that were given: a command then has no other ones.
        is_begun = "start" in self.params or self.shown.start_ns != WHOLE.start_ns
        is_ended = "end" in self.params or self.shown.end_ns != WHOLE.end_ns
        return Slice(
            self.run.run_id,
            self.window.start_ns if is_begun else None,
            self.window.end_ns if is_ended else None,
        )

    @property
    def options(self) -> list[str]:
        """The options of the command line that choose the window, as offsets in seconds."""
        options = []
        for option, time_ns in {"--start": self.slice.start, "--end": self.slice.end}.items():
            if time_ns is not None:
                whole, rest = divmod(max(int(time_ns) - self.origin_ns, 0), 1_000_000_000)
                options += [option, f"{whole}.{rest:09d}".rstrip("0").rstrip(".") + "s"]
        return options

    @property
    def is_internal(self) -> bool:
        """Whether it is about what ROS does for itself, too."""
        return str(self.params.get("internal", "")) not in ("", "0", "False")

    @property
    def kind(self) -> str:
        """What a flow begins with."""
        kind = self.params.get("kind")
        if kind not in KINDS:
            raise UsageError(f"a flow begins with one of {', '.join(KINDS)} — {kind}")
        return str(kind)

    @cached_property
    def paths(self) -> pa.Table:
        """The paths of the run, as the page query path has them."""
        return self.rows("path")

    def text(self, name: str) -> str:
        """Return a parameter as text."""
        return str(self.params.get(name))

    def whole(self, name: str) -> int:
        """Return a parameter that is a whole number."""
        value = self.params.get(name)
        try:
            number = int(value) if value is not None else None
        except (TypeError, ValueError):
            number = None
        if number is None or abs(number) > _LARGEST:
            raise UsageError(f"{name} is a whole number — {value}")
        return number

    def frame(self, window: Window | None = None) -> Params:
        """Return the parameters that most page queries need, for another window if one is given."""
        bindings = (window or self.window).bindings
        return {"run": self.run.run_id, "origin_ns": self.origin_ns, **bindings}

    def window_of_flows(self) -> Params:
        """Return the window of page queries on flows: of their roots, None where it is open."""
        names = {"start": "begin_at", "end": "end_at"}
        return {
            name: self.whole(end) if end in self.params else None for end, name in names.items()
        }

    def own(self, name: str, given: Container[str]) -> Params:
        """Return the parameters of a page query that the page gives, besides those in `given`."""
        return {
            param.name: self._value(param)
            for param in page_query(name).params
            if param.name in self.params and param.name not in given
        }

    def _value(self, param: Param) -> int | str:
        if param.type != "BIGINT":
            return str(self.params[param.name])
        number = self.whole(param.name)
        least, most = param.minimum, param.maximum
        if (least is not None and number < least) or (most is not None and number > most):
            raise UsageError(f"{param.name} is from {least} to {most} — {number}")
        return number

    def rows(self, name: str, window: Window | None = None, **values: Any) -> pa.Table:
        """Return the rows of a page query, for another window if one is given."""
        return run_page_query(self.connection, name, self.frame(window) | values)

    def links(self, limit: int, window: Window | None = None) -> pa.Table:
        """Return the arrows of the window, at most `limit`."""
        (ids,) = self.rows("window_ids", window).to_pylist()
        return self.rows("links", window, **ids, limit=limit)


class Scratch:
    """Tables in memory, beside the database: what is computed once per run and asked often."""

    def __init__(self) -> None:
        self._connection = duckdb.connect(":memory:")
        for table, query in {"flow": "path_flow", "level": "segments"}.items():
            columns = ", ".join(f"{each.name} {each.type}" for each in page_query(query).columns)
            self._connection.execute(f"CREATE TABLE {table} (run_id BIGINT, {columns})")
        self._locks: dict[tuple[str, int], threading.Lock] = {}
        self._filled: set[tuple[str, int]] = set()
        self._guard = threading.Lock()

    def fill(self, table: str, run_id: int, read: Callable[[], pa.Table]) -> None:
        """Put the rows of a run into a table, unless they are there."""
        key = (table, run_id)
        with self._guard:
            lock = self._locks.setdefault(key, threading.Lock())
        with lock:
            if key in self._filled:
                return
            rows = read()
            with self._connection.cursor() as cursor:
                cursor.register("incoming", rows)
                cursor.execute(
                    f"INSERT INTO {table} BY NAME SELECT $run::BIGINT AS run_id, * FROM incoming",
                    {"run": run_id},
                )
            self._filled.add(key)

    def ask(self, name: str, values: Mapping[str, Any]) -> pa.Table:
        """Return the rows of a page query over these tables."""
        with self._connection.cursor() as cursor:
            return run_page_query(cursor, name, values)

    def close(self) -> None:
        """Free the memory."""
        self._connection.close()
