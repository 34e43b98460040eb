-- name: staging.executor_gap
-- description: Executor events with a gap between themselves and the one before on their thread:
--     the state before it has no known end.
-- grain: one row per executor event behind a gap
-- needs: staging.behind_gap, staging.executor_event
SELECT event_id, thread_id
FROM staging.behind_gap('staging.executor_event')
