-- description: Publications, takes and callback instances that a gap may have cut or mixed. A gap
--     lies right before them or inside. A gap right behind counts as well, but not behind an
--     instance that was seen to end. A gap of other CPUs counts inside, as the thread may have
--     visited them: two may look like one. A callback that was handed a message without a take
--     counts right behind the last layer of a take whose other layers are in a gap.
-- grain: one row per such publication, take or callback instance
-- when: staging.gap
WITH last_gap AS (
    SELECT
        recording_index, cpu_id,
        max(covered_until_ns) AS end_ns
    FROM staging.gap
    GROUP BY recording_index, cpu_id
),
-- Events of calls right behind a gap on their thread, or right before one. The last event of a
-- thread is before a gap, where its CPU has one later. The first is behind one, where its CPU had
-- one before, once its process was there.
beside_gap AS MATERIALIZED (
    SELECT
        event_id, thread_id,
        true AS is_behind
    FROM staging.near_gap
    WHERE sequence = 'call' AND is_between
    UNION
    SELECT p.previous_event_id, g.thread_id, false
    FROM staging.predecessor AS p
    JOIN staging.near_gap AS g ON p.event_id = g.event_id AND p.sequence = g.sequence
    WHERE g.is_between AND g.sequence = 'call' AND p.previous_event_id IS NOT NULL
    UNION
    SELECT e.event_id, t.thread_id, false
    FROM staging.event AS e
    JOIN staging.thread AS t ON e.event_id = t.last_event_id
    JOIN staging.placed_source AS x ON e.trace_index = x.trace_index
    JOIN last_gap AS g
        ON x.recording_index = g.recording_index
        AND g.cpu_id IN (e.cpu_id, -1)
        AND e.ts_ns <= g.end_ns
    UNION
    SELECT e.event_id, t.thread_id, true
    FROM staging.event AS e
    JOIN staging.thread AS t ON e.event_id = t.first_event_id
    JOIN staging.process AS p ON t.process_id = p.process_id
    JOIN staging.placed_source AS x ON e.trace_index = x.trace_index
    JOIN staging.gap AS g
        ON x.recording_index = g.recording_index
        AND g.cpu_id IN (e.cpu_id, -1)
        AND g.start_ns < e.ts_ns
        AND g.covered_until_ns >= p.first_seen_ns
),
-- Events up to `behind_until` must not be behind a gap, nor those from `before_from` up to
-- `before_until` be before one.
extent AS (
    SELECT
        'publication' AS kind,
        start_event_id, thread_id,
        start_event_id AS behind_until,
        end_event_id AS before_from,
        end_event_id AS before_until,
        end_event_id AS inside_until
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
        CASE WHEN end_event_id IS NULL THEN effective_end_event_id - 1 END,
        effective_end_event_id
    FROM staging.callback_run
),
elsewhere AS (
    SELECT thread_id, event_id FROM staging.near_gap WHERE sequence = 'call' AND NOT is_between
),
exposed AS MATERIALIZED (
    SELECT *
    FROM extent
    WHERE thread_id IN (SELECT thread_id FROM beside_gap)
        OR thread_id IN (SELECT thread_id FROM elsewhere)
)
SELECT e.kind, e.start_event_id
FROM exposed AS e
ASOF JOIN (SELECT * FROM beside_gap WHERE is_behind) AS g
    ON e.thread_id = g.thread_id AND e.behind_until >= g.event_id
WHERE g.event_id >= e.start_event_id
UNION
SELECT e.kind, e.start_event_id
FROM exposed AS e
ASOF JOIN (SELECT * FROM beside_gap WHERE NOT is_behind) AS g
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
JOIN beside_gap AS g ON p.previous_event_id = g.event_id AND g.is_behind
JOIN raw.ros2_rclcpp_take AS u ON p.previous_event_id = u.event_id
WHERE n.start_event_id = n.callback_start_event_id
