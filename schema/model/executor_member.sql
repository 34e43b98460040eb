-- name: staging.executor_member
-- description: Which threads work for the same executor: those of a process that execute the same
--     callbacks, directly or through others. The smallest thread of such a group names it.
-- grain: one row per thread that runs callbacks or emits executor events
-- needs: staging.callback_instance, staging.thread_event, staging.thread
WITH RECURSIVE runs AS (
    SELECT DISTINCT thread_id, callback_id FROM staging.callback_instance
),
neighbour AS (
    SELECT DISTINCT a.thread_id, b.thread_id AS other_thread_id
    FROM runs AS a
    JOIN runs AS b ON a.callback_id = b.callback_id AND a.thread_id <> b.thread_id
),
spinning AS (
    SELECT DISTINCT thread_id
    FROM staging.thread_event
    WHERE kind IN ('process', 'wait', 'execute')
),
member AS (
    SELECT thread_id FROM runs
    UNION
    SELECT thread_id FROM spinning
),
reach AS (
    SELECT thread_id, thread_id AS other_thread_id FROM member
    UNION
    SELECT r.thread_id, n.other_thread_id
    FROM reach AS r
    JOIN neighbour AS n ON r.other_thread_id = n.thread_id
)
SELECT
    r.thread_id,
    any_value(t.process_id) AS process_id,
    min(r.other_thread_id) AS first_thread_id,
    bool_or(s.thread_id IS NOT NULL) AS is_spinning
FROM reach AS r
JOIN staging.thread AS t ON r.thread_id = t.thread_id
LEFT JOIN spinning AS s ON r.thread_id = s.thread_id
GROUP BY r.thread_id
