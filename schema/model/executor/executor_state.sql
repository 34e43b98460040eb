-- kind: inline
-- description: The literal reading of the executor's three events: each begins a state. When it
--     ended is not stored: derive.executor_interval reads it off the next one.
-- grain: one row per executor event
SELECT
    e.thread_id,
    e.kind AS state,
    e.ts_ns AS start_ns,
    e.event_id IN (
        SELECT event_id FROM staging.near_gap WHERE sequence = 'executor' AND is_behind
    ) AS is_behind_gap,
    -- Not a join: DuckDB would keep the states in memory for it, which are four times as many.
    (
        SELECT c.callback_instance_id
        FROM staging.executor_callback AS c
        WHERE c.executor_event_id = e.event_id
    ) AS callback_instance_id,
    e.event_id AS start_event_id
FROM staging.executor_event AS e
