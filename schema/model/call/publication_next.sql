-- description: When the publishing thread went on after each publication without a stamp: what was
--     stamped later is another message. Not known where the thread did nothing more, or where a
--     gap may hide what it did.
-- grain: one row per publish() call without a stamp after which the thread went on
-- when: staging.publication_call
--     WHERE source_timestamp_ns IS NULL AND coalesce(rmw_ns, rcl_ns) IS NOT NULL
WITH unstamped AS MATERIALIZED (
    SELECT start_event_id, end_event_id, thread_id
    FROM staging.publication_call
    WHERE source_timestamp_ns IS NULL AND coalesce(rmw_ns, rcl_ns) IS NOT NULL
),
next_call AS (
    SELECT
        u.start_event_id,
        min(e.event_id) AS event_id,
        min(e.ts_ns) AS ts_ns
    FROM staging.predecessor AS e
    JOIN unstamped AS u ON e.previous_event_id = u.end_event_id
    -- What the user's own code records may be inside the call.
    ANTI JOIN raw.user_event AS o ON e.event_id = o.event_id
    WHERE e.sequence = 'call'
    GROUP BY u.start_event_id
),
next_executor AS (
    SELECT u.start_event_id, x.event_id, x.ts_ns
    FROM unstamped AS u
    ASOF JOIN (
        SELECT event_id, thread_id, ts_ns
        FROM staging.executor_event
        WHERE thread_id IN (SELECT thread_id FROM unstamped)
    ) AS x
        ON u.thread_id = x.thread_id AND u.end_event_id < x.event_id
),
earlier AS (
    SELECT
        start_event_id,
        least(c.event_id, x.event_id) AS event_id,
        CASE WHEN coalesce(c.event_id < x.event_id, c.event_id IS NOT NULL) THEN c.ts_ns
            ELSE x.ts_ns END AS ts_ns
    FROM next_call AS c
    FULL JOIN next_executor AS x USING (start_event_id)
)
SELECT
    e.start_event_id,
    e.ts_ns AS next_event_ns
FROM earlier AS e
ANTI JOIN (
    SELECT event_id FROM staging.near_gap WHERE sequence IN ('call', 'executor') AND is_behind
) AS g ON e.event_id = g.event_id
