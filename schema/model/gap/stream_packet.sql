-- name: staging.stream_packet
-- description: Packets in the order of their stream, with when the one before ended. Kernel traces
--     are left out: what they lost is missing from no process.
-- grain: one row per packet of a trace of user space
-- when: staging.packet
SELECT
    *,
    lag(known_end_ns) OVER (
        PARTITION BY recording_index, stream_class_id, stream_instance_id
        ORDER BY begin_ns, trace_index, position
    ) AS previous_end_ns,
    min(begin_ns) OVER (PARTITION BY recording_index) AS recording_begin_ns
FROM (
    SELECT
        p.*,
        s.recording_index,
        coalesce(p.end_ns, p.last_event_ns, p.begin_ns) AS known_end_ns,
        -- One that is filled to the last byte ends with its last event, one that opens a chunk when
        -- it begins.
        coalesce(p.end_ns > greatest(p.last_event_ns, p.begin_ns), false) AS is_ended_early
    FROM staging.packet AS p
    JOIN staging.placed_source AS s ON p.trace_index = s.trace_index
    WHERE s.domain IS DISTINCT FROM 'kernel'
)
