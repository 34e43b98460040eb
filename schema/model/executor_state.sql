-- name: staging.executor_state
-- description: The literal reading of the executor's three events: a state lasts until the next
--     such event of the thread; the last one of a thread, or before a gap, has no end.
-- grain: one row per executor event
-- needs: staging.executor_event, staging.executor_gap, staging.executor_thread,
--     staging.callback_instance, staging.callback_dispatch
WITH lasting AS (
    SELECT
        event_id, ts_ns, thread_id, kind,
        lead(ts_ns) OVER on_thread AS next_ns,
        lead(event_id) OVER on_thread AS next_event_id
    FROM staging.executor_event
    WINDOW on_thread AS (PARTITION BY thread_id ORDER BY event_id)
),
state AS (
    SELECT
        l.event_id, l.ts_ns, l.thread_id, l.kind::VARCHAR AS state,
        CASE WHEN g.event_id IS NULL THEN l.next_ns END AS end_ns
    FROM lasting AS l
    LEFT JOIN staging.executor_gap AS g ON l.next_event_id = g.event_id
),
first_run AS (
    SELECT d.executor_event_id, min(c.callback_instance_id) AS callback_instance_id
    FROM staging.callback_instance AS c
    JOIN staging.callback_dispatch AS d ON c.start_event_id = d.start_event_id
    GROUP BY d.executor_event_id
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
LEFT JOIN first_run AS r ON s.event_id = r.executor_event_id
