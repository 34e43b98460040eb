-- description: Counts of the events that are left out of a trace because another one has them.
-- grain: one row per such pair of traces
SELECT
    trace_index, used_index,
    count(*) AS event_count,
    count(DISTINCT thread) AS thread_count,
    max(ts_ns) - min(ts_ns) AS length_ns
FROM duplicate_event
GROUP BY trace_index, used_index
