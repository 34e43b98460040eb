-- name: staging.executor_member
-- description: Which threads work for the same executor: those of a process that execute the same
--     callbacks, directly or through others. The smallest thread of such a group names it.
-- grain: one row per thread that runs callbacks or emits executor events
-- needs: staging.callback_instance, staging.executor_event, staging.thread
WITH RECURSIVE runs AS (
    SELECT DISTINCT thread_id, callback_id FROM staging.callback_instance
),
-- Each thread is tied to the smallest one that shares a callback with it, not to all.
neighbour AS (
    SELECT DISTINCT thread_id, min(thread_id) OVER (PARTITION BY callback_id) AS other_thread_id
    FROM runs
),
tie AS (
    SELECT thread_id, other_thread_id FROM neighbour
    UNION
    SELECT other_thread_id, thread_id FROM neighbour
),
spinning AS (
    SELECT DISTINCT thread_id
    FROM staging.executor_event
),
member AS (
    SELECT thread_id FROM runs
    UNION
    SELECT thread_id FROM spinning
),
labelled (thread_id, first_thread_id) USING KEY (thread_id) AS (
    SELECT thread_id, thread_id FROM member
    UNION
    SELECT t.other_thread_id, min(l.first_thread_id)
    FROM labelled AS l
    JOIN tie AS t ON l.thread_id = t.thread_id
    JOIN recurring.labelled AS k ON t.other_thread_id = k.thread_id
    WHERE l.first_thread_id < k.first_thread_id
    GROUP BY t.other_thread_id
)
SELECT
    l.thread_id,
    t.process_id,
    l.first_thread_id,
    s.thread_id IS NOT NULL AS is_spinning
FROM labelled AS l
JOIN staging.thread AS t ON l.thread_id = t.thread_id
LEFT JOIN spinning AS s ON l.thread_id = s.thread_id
