-- name: staging.callback_parent
-- description: Callback instances that are nested in another one.
-- grain: one row per such callback instance
-- needs: staging.callback_run, staging.callback_number
WITH inner_run AS (
    SELECT start_event_id, thread_id, depth FROM staging.callback_run WHERE depth > 1
),
outer_run AS (
    SELECT start_event_id, thread_id, depth FROM staging.callback_run WHERE NOT is_plain
),
nested AS (
    SELECT n.start_event_id, p.start_event_id AS parent_event_id
    FROM inner_run AS n
    ASOF JOIN outer_run AS p
        ON n.thread_id = p.thread_id
        AND n.depth - 1 = p.depth
        AND n.start_event_id > p.start_event_id
)
SELECT n.start_event_id, c.callback_instance_id AS parent_id
FROM nested AS n
JOIN staging.callback_number AS c ON n.parent_event_id = c.start_event_id
