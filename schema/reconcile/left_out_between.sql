-- name: reconcile.left_out_between
-- description: How much was left out of one trace since another one holds it as well.
-- grain: one row per such pair of traces
SELECT
    trace_index,
    used_index,
    count(*) AS event_count,
    count(DISTINCT thread) AS thread_count,
    max(ts_ns) - min(ts_ns) AS length_ns
FROM left_out
GROUP BY trace_index, used_index
