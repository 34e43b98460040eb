-- description: Callback groups (CARET), with the executors that they were added to.
-- grain: one row per callback group and executor
-- when: staging.callback_group_owner
SELECT
    g.callback_group_id, g.process_id, x.executor_id,
    coalesce(g.kind, 'unknown') AS kind,
    g.event_id
FROM staging.callback_group_owner AS g
LEFT JOIN staging.executor AS x ON g.executor_event_id = x.executor_event_id
