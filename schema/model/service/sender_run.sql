-- description: Callback instances that requests and responses were sent in: the innermost on the
--     thread that had begun and was not over. Of a step of Python it is the first one of the call.
-- grain: one row per request or response sent inside a callback instance
-- when: staging.client_event, staging.service_event
WITH send AS (
    SELECT event_id, thread_id FROM staging.client_event WHERE is_request
    UNION ALL
    SELECT event_id, thread_id FROM staging.service_event WHERE NOT is_request
),
run AS (
    SELECT
        n.callback_instance_id, o.callback_instance_id AS parent_id, r.thread_id, r.depth,
        r.start_event_id, r.effective_end_event_id
    FROM staging.callback_run AS r
    SEMI JOIN send AS s ON r.thread_id = s.thread_id
    JOIN staging.callback_number AS n ON r.start_event_id = n.start_event_id
    LEFT JOIN staging.callback_number AS o ON r.parent_event_id = o.start_event_id
),
nesting AS (SELECT DISTINCT thread_id FROM run WHERE parent_id IS NOT NULL),
-- Whose instance goes on after each event; where one ends at the begin of another, the other.
edge AS (
    SELECT run.thread_id, start_event_id AS event_id, callback_instance_id, 0 AS rank
    FROM run
    SEMI JOIN nesting AS n ON run.thread_id = n.thread_id
    UNION ALL
    SELECT run.thread_id, effective_end_event_id, parent_id, depth
    FROM run
    SEMI JOIN nesting AS n ON run.thread_id = n.thread_id
),
change AS (
    SELECT
        thread_id, event_id,
        arg_min(coalesce(callback_instance_id, -1), rank) AS callback_instance_id
    FROM edge
    GROUP BY thread_id, event_id
),
sent AS (
    SELECT s.event_id, r.callback_instance_id
    FROM send AS s
    ASOF JOIN run AS r ON s.thread_id = r.thread_id AND s.event_id >= r.start_event_id
    ANTI JOIN nesting AS n ON s.thread_id = n.thread_id
    WHERE s.event_id < r.effective_end_event_id
    UNION ALL
    SELECT s.event_id, c.callback_instance_id
    FROM send AS s
    ASOF JOIN change AS c ON s.thread_id = c.thread_id AND s.event_id >= c.event_id
    WHERE c.callback_instance_id > 0
)
SELECT s.event_id, coalesce(f.callback_instance_id, s.callback_instance_id) AS callback_instance_id
FROM sent AS s
LEFT JOIN staging.callback_number AS n ON s.callback_instance_id = n.callback_instance_id
LEFT JOIN staging.callback_binding AS p ON n.start_event_id = p.start_event_id
LEFT JOIN staging.callback_number AS f ON p.call_event_id = f.start_event_id
