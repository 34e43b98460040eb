-- name: staging.beside_gap
-- description: Events of calls with a gap right before or right after them on their thread; the
--     last event of a thread, where a gap of its CPU comes later; its first one, where a gap of its
--     CPU came before, once its process was there. What such an event belongs to may have lost a
--     part.
-- grain: one row per such event and side
-- when: staging.gap
WITH last_gap AS (
    SELECT recording_index, cpu_id, max(covered_until_ns) AS end_ns
    FROM staging.gap
    GROUP BY recording_index, cpu_id
)
SELECT event_id, thread_id, true AS is_behind
FROM staging.callback_gap
WHERE is_between
UNION
SELECT p.previous_event_id, g.thread_id, false
FROM staging.predecessor AS p
JOIN staging.callback_gap AS g ON p.event_id = g.event_id
WHERE g.is_between AND p.sequence = 'call' AND p.previous_event_id IS NOT NULL
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
