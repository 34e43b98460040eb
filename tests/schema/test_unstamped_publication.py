"""What a thread did after it published is certain only where nothing of it is missing meanwhile."""

from __future__ import annotations

import pytest
from support.rules import derived

STAGE = """
CREATE TABLE store.host AS SELECT 1 AS host_id, 1 AS clock_id;
CREATE TABLE store.process AS SELECT 1 AS process_id, 1 AS host_id, 1 AS last_seen_ns;
CREATE TABLE store.publisher AS SELECT 1 AS publisher_id, '/a' AS topic_name;
CREATE TABLE store.publication AS
SELECT 1 AS run_id, 1 AS publication_id, 1 AS publisher_id, 1 AS process_id, 1 AS thread_id,
    100 AS rmw_ns, 90 AS rcl_ns, NULL::BIGINT AS dds_ns, 200::BIGINT AS next_event_ns,
    NULL::BIGINT AS source_timestamp_ns, false AS is_loss_affected;
CREATE TABLE store.thread_break (thread_id BIGINT, resumed_ns BIGINT);
"""


@pytest.mark.parametrize(
    ("resumed", "thread", "following", "closes", "goes_on"),
    [
        (100, 1, 200, 200, True),
        (101, 1, 200, 200, False),
        (101, 1, 9_000_000, 5_000_100, False),
        (200, 1, 200, 200, False),
        (201, 1, 200, 200, True),
        (150, 2, 9_000_000, 9_000_000, True),
        (201, 1, None, 5_000_100, False),
    ],
)
def test_a_write_ends_with_the_next_event_unless_a_gap_is_before_it(
    resumed: int, thread: int, following: int | None, closes: int, *, goes_on: bool
) -> None:
    with derived(STAGE, {"clock_limit", "unstamped_publication", "unstamped_call"}) as con:
        con.execute("INSERT INTO store.thread_break VALUES (?, ?)", [thread, resumed])
        con.execute("UPDATE store.publication SET next_event_ns = ?", [following])
        assert con.sql(
            "SELECT closes_ns, goes_on FROM derive.unstamped_publication(1)"
        ).fetchall() == [(closes, goes_on)]
