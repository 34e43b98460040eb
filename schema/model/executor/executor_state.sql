-- name: staging.executor_state
-- kind: inline
-- description: The literal reading of the executor's three events: a state lasts until the next
--     such event of the thread; the last one of a thread, or before a gap, has no end.
-- grain: one row per executor event
WITH state AS (
    SELECT
        e.thread_id,
        e.previous_kind AS state,
        e.previous_ns AS start_ns,
        CASE WHEN g.event_id IS NULL THEN e.ts_ns END AS end_ns,
        e.previous_event_id AS start_event_id
    FROM staging.executor_event AS e
    LEFT JOIN (SELECT event_id FROM staging.near_gap WHERE sequence = 'executor' AND is_behind) AS g
        ON e.event_id = g.event_id
    WHERE e.previous_event_id >= e.from_event_id
    UNION ALL
    SELECT thread_id, arg_max(kind, event_id), arg_max(ts_ns, event_id), NULL, max(event_id)
    FROM staging.executor_event
    GROUP BY thread_id
)
SELECT
    t.executor_id,
    s.thread_id,
    s.state,
    s.start_ns,
    s.end_ns,
    -- Not a join: DuckDB would keep the states in memory for it, which are four times as many.
    (
        SELECT c.callback_instance_id
        FROM staging.executor_callback AS c
        WHERE c.executor_event_id = s.start_event_id
    ) AS callback_instance_id,
    s.start_event_id
FROM state AS s
LEFT JOIN staging.executor_thread AS t ON s.thread_id = t.thread_id
