-- name: staging.beside_gap
-- description: Events of calls with a gap right before or right after them on their thread; the
--     last event of a thread, where a gap of its CPU comes later. What such an event belongs to may
--     have lost a part.
-- grain: one row per such event and side
-- needs: staging.callback_gap, staging.predecessor, staging.event, staging.thread,
--     staging.loss_interval
WITH last_gap AS (
    SELECT trace_id - 1 AS trace_index, cpu, max(end_ns) AS end_ns
    FROM staging.loss_interval
    GROUP BY trace_id, cpu
)
SELECT event_id, thread_id, true AS is_behind
FROM staging.callback_gap
UNION ALL
SELECT p.previous_event_id, g.thread_id, false
FROM staging.predecessor AS p
JOIN staging.callback_gap AS g ON p.event_id = g.event_id
WHERE p.sequence = 'call' AND p.previous_event_id IS NOT NULL
UNION ALL
SELECT DISTINCT e.event_id, t.thread_id, false
FROM staging.event AS e
JOIN staging.thread AS t ON e.event_id = t.last_event_id
JOIN last_gap AS g
    ON e.trace_index = g.trace_index
    AND coalesce(e.cpu_id = g.cpu, true)
    AND e.ts_ns <= g.end_ns
