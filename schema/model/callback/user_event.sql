-- description: Events of the user's own programs, numbered in their order, with the callback
--     instance inside which each happened: of those that began on its thread the last, unless it
--     was over; else the nearest one around that which was not over.
-- grain: one row per event of a name that the user asked for
-- when: raw.user_event
WITH RECURSIVE event AS MATERIALIZED (SELECT * FROM staging.located('raw.user_event')),
run AS MATERIALIZED (
    SELECT
        i.callback_instance_id, i.start_event_id, i.thread_id, i.effective_end_event_id,
        i.parent_id, i.is_loss_affected
    FROM staging.callback_instance AS i
    WHERE i.thread_id IN (SELECT thread_id FROM event)
),
around AS (
    SELECT
        e.event_id, r.callback_instance_id, r.parent_id, r.is_loss_affected,
        e.event_id >= r.effective_end_event_id AS is_over
    FROM event AS e
    ASOF JOIN run AS r ON e.thread_id = r.thread_id AND e.event_id > r.start_event_id
    UNION ALL
    SELECT
        a.event_id, r.callback_instance_id, r.parent_id, r.is_loss_affected,
        a.event_id >= r.effective_end_event_id
    FROM around AS a
    JOIN run AS r ON a.parent_id = r.callback_instance_id
    WHERE a.is_over
)
SELECT
    row_number() OVER (ORDER BY e.event_id) AS user_event_id,
    e.trace_index + 1 AS trace_id,
    e.process_id, e.thread_id, e.cpu_id AS cpu, e.ts_ns AS at_ns, e.name, a.callback_instance_id,
    e.fields,
    coalesce(a.is_loss_affected, false) AS is_loss_affected
FROM event AS e
LEFT JOIN (SELECT * FROM around WHERE NOT is_over) AS a ON e.event_id = a.event_id
