-- name: staging.gap
-- description: Gaps of the traces: stretches in which events were lost, and pauses, in which
--     nothing was recorded.
-- grain: one row per gap in a recording
-- when: staging.loss, staging.pause
SELECT trace_id, cpu, kind, start_ns, end_ns, event_count FROM staging.loss
UNION ALL
SELECT trace_id, NULL, 'pause', start_ns, end_ns, NULL FROM staging.pause
ORDER BY trace_id, start_ns, end_ns, kind, cpu
