-- name: staging.callback_gap
-- description: Gaps before events of calls. Either the gap interrupts the record of the thread
--     (`is_between`), or it is on other CPUs, which the thread may have visited meanwhile.
--     `segment` numbers the former on each thread.
-- grain: one row per event of a call after a gap
-- when: staging.near_gap
SELECT
    g.event_id,
    c.thread_id,
    g.is_between,
    CASE WHEN g.is_between
        THEN row_number() OVER (PARTITION BY c.thread_id, g.is_between ORDER BY g.event_id)
    END AS segment
FROM staging.near_gap AS g
JOIN staging.context AS c
    ON g.thread_index = c.thread_index
    AND g.event_id >= c.from_event_id
    AND g.event_id < c.until_event_id
WHERE g.sequence = 'call'
