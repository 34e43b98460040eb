-- description: Events of the user's own programs, numbered in their order, with the callback
--     instance that each happened in.
-- grain: one row per event of a name that the user asked for
-- when: raw.user_event
WITH event AS MATERIALIZED (FROM staging.located('raw.user_event'))
SELECT
    row_number() OVER (ORDER BY e.event_id) AS user_event_id,
    e.trace_index + 1 AS trace_id,
    e.process_id, e.thread_id,
    e.cpu_id AS cpu,
    e.ts_ns AS at_ns,
    e.name, n.callback_instance_id, e.fields,
    l.start_event_id IS NOT NULL AS is_loss_affected
FROM event AS e
LEFT JOIN staging.innermost_run('event') AS r ON e.event_id = r.event_id
LEFT JOIN staging.callback_number AS n ON r.start_event_id = n.start_event_id
LEFT JOIN (SELECT * FROM staging.loss_affected WHERE kind = 'callback') AS l
    ON n.start_event_id = l.start_event_id
