-- name: staging.silence
-- description: Where all streams of a recording are silent at once between packets, for a
--     millisecond or longer. Something ended these: stopping, a rotation, a snapshot, or a timer of
--     the tracer; the next ones begin with their first events. What comes after the last packet
--     with events is left out, and what comes right behind the packets that open a later chunk:
--     these were written while the session recorded, and stopping would have written further ones.
-- grain: one row per silence of a recording
-- when: staging.stream_packet
WITH covered AS (
    SELECT
        trace_id,
        recording_index,
        begin_ns,
        max(CASE WHEN event_count > 0 THEN begin_ns END) OVER (PARTITION BY recording_index)
            AS last_begin_ns,
        max(greatest(coalesce(end_ns, begin_ns), coalesce(last_event_ns, begin_ns))) OVER earlier
            AS covered_until_ns,
        max(CASE WHEN is_ended_early THEN end_ns END) OVER earlier AS ended_early_ns,
        -- LTTng opens a chunk with an empty packet of every stream that has no event in it yet.
        max(
            CASE
                WHEN position = 0 AND event_count = 0 AND end_ns = begin_ns
                    AND previous_end_ns IS NOT NULL
                    THEN end_ns
            END
        ) OVER earlier AS opened_ns,
        lag(trace_id) OVER earlier_of_recording AS previous_trace_id
    FROM staging.stream_packet
    WINDOW
        earlier_of_recording AS (
            PARTITION BY recording_index ORDER BY begin_ns, trace_index, stream_index, position
        ),
        earlier AS (
            PARTITION BY recording_index ORDER BY begin_ns, trace_index, stream_index, position
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        )
)
SELECT
    trace_id,
    recording_index,
    covered_until_ns AS start_ns,
    begin_ns AS end_ns,
    -- Packets of one trace ended before they were full.
    coalesce(ended_early_ns = covered_until_ns, false)
    AND coalesce(previous_trace_id = trace_id, false) AS is_flushed
FROM covered
WHERE begin_ns - covered_until_ns >= staging.pause_limit().least_ns
    AND begin_ns <= last_begin_ns
    AND coalesce(covered_until_ns - opened_ns >= staging.pause_limit().least_ns, true)
