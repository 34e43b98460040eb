"""What a thread did after it published is certain only where nothing of it is missing meanwhile."""

from __future__ import annotations

import pytest
from support.rules import derived

STAGE = """
CREATE TABLE store.host AS SELECT 1 AS host_id, 1 AS clock_id;
CREATE TABLE store.process AS SELECT 1 AS process_id, 1 AS host_id;
CREATE TABLE store.publisher AS SELECT 1 AS publisher_id, '/a' AS topic_name;
CREATE TABLE store.publication AS
SELECT 1 AS run_id, 1 AS publication_id, 1 AS publisher_id, 1 AS process_id, 1 AS thread_id,
    100 AS rmw_ns, 90 AS rcl_ns, NULL::BIGINT AS dds_ns, 200 AS next_event_ns,
    NULL::BIGINT AS source_timestamp_ns, false AS is_loss_affected;
CREATE TABLE store.thread_break (thread_id BIGINT, resumed_ns BIGINT);
"""


@pytest.mark.parametrize(
    ("resumed", "thread", "has_break"),
    [(100, 1, False), (101, 1, True), (200, 1, True), (201, 1, False), (150, 2, False)],
)
def test_the_next_event_behind_a_gap(resumed: int, thread: int, has_break: bool) -> None:
    with derived(STAGE, {"unstamped_publication", "unstamped_call"}) as con:
        con.execute("INSERT INTO store.thread_break VALUES (?, ?)", [thread, resumed])
        assert con.sql(
            "SELECT next_event_ns, has_break FROM derive.unstamped_publication(1)"
        ).fetchall() == [(200, has_break)]
