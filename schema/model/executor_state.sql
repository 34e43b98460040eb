-- name: staging.executor_state
-- description: The literal reading of the executor's three events: a state lasts until the next
--     such event of the thread; the last one of a thread, or before a gap, has no end.
-- grain: one row per executor event
-- needs: staging.thread_event, staging.thread_gap, staging.executor_thread,
--     staging.callback_instance
WITH lasting AS (
    SELECT
        event_id, ts_ns, thread_id, kind,
        lead(ts_ns) OVER (PARTITION BY thread_id ORDER BY event_id) AS next_ns
    FROM staging.thread_event
    WHERE kind IN ('process', 'wait', 'execute')
),
interrupted AS (
    SELECT l.event_id, min(g.event_id) AS gap_event_id
    FROM staging.thread_gap AS g
    ASOF JOIN lasting AS l ON g.thread_id = l.thread_id AND g.event_id > l.event_id
    GROUP BY l.event_id
),
state AS (
    SELECT
        l.event_id, l.ts_ns, l.thread_id, l.kind::VARCHAR AS state,
        CASE WHEN i.event_id IS NULL THEN l.next_ns END AS end_ns,
        i.gap_event_id
    FROM lasting AS l
    LEFT JOIN interrupted AS i ON l.event_id = i.event_id
),
first_run AS (
    SELECT s.event_id, min(c.callback_instance_id) AS callback_instance_id
    FROM staging.callback_instance AS c
    ASOF JOIN state AS s
        ON c.thread_id = s.thread_id AND c.start_event_id > s.event_id
    WHERE s.gap_event_id IS NULL OR c.start_event_id < s.gap_event_id
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
