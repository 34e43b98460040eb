"""Topics that a user names: those that no run has are refused, not answered with nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgflow.errors import UsageError
from msgflow.query.catalogue import nearest

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import duckdb

    from msgflow.query.value import Value
    from msgflow.query.window import Run

# Parameters with these names take a topic, in every query that has them.
TOPIC_PARAMETERS = ("from", "to", "topic")
_SHOWN = 3
_TOPICS = """
SELECT topic_name FROM main.publisher WHERE list_contains($runs, run_id)
UNION
SELECT topic_name FROM main.subscription WHERE list_contains($runs, run_id)
"""


def require_topics(
    connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], bound: Mapping[str, Value]
) -> None:
    """Raise unless every topic among the parameters of a query is one of the chosen runs.

    Args:
        connection: to a database with the public views.
        runs: the chosen runs; where there are none, every topic will do.
        bound: all parameters of the query.

    Raises:
        UsageError: it names similar topics, else the first few.
    """
    for key in TOPIC_PARAMETERS:
        if isinstance(name := bound.get(key), str) and runs:
            require_topic(connection, runs, name)


def require_topic(connection: duckdb.DuckDBPyConnection, runs: Sequence[Run], name: str) -> None:
    """Raise unless the chosen runs have a topic.

    Args:
        connection: to a database with the public views.
        runs: the chosen runs, at least one.
        name: of the topic.

    Raises:
        UsageError: it names similar topics, else the first few.
    """
    rows = connection.execute(_TOPICS, {"runs": [run.run_id for run in runs]}).fetchall()
    known = sorted(known_name for (known_name,) in rows if known_name is not None)
    if name not in known:
        where = "the run" if len(runs) == 1 else "these runs"
        raise UsageError(f"there is no such topic in {where} — {name}", _hint(name, known))


def _hint(name: str, known: list[str]) -> str:
    if near := nearest(name, known):
        return f"did you mean {' or '.join(near)}"
    if not known:
        return "msgflow query info-topics"
    more = len(known) - _SHOWN
    rest = f" and {more} more (msgflow query info-topics)" if more > 0 else ""
    return f"the topics are {', '.join(known[:_SHOWN])}{rest}"
