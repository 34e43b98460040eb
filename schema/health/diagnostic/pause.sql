-- name: diagnostic.pause
-- title: Pauses of tracing
-- description: All streams of a trace are silent at once between packets.
-- finding: tracing_paused
-- grain: one row per trace
-- severity: warning
-- phase: reading
SELECT
    trace_id,
    count(*) AS count,
    printf(
        'times at which tracing was paused, %.3f s in all', sum(end_ns - start_ns) / 1e9
    ) AS detail
FROM staging.gap
WHERE kind = 'pause'
GROUP BY trace_id
