-- description: Events with the callback instance that each happened in: of those that began on its
--     thread before it the last, unless it was over; else the nearest one around that which was not
--     over. `events` is the name of a table with their ids and threads.
-- grain: one row per event inside a callback instance
CREATE OR REPLACE MACRO staging.innermost_run(events) AS TABLE
WITH RECURSIVE event AS (SELECT event_id, thread_id FROM query_table(events)),
run AS MATERIALIZED (
    SELECT start_event_id, thread_id, effective_end_event_id, parent_event_id
    FROM staging.callback_run
    WHERE thread_id IN (SELECT thread_id FROM event)
),
around AS (
    SELECT
        e.event_id, r.start_event_id, r.parent_event_id,
        e.event_id >= r.effective_end_event_id AS is_over
    FROM event AS e
    ASOF JOIN run AS r ON e.thread_id = r.thread_id AND e.event_id > r.start_event_id
    UNION ALL
    SELECT
        a.event_id, r.start_event_id, r.parent_event_id,
        a.event_id >= r.effective_end_event_id
    FROM around AS a
    JOIN run AS r ON a.parent_event_id = r.start_event_id
    WHERE a.is_over
)
SELECT event_id, start_event_id FROM around WHERE NOT is_over
