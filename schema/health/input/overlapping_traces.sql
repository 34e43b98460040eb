-- title: Two traces hold the same events
-- description: Threads were recorded twice at the same time, by two sessions. Where both hold the
--     same events, they were read from one session only: the one with more events of the thread.
-- cause: Two tracing sessions with the same events ran at once, and both were given to one ingest.
-- cure: None needed. To read one of them alone: msgflow ingest --replace TRACE.
-- grain: one row per pair of traces
-- severity: warning
-- when: staging.left_out
SELECT
    o.trace_index + 1 AS trace_id,
    o.event_count AS count,
    printf(
        'events of %d threads, over %.3f s, left out because the trace %s has them too',
        o.thread_count, o.length_ns / 1e9, s.path
    ) AS detail
FROM staging.left_out AS o
JOIN staging.source AS s ON o.used_index = s.trace_index
