-- name: check.interval_is_ordered
-- description: Nothing ends before it begins.
-- grain: one row per publication, callback instance or executor state that does
-- severity: error
SELECT run_id, 'publication' AS kind, start_event_id
FROM store.publication
WHERE end_ns < start_ns
UNION ALL
SELECT run_id, 'callback_instance', start_event_id
FROM store.callback_instance
WHERE end_ns < start_ns
UNION ALL
SELECT run_id, 'executor_state', start_event_id
FROM store.executor_state
WHERE end_ns < start_ns
