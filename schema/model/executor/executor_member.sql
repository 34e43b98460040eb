-- description: Which threads work for the same executor: those of a process that execute callbacks
--     of an executor that names itself, else the same callbacks, directly or through others, or
--     that take turns in waiting for work. The smallest thread of such a group stands for it.
-- grain: one row per thread that runs callbacks or emits executor events
-- when: staging.callback_number, staging.executor_first
WITH RECURSIVE
-- Threads of the executors that are named. If a thread serves several of them, it belongs to
-- the one whose callbacks it ran most.
thread_executor AS MATERIALIZED (
    SELECT thread_id, executor_event_id
    FROM (
        SELECT r.thread_id, s.executor_event_id, count(*) AS run_count
        FROM staging.callback_run AS r
        JOIN staging.callback_number AS n ON r.start_event_id = n.start_event_id
        JOIN staging.callback_group_entry AS s ON n.callback_id = s.callback_id
        WHERE r.depth = 1 AND s.executor_event_id IS NOT NULL
        GROUP BY r.thread_id, s.executor_event_id
        UNION ALL
        SELECT m.thread_id, min(x.event_id), 0
        FROM staging.python_mark AS m
        JOIN staging.executor_named AS x
            ON m.process_id = x.process_id AND m.number = x.executor_addr
        WHERE m.kind = 'executor'
        GROUP BY m.thread_id
    )
    QUALIFY row_number() OVER (
        PARTITION BY thread_id ORDER BY run_count DESC, executor_event_id
    ) = 1
),
-- What ties threads: an executor by its event, or a callback by its (never negative) identity.
runs AS (
    SELECT thread_id, -1 - executor_event_id AS tie_id FROM thread_executor
    UNION ALL
    SELECT DISTINCT r.thread_id, n.callback_id
    FROM staging.callback_pair AS r
    JOIN staging.callback_number AS n ON r.start_event_id = n.start_event_id
    ANTI JOIN staging.callback_group_entry AS s
        ON n.callback_id = s.callback_id AND s.executor_event_id IS NOT NULL
    UNION ALL
    SELECT thread_id, -1 - first_event_id FROM staging.executor_alternating
),
-- Each thread is tied to the smallest one that shares something with it, not to all.
neighbour AS (
    SELECT DISTINCT thread_id, min(thread_id) OVER (PARTITION BY tie_id) AS other_thread_id
    FROM runs
),
tie AS (
    SELECT thread_id, other_thread_id FROM neighbour
    UNION
    SELECT other_thread_id, thread_id FROM neighbour
),
spinning AS (SELECT thread_id FROM staging.executor_first),
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
    l.thread_id, t.process_id, l.first_thread_id,
    s.thread_id IS NOT NULL AS is_spinning,
    m.executor_event_id
FROM labelled AS l
JOIN staging.thread AS t ON l.thread_id = t.thread_id
LEFT JOIN spinning AS s ON l.thread_id = s.thread_id
LEFT JOIN thread_executor AS m ON l.thread_id = m.thread_id
