-- name: staging.callback_gap
-- description: Gaps that threads have seen while they made calls, numbered on each thread.
-- grain: one row per event of a call behind a gap
-- needs: staging.behind_gap, staging.context
SELECT
    g.event_id,
    c.thread_id,
    row_number() OVER (PARTITION BY c.thread_id ORDER BY g.event_id) AS segment
FROM staging.behind_gap AS g
JOIN staging.context AS c
    ON g.thread_index = c.thread_index
    AND g.event_id >= c.from_event_id
    AND g.event_id < c.until_event_id
WHERE g.sequence = 'call'
