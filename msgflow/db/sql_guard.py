"""The guard of SQL that users write: one query, or EXPLAIN of one, which cannot change anything.

DuckDB's parser tells what kind of statement a text is. That is not enough: `WITH x AS (DELETE FROM
…) FROM x` is a SELECT, and so is the same with COPY. The first changes a database in memory, which
`fleet sql` reads; the second can write to the log and the spill directory of a read-only file,
depending on the version of DuckDB. DuckDB allows such a WITH at the top of a statement only. Hence
a query runs as a subquery. Which files a query can read is up to the sandbox of its connection
(`msgflow/db/sandbox.py`).
"""

from __future__ import annotations

import re

import duckdb

from msgflow.errors import QueryError, UsageError

_CONDITION_HINT = "such as --where \"p99_ns > 80e6 AND node LIKE '%planner'\""
_HINT = "SELECT, FROM, WITH, VALUES, DESCRIBE, SUMMARIZE, SHOW and EXPLAIN of such read"
# Where DuckDB sees an error: the line, and below it a mark.
_PLACE = re.compile(r"^LINE (?P<line>\d+): (?P<text>.*)\n(?P<mark> *\^*)", re.MULTILINE)


def guarded_query(
    con: duckdb.DuckDBPyConnection, text: str, example: str, limit: int | None = None
) -> str:
    """Return the SQL to run in place of the query in `text`, with the same rows, at most `limit`.

    Any connection parses it. A UsageError shows `example`, a command with SQL. Another kind of
    statement, or more than one, is a QueryError, and what is no SQL a `duckdb.Error`.
    """
    statements = _statements(con, text)
    if not statements:
        raise UsageError("there is no SQL to run", example)
    if len(statements) > 1:
        raise QueryError(
            f"one query at a time — {len(statements)} statements", "run them one after the other"
        )
    ((kind, statement),) = statements
    # DuckDB counts bytes.
    code = statement.encode()
    tokens = [at for at, token in duckdb.tokenize(statement) if token.name != "comment"]
    end = next((at for at in tokens if code.startswith(b";", at)), len(code))
    if kind == "SELECT":
        most = "" if limit is None else f"\nLIMIT {limit}"
        return f"{_as_subquery(code[:end])}{most}"
    start = _start_of_explained(con, code[:end], tokens) if kind == "EXPLAIN" else None
    if start is not None:
        return f"{code[:start].decode()} {_as_subquery(code[start:end])}"
    if kind == "MULTI":
        raise QueryError(
            "PIVOT has to find its columns first, by creating a type",
            "name them: PIVOT … ON column IN ('a', 'b') USING …",
        )
    raise _refused(kind.replace("_", " "))


def in_own_lines(message: str) -> str:
    """Return what DuckDB says of a guarded query, with lines as in the query that was given."""

    def counted(found: re.Match[str]) -> str:
        line = str(int(found["line"]) - 1)
        shift = len(found["line"]) - len(line)
        return f"LINE {line}: {found['text']}\n{found['mark'][shift:]}"

    return _PLACE.sub(counted, message)


def require_condition(
    con: duckdb.DuckDBPyConnection, text: str, hint: str = _CONDITION_HINT
) -> None:
    """Raise unless `text` is one expression of SQL, without parameters; any connection will do."""
    try:
        # `1) OR (1=1` is no expression, but would pass inside of parentheses; `1 AS x` would not.
        for each in (text, f"({text}\n)"):
            duckdb.SQLExpression(each)
        (statement,) = con.extract_statements(f"SELECT {text}\n")
    except duckdb.Error as error:
        reason = str(error).splitlines()[0]
        raise UsageError(f"--where is no condition in SQL: {reason} — {text}", hint) from error
    if statement.named_parameters:
        raise UsageError(f"--where takes no parameters — {text}", hint)


def _statements(con: duckdb.DuckDBPyConnection, text: str) -> list[tuple[str, str]]:
    try:
        return [
            (statement.type.name, statement.query) for statement in con.extract_statements(text)
        ]
    except ValueError as error:  # a kind of statement that Python has no name for
        raise _refused("a kind of statement that msgflow does not know") from error


def _as_subquery(query: bytes) -> str:
    # A comment at the end of the query ends with the line. `in_own_lines` knows of the first line.
    return f"FROM (\n{query.decode()}\n)"


def _start_of_explained(
    con: duckdb.DuckDBPyConnection, code: bytes, tokens: list[int]
) -> int | None:
    """Return where the query begins that an EXPLAIN explains; None: it explains something else."""

    def is_query(start: int) -> bool:
        try:
            found = _statements(con, code[start:].decode())
        except duckdb.Error:
            return False
        return [kind for kind, _ in found] == ["SELECT"]

    words = iter([*(at for at in tokens if at < len(code)), len(code)])
    next(words)
    start = next(words)
    if re.match(rb"ANALYZE\b", code[start:], re.IGNORECASE):
        start = next(words)
    if code.startswith(b"(", start) and not is_query(start):
        # Options, such as (FORMAT json).
        while not code.startswith(b")", next(words)):
            pass
        start = next(words)
    return start if is_query(start) else None


def _refused(what: str) -> QueryError:
    return QueryError(f"not a statement that only reads — {what}", _HINT)
