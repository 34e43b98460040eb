-- name: staging.loss_affected
-- description: Publications, takes and callback instances that a gap may have cut or mixed. A gap
--     lies right before them, inside, or right behind; but behind an instance that was seen to end,
--     it is none of its own. Or one of other CPUs lies inside, which the thread may have visited:
--     two may look like one. Or a callback that was handed a message without a take is right behind
--     the last layer of a take whose other layers are in a gap.
-- grain: one row per such publication, take or callback instance
-- when: staging.beside_gap, staging.callback_gap

-- Events up to `behind_until` must not be behind a gap, nor those from `before_from` up to
-- `before_until` be before one.
WITH extent AS (
    SELECT
        'publication' AS kind, start_event_id, thread_id, start_event_id AS behind_until,
        end_event_id AS before_from, end_event_id AS before_until, end_event_id AS inside_until
    FROM staging.publication_call
    UNION ALL
    SELECT
        'take', c.start_event_id, c.thread_id, c.start_event_id, c.end_event_id, c.end_event_id,
        coalesce(n.callback_start_event_id, c.end_event_id)
    FROM staging.take_chain AS c
    JOIN staging.take_number AS n ON c.start_event_id = n.start_event_id
    UNION ALL
    SELECT
        'take', r.start_event_id, r.thread_id, r.start_event_id, r.start_event_id, r.start_event_id,
        r.start_event_id
    FROM staging.callback_run AS r
    JOIN staging.take_number AS n ON r.start_event_id = n.start_event_id
    UNION ALL
    SELECT
        'callback', start_event_id, thread_id, effective_end_event_id, start_event_id,
        CASE WHEN end_event_id IS NULL THEN effective_end_event_id - 1 END, effective_end_event_id
    FROM staging.callback_run
),
elsewhere AS (
    SELECT thread_id, event_id FROM staging.callback_gap WHERE NOT is_between
),
exposed AS MATERIALIZED (
    SELECT *
    FROM extent
    WHERE thread_id IN (SELECT thread_id FROM staging.beside_gap)
        OR thread_id IN (SELECT thread_id FROM elsewhere)
)
SELECT e.kind, e.start_event_id
FROM exposed AS e
ASOF JOIN (SELECT * FROM staging.beside_gap WHERE is_behind) AS g
    ON e.thread_id = g.thread_id AND e.behind_until >= g.event_id
WHERE g.event_id >= e.start_event_id
UNION
SELECT e.kind, e.start_event_id
FROM exposed AS e
ASOF JOIN (SELECT * FROM staging.beside_gap WHERE NOT is_behind) AS g
    ON e.thread_id = g.thread_id AND e.before_until >= g.event_id
WHERE g.event_id >= e.before_from
UNION
SELECT e.kind, e.start_event_id
FROM exposed AS e
ASOF JOIN elsewhere AS g ON e.thread_id = g.thread_id AND e.inside_until >= g.event_id
WHERE g.event_id > e.start_event_id
UNION
SELECT 'take', n.start_event_id
FROM staging.take_number AS n
JOIN staging.predecessor AS p ON n.callback_start_event_id = p.event_id AND p.sequence = 'call'
JOIN staging.beside_gap AS g ON p.previous_event_id = g.event_id AND g.is_behind
JOIN raw.ros2_rclcpp_take AS u ON p.previous_event_id = u.event_id
WHERE n.start_event_id = n.callback_start_event_id
