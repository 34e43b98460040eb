-- description: Executors. Stock traces do not name them: there they are deduced from their threads.
--     One thread with executor events is a single-threaded executor. One without is an events
--     executor if it was seen to serve what came first first, else it may be any.
-- grain: one row per executor
-- when: staging.callback_number, staging.executor_first, staging.executor_named

-- Threads of one executor that its lock shows: the threads of a process take turns in waiting for
-- work, and no two of them ever wait at once. Threads of several executors do.
-- when: staging.executor_first WHERE process_id IN (
--     SELECT process_id FROM staging.executor_first GROUP BY process_id HAVING count(*) > 1)
-- columns: thread_id BIGINT, first_event_id BIGINT
CREATE OR REPLACE TEMP TABLE executor_alternating AS
WITH several AS (
    SELECT
        process_id,
        min(event_id) AS first_event_id
    FROM staging.executor_first
    GROUP BY process_id
    HAVING count(*) > 1
),
turn AS (
    SELECT
        e.process_id,
        e.thread_id <> lag(e.thread_id) OVER in_process AS is_other,
        sum((e.kind = 'wait')::INTEGER - coalesce(e.previous_kind = 'wait', false)::INTEGER)
            OVER in_process AS waiting
    FROM staging.executor_event AS e
    WHERE e.process_id IN (SELECT process_id FROM several)
    WINDOW in_process AS (PARTITION BY e.process_id ORDER BY e.event_id)
)
SELECT s.thread_id, p.first_event_id
FROM staging.executor_first AS s
JOIN several AS p ON s.process_id = p.process_id
WHERE s.process_id IN (
    -- Ten turns: once, one may have begun when another had ended.
    SELECT process_id
    FROM turn
    GROUP BY process_id
    HAVING max(waiting) = 1 AND count(*) FILTER (WHERE is_other) >= 10
);

-- Threads of the executors that are named. If a thread serves several of them, it belongs to the
-- one whose callbacks it ran most.
-- when: staging.callback_group_member, staging.python_mark WHERE kind = 'executor'
-- columns: thread_id BIGINT, executor_event_id BIGINT
CREATE OR REPLACE TEMP TABLE thread_executor AS
SELECT thread_id, executor_event_id
FROM (
    SELECT
        r.thread_id, s.executor_event_id,
        count(*) AS run_count
    FROM staging.callback_run AS r
    JOIN staging.callback_number AS n ON r.start_event_id = n.start_event_id
    JOIN staging.callback_group_member AS s ON n.callback_id = s.callback_id
    WHERE r.depth = 1 AND s.executor_event_id IS NOT NULL
    GROUP BY r.thread_id, s.executor_event_id
    UNION ALL
    SELECT
        m.thread_id,
        min(x.event_id),
        0
    FROM staging.python_mark AS m
    JOIN staging.executor_named AS x
        ON m.process_id = x.process_id AND m.number = x.executor_addr
    WHERE m.kind = 'executor'
    GROUP BY m.thread_id
)
QUALIFY row_number() OVER (
    PARTITION BY thread_id ORDER BY run_count DESC, executor_event_id
) = 1;

-- Which threads work for the same executor: those of a process that execute callbacks of an
-- executor that names itself, else the same callbacks, directly or through others, or that take
-- turns in waiting for work. Threads of Python that do jobs are of none because of that. The
-- smallest thread of such a group stands for it.
CREATE OR REPLACE TEMP TABLE executor_member AS
WITH RECURSIVE
-- What ties threads: an executor by its event, or a callback by its (never negative) identity.
runs AS (
    SELECT
        thread_id,
        -1 - executor_event_id AS tie_id
    FROM thread_executor
    UNION ALL
    SELECT DISTINCT r.thread_id, n.callback_id
    FROM staging.callback_run AS r
    JOIN staging.callback_number AS n ON r.start_event_id = n.start_event_id
    ANTI JOIN staging.callback_group_member AS s
        ON n.callback_id = s.callback_id AND s.executor_event_id IS NOT NULL
    ANTI JOIN (FROM staging.python_mark WHERE kind = 'job') AS m ON r.thread_id = m.thread_id
    UNION ALL
    SELECT
        thread_id,
        -1 - first_event_id
    FROM executor_alternating
),
-- Each thread is tied to the smallest one that shares something with it, not to all.
neighbour AS (
    SELECT DISTINCT
        thread_id,
        min(thread_id) OVER (PARTITION BY tie_id) AS other_thread_id
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
    SELECT
        t.other_thread_id,
        min(l.first_thread_id)
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
LEFT JOIN thread_executor AS m ON l.thread_id = m.thread_id;

WITH deduced AS (
    SELECT
        m.first_thread_id,
        any_value(m.process_id) AS process_id,
        list(m.thread_id ORDER BY m.thread_id) AS thread_ids,
        min(m.executor_event_id) AS executor_event_id,
        CASE
            WHEN count(*) > 1 THEN 'multi_threaded'
            WHEN bool_or(m.is_spinning) THEN 'single_threaded'
            WHEN bool_or(m.thread_id IN (
                SELECT thread_id FROM staging.queued_message WHERE is_in_order
            ))
                THEN 'events'
            ELSE 'unknown'
        END AS kind
    FROM executor_member AS m
    GROUP BY m.first_thread_id
),
every_executor AS (
    SELECT
        d.first_thread_id, d.process_id, d.thread_ids, d.executor_event_id,
        CASE WHEN x.kind <> 'unknown' THEN x.kind ELSE d.kind END AS kind,
        x.event_id IS NULL AS is_inferred
    FROM deduced AS d
    LEFT JOIN staging.executor_named AS x ON d.executor_event_id = x.event_id
    UNION ALL
    SELECT
        NULL, x.process_id,
        [],
        x.event_id, x.kind, false
    FROM staging.executor_named AS x
    ANTI JOIN deduced AS d ON x.event_id = d.executor_event_id
)
SELECT
    row_number() OVER (ORDER BY first_thread_id NULLS LAST, executor_event_id) AS executor_id,
    process_id, kind, is_inferred, thread_ids, executor_event_id
FROM every_executor
