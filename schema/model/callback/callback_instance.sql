-- name: staging.callback_instance
-- description: Callback instances, numbered in the order in which they began, with the one that
--     each is nested in.
-- grain: one row per callback instance
-- needs: staging.callback_run, staging.callback_number, staging.beside_gap, staging.callback_gap,
--     staging.request_origin
WITH numbered AS (
    SELECT
        c.callback_instance_id,
        r.trace_index + 1 AS trace_id,
        c.callback_id,
        r.process_id,
        r.thread_id,
        r.start_ns,
        r.end_ns,
        c.take_id,
        r.is_intra_process,
        r.depth,
        r.is_plain,
        r.start_event_id,
        r.end_event_id,
        r.effective_end_event_id
    FROM staging.callback_run AS r
    JOIN staging.callback_number AS c ON r.start_event_id = c.start_event_id
),
nested AS (
    SELECT n.callback_instance_id, p.callback_instance_id AS parent_id
    FROM (SELECT * FROM numbered WHERE depth > 1) AS n
    ASOF JOIN (SELECT * FROM numbered WHERE NOT is_plain) AS p
        ON n.thread_id = p.thread_id
        AND n.depth - 1 = p.depth
        AND n.start_event_id > p.start_event_id
),
-- Instances with a gap inside, right before, or (never seen to end) right after; or with one of
-- other CPUs in their time, which the thread may have visited: two instances may look like one.
exposed AS (
    SELECT callback_instance_id, thread_id, start_event_id, end_event_id, effective_end_event_id
    FROM numbered
    WHERE thread_id IN (SELECT thread_id FROM staging.beside_gap)
),
elsewhere AS (
    SELECT thread_id, event_id FROM staging.callback_gap WHERE NOT is_between
),
touched AS (
    SELECT e.callback_instance_id
    FROM exposed AS e
    ASOF JOIN (SELECT thread_id, event_id FROM staging.beside_gap WHERE is_behind) AS g
        ON e.thread_id = g.thread_id AND e.effective_end_event_id >= g.event_id
    WHERE g.event_id >= e.start_event_id
    UNION
    SELECT e.callback_instance_id
    FROM (SELECT * FROM exposed WHERE end_event_id IS NULL) AS e
    ASOF JOIN (SELECT thread_id, event_id FROM staging.beside_gap WHERE NOT is_behind) AS g
        ON e.thread_id = g.thread_id AND e.effective_end_event_id > g.event_id
    WHERE g.event_id >= e.start_event_id
    UNION
    SELECT e.callback_instance_id
    FROM (
        SELECT * FROM numbered WHERE thread_id IN (SELECT thread_id FROM elsewhere)
    ) AS e
    ASOF JOIN elsewhere AS g
        ON e.thread_id = g.thread_id AND e.effective_end_event_id >= g.event_id
    WHERE g.event_id > e.start_event_id
)
SELECT
    n.callback_instance_id, n.trace_id, n.callback_id, n.process_id, n.thread_id, n.start_ns,
    n.end_ns, n.take_id, q.request_id, n.is_intra_process, p.parent_id, n.depth,
    n.start_event_id, n.end_event_id, n.effective_end_event_id,
    g.callback_instance_id IS NOT NULL AS is_loss_affected
FROM numbered AS n
LEFT JOIN nested AS p ON n.callback_instance_id = p.callback_instance_id
LEFT JOIN touched AS g ON n.callback_instance_id = g.callback_instance_id
LEFT JOIN staging.request_origin AS q ON n.start_event_id = q.callback_start_event_id
