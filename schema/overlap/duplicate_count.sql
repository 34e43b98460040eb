-- description: Counts of the events that are left out of a trace because another one has them.
-- grain: one row per such pair of traces
-- column: trace_index INTEGER  Trace that they are left out of
-- column: used_index INTEGER  Trace that has them as well
-- column: event_count BIGINT  How many
-- column: thread_count BIGINT  Threads that they happened on
-- column: length_ns BIGINT [ns]  From the first to the last
-- when: temp.overlap_window
SELECT
    trace_index, used_index,
    count(*) AS event_count,
    count(DISTINCT thread) AS thread_count,
    max(ts_ns) - min(ts_ns) AS length_ns
FROM duplicate_event
GROUP BY trace_index, used_index
