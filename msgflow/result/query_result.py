"""Result of a query: an Arrow table, with the units of its columns, its runs and notes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from msgflow.errors import UsageError
from msgflow.files.atomic import replacing
from msgflow.result.rows import Rows, Times, cells
from msgflow.text.name_suggestions import column_named
from msgflow.text.values import printable
from msgflow.text.wrapping import hanging
from msgflow.version import __version__

if TYPE_CHECKING:
    import pyarrow as pa

_STYLE = "text-align: {}; white-space: pre-wrap"


@dataclass(frozen=True, repr=False)
class QueryResult(Rows):
    """Rows in the order of the query. Times are integers in nanoseconds.

    `print` shows what a terminal shows: a table that fits its width (the variable COLUMNS decides;
    100 columns without a terminal). A notebook shows the first rows.

    Attributes:
        table: the rows.
        header: of the named query, with the units of its columns; None for plain SQL.
        runs: the runs that were read; empty for plain SQL.
        notes: what the rows do not say (hidden rows, rows that are cut), a sentence each.
        when_empty: what to say when there are no rows.
        path_numbers: numbers of paths, if there are several; those of all paths of the runs.
        order: columns that the user sorted by.
    """

    def __repr__(self) -> str:
        name = "SQL" if self.header is None else self.header.words
        return f"<QueryResult of {name}: {len(self)} rows>"

    def __str__(self) -> str:
        from msgflow.result.layout import lay_out, screen_width
        from msgflow.result.screen import screen_lines

        width = screen_width()
        shown = lay_out(self, width, remedy="to_arrow() has all")
        label = "run: " if len(self.runs) == 1 else "runs: "
        runs = printable(", ".join(run.title for run in self.runs))
        lines = hanging(label, runs, width) if runs else []
        lines += screen_lines(shown, width)
        lines += [] if shown.not_shown is None else [shown.not_shown]
        for note in (*shown.notes, *self._said()):
            lines += hanging("note: ", printable(note), width)
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        from msgflow.result.layout import MOST_ROWS

        names, columns, right = cells(self.first(MOST_ROWS))
        styles = [_STYLE.format("right" if is_right else "left") for is_right in right]

        def row(tag: str, texts: Sequence[str]) -> str:
            # Names from a trace are always text in it.
            shown = (
                f'<{tag} style="{style}">{escape(text)}</{tag}>'
                for text, style in zip(texts, styles, strict=True)
            )
            return f"<tr>{''.join(shown)}</tr>"

        title = "" if self.header is None else f"<caption>{escape(self.header.title)}</caption>"
        body = "".join(row("td", texts) for texts in zip(*columns, strict=True))
        more = [f"the first {MOST_ROWS} of {len(self):,} rows"] if len(self) > MOST_ROWS else []
        notes = "".join(f"<p>{escape(note)}</p>" for note in (*more, *self._said()))
        head = f"{title}<thead>{row('th', names)}</thead>"
        return f"<table>{head}<tbody>{body}</tbody></table>{notes}"

    def _said(self) -> list[str]:
        return self.notes if len(self) else [self.when_empty, *self.notes]

    def with_times(self, times: str) -> QueryResult:
        """Return the rows with points in time and durations in another form.

        Args:
            times: 'ns', 'seconds' (since the epoch), 'relative' (seconds since the start of the
                run), 'sim' (seconds of a simulation) or 'iso' (UTC as text). With all but 'ns'
                durations are in seconds.

        Raises:
            UsageError: no such form, or the rows do not say which columns are times.
        """
        from msgflow.result.times import converted

        known = get_args(Times)
        if times not in known:
            raise UsageError(
                f"there are no such times — {times}", f"choose one of {', '.join(known)}"
            )
        if self.header is None and times != "ns":
            raise UsageError(
                "plain SQL does not say which numbers are times", "use a query: msgflow query"
            )
        return replace(self, table=converted(self.table, self.units, self.runs, times))

    def with_columns(self, names: Sequence[str]) -> QueryResult:
        """Return the rows with these columns only, in this order.

        Args:
            names: of columns; `_ns` at their end may be left out, as tables do.

        Raises:
            UsageError: there is no such column; the message names similar ones.
        """
        found = [column_named(name, self.columns) for name in names]
        return replace(self, table=self.table.select(list(dict.fromkeys(found))))

    def first(self, number: int) -> QueryResult:
        """Return the first rows, at most so many."""
        return replace(self, table=self.table.slice(0, number))

    def to_arrow(self) -> pa.Table:
        """Return the rows as a pyarrow.Table."""
        return self.table

    def to_pandas(self) -> Any:
        """Return the rows as a pandas.DataFrame; integers stay exact also beside missing values.

        Raises:
            UsageError: pandas is not installed.
        """
        try:
            import pandas
        except ImportError:
            raise UsageError("pandas is not installed", "pip install pandas") from None
        import pyarrow

        # Without these, a column with one NULL would become float64 and lose nanoseconds.
        exact = {
            pyarrow.int64(): pandas.Int64Dtype(),
            pyarrow.int32(): pandas.Int32Dtype(),
            pyarrow.uint64(): pandas.UInt64Dtype(),
            pyarrow.bool_(): pandas.BooleanDtype(),
        }
        return self.table.to_pandas(types_mapper=exact.get)

    def to_polars(self) -> Any:
        """Return the rows as a polars.DataFrame.

        Raises:
            UsageError: polars is not installed.
        """
        try:
            import polars
        except ImportError:
            raise UsageError("polars is not installed", "pip install polars") from None
        return polars.from_arrow(self.table)

    def to_parquet(self, path: str | Path) -> Path:
        """Write the rows to a Parquet file and return its path; an existing file is replaced.

        The file's metadata name the query and the version of msgflow.

        Raises:
            UsageError: the file cannot be written.
        """
        import pyarrow.parquet

        metadata = {"msgflow.version": __version__}
        if self.header is not None:
            metadata["msgflow.query"] = self.header.words
        target = Path(path)
        with replacing(target) as temporary:
            table = self.table.replace_schema_metadata(metadata)
            pyarrow.parquet.write_table(table, temporary, compression="zstd")
        return target
