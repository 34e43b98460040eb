-- description: Ends of callbacks whose begin was not recorded, with the begin or end of a callback
--     that came before on the thread.
-- grain: one row per callback_end without a callback_start
-- when: raw.ros2_callback_end
WITH alone AS (
    SELECT e.event_id, e.trace_index, e.thread_id
    FROM staging.located('raw.ros2_callback_end') AS e
    ANTI JOIN staging.callback_run AS r ON e.event_id = r.end_event_id
),
paired AS (
    SELECT
        thread_id,
        unnest([start_event_id, end_event_id]) AS event_id
    FROM staging.callback_run
    WHERE thread_id IN (SELECT thread_id FROM alone)
)
SELECT
    a.event_id, a.trace_index,
    p.event_id AS previous_event_id
FROM alone AS a
ASOF LEFT JOIN paired AS p ON a.thread_id = p.thread_id AND a.event_id > p.event_id
