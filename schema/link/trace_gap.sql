-- name: derive.trace_gap
-- description: Gaps of the traces for ASOF joins: a window touches a gap of its trace exactly where
--     the last gap that starts before its end has `covered_until_ns` at or after its begin.
-- grain: one row per gap in a trace
-- needs: store.loss_interval
SELECT
    run_id,
    trace_id,
    start_ns,
    max(end_ns) OVER (
        PARTITION BY run_id, trace_id ORDER BY start_ns, end_ns ROWS UNBOUNDED PRECEDING
    ) AS covered_until_ns
FROM store.loss_interval
