-- name: staging.callback_executor
-- description: The executors that name themselves, and the callbacks of their groups.
-- grain: one row per callback of such an executor
-- when: staging.callback_group_entry
SELECT e.callback_id, g.executor_event_id
FROM staging.callback_group_entry AS e
JOIN staging.callback_group_owner AS g ON e.group_event_id = g.event_id
WHERE g.executor_event_id IS NOT NULL
