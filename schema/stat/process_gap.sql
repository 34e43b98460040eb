-- name: derive.process_gap
-- description: Gaps of the traces that each process was recorded in, for ASOF joins as with
--     derive.trace_gap.
-- grain: one row per process and gap in one of its traces
-- needs: store.publication, store.take, store.callback_instance, derive.trace_gap,
--     store.loss_interval
WITH process_trace AS (
    SELECT DISTINCT run_id, process_id, trace_id
    FROM (
        SELECT run_id, process_id, trace_id FROM store.publication
        UNION ALL
        SELECT run_id, process_id, trace_id FROM store.take
        UNION ALL
        SELECT run_id, process_id, trace_id FROM store.callback_instance
    )
    WHERE trace_id IN (SELECT trace_id FROM store.loss_interval)
)
SELECT
    p.run_id,
    p.process_id,
    g.start_ns,
    max(g.covered_until_ns) OVER (
        PARTITION BY p.run_id, p.process_id ORDER BY g.start_ns, g.covered_until_ns
        ROWS UNBOUNDED PRECEDING
    ) AS covered_until_ns
FROM process_trace AS p
JOIN derive.trace_gap AS g ON p.run_id = g.run_id AND p.trace_id = g.trace_id
