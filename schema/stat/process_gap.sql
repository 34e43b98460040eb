-- name: derive.process_gap
-- description: Gaps of the traces that each process was recorded in, for ASOF joins as with
--     derive.recording_gap.
-- grain: one row per process and gap in one of its traces
-- needs: store.publication, store.take, store.callback_instance, derive.recording_gap,
--     derive.exposed_trace
WITH process_recording AS (
    SELECT DISTINCT i.run_id, i.process_id, x.recording_id
    FROM (
        SELECT run_id, process_id, trace_id FROM store.publication
        UNION ALL
        SELECT run_id, process_id, trace_id FROM store.take
        UNION ALL
        SELECT run_id, process_id, trace_id FROM store.callback_instance
    ) AS i
    JOIN derive.exposed_trace AS x ON i.trace_id = x.trace_id
)
SELECT
    p.run_id,
    p.process_id,
    g.start_ns,
    max(g.covered_until_ns) OVER (
        PARTITION BY p.run_id, p.process_id ORDER BY g.start_ns, g.covered_until_ns
        ROWS UNBOUNDED PRECEDING
    ) AS covered_until_ns
FROM process_recording AS p
JOIN derive.recording_gap AS g ON p.recording_id = g.recording_id
