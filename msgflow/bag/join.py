"""Bags: messages of a rosbag2 of the same run, joined to their publications.

A trace has neither the size nor the content of a message. A bag has both, and says when the
recorder received each message. It does not name the publication: `schema/internal/bag` finds it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msgflow.errors import UsageError
from msgflow.result.query_result import QueryResult
from msgflow.sql.statement import internal_sql

if TYPE_CHECKING:
    import duckdb
    import pyarrow as pa

    from msgflow.run.choice import Run

_CLOCKS_APART = """
SELECT count(*) > 1
    AND (count(reference_clock_id) < count(*) OR count(DISTINCT reference_clock_id) > 1)
FROM main.clock
WHERE run_id = ?
"""
_STORED = """
INSERT INTO store.bag_message BY NAME
SELECT $run_id AS run_id, publication_id, topic_name, type_name, received_ns, size_bytes, stamp_ns,
    frame_id
FROM bag_joined
WHERE publication_id IS NOT NULL
ORDER BY publication_id
"""


def join_bag(
    con: duckdb.DuckDBPyConnection, runs: tuple[Run, ...], messages: pa.RecordBatchReader
) -> QueryResult:
    """Store which publications the messages of a bag are of; see `Database.join_bag`."""
    if len(runs) > 1:
        raise UsageError("a bag is of one run", "give its name with --run")
    (one,) = runs
    if con.execute(_CLOCKS_APART, [one.run_id]).fetchall() == [(True,)]:
        raise UsageError(
            f"the run has hosts whose clocks are not synchronised — {one.name}",
            f"msgflow clocks apply messages --run {one.name}",
        )
    given: dict[str, Any] = {"run_id": one.run_id}
    con.register("bag_messages", messages)
    con.execute("CREATE OR REPLACE TEMP TABLE bag_read AS FROM bag_messages")
    con.unregister("bag_messages")
    internal_sql().keep(con, "bag_joined", given)
    con.execute("DELETE FROM store.bag_message WHERE run_id = $run_id", given)
    con.execute(_STORED, given)
    table = internal_sql().run(con, "bag_topic", {}).to_arrow_table()
    con.execute("DROP TABLE temp.bag_read")
    con.execute("DROP TABLE temp.bag_joined")
    return QueryResult(table, internal_sql().header("bag_topic"), runs)
