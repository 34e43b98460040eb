-- name: diagnostic.discarded_events
-- title: Events that the tracer discarded
-- description: Events were lost because the buffers were full.
-- finding: discarded_events
-- grain: one row per trace
-- severity: data_loss
-- phase: reading
SELECT
    trace_id,
    least(coalesce(sum(event_count), count(*)), 9007199254740992) AS count,
    printf(
        'events that the tracer discarded in %d place%s, %.3f s in all: use more or larger '
        || 'sub-buffers',
        count(*), CASE WHEN count(*) = 1 THEN '' ELSE 's' END, sum(end_ns - start_ns) / 1e9
    ) AS detail
FROM staging.gap
-- Events that are missing from a packet that was cut off are reported as damaged_trace.
WHERE kind = 'loss'
    AND (event_count IS NOT NULL OR trace_id NOT IN (SELECT trace_index + 1 FROM staging.damage))
GROUP BY trace_id
