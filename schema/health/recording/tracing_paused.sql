-- title: Tracing was paused
-- description: All streams of a trace are silent at once between packets. What happened meanwhile
--     is missing, and nothing is paired across the pause.
-- cause: The session was stopped and started again (lttng stop, lttng start), or the machine slept.
-- cure: Record without stopping. For this recording: ingest one stretch at a time, or leave the
--     pauses out with --start and --end.
-- grain: one row per trace
-- severity: warning
-- when: store.gap WHERE kind = 'pause'
SELECT
    run_id, trace_id,
    count(*) AS count,
    printf(
        '%s, %.3f s in all, the longest %.3f s',
        derive.counted(count(*), 'pause'), sum(end_ns - start_ns) / 1e9,
        max(end_ns - start_ns) / 1e9
    ) AS detail
FROM main.gap
WHERE kind = 'pause'
GROUP BY run_id, trace_id
