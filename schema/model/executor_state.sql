-- name: staging.executor_state
-- description: The literal reading of the executor's three events: a state lasts until the next
--     such event of the thread; the last one of a thread, or before a gap, has no end.
-- grain: one row per executor event
-- needs: staging.thread_event, staging.thread_gap, staging.executor_thread,
--     staging.callback_instance
WITH numbered AS (
    SELECT
        thread_id, event_id, row_number() OVER (PARTITION BY thread_id ORDER BY event_id) AS segment
    FROM staging.thread_gap
),
executor_event AS (
    SELECT
        e.event_id, e.ts_ns, e.thread_id, e.kind::VARCHAR AS state,
        coalesce(g.segment, 0) AS segment
    FROM staging.thread_event AS e
    ASOF LEFT JOIN numbered AS g ON e.thread_id = g.thread_id AND e.event_id >= g.event_id
    WHERE e.kind IN ('process', 'wait', 'execute')
),
state AS (
    SELECT
        event_id, ts_ns, thread_id, state,
        lead(ts_ns) OVER (PARTITION BY thread_id, segment ORDER BY event_id) AS end_ns
    FROM executor_event
),
first_run AS (
    SELECT s.event_id, min(c.callback_instance_id) AS callback_instance_id
    FROM (SELECT * FROM staging.callback_instance WHERE depth = 1) AS c
    ASOF JOIN state AS s
        ON c.thread_id = s.thread_id AND c.start_event_id > s.event_id
    WHERE s.end_ns IS NULL OR c.start_ns <= s.end_ns
    GROUP BY s.event_id
)
SELECT
    t.executor_id,
    s.thread_id,
    s.state,
    s.ts_ns AS start_ns,
    s.end_ns,
    r.callback_instance_id,
    s.event_id AS start_event_id
FROM state AS s
LEFT JOIN staging.executor_thread AS t ON s.thread_id = t.thread_id
LEFT JOIN first_run AS r ON s.event_id = r.event_id
ORDER BY s.event_id
