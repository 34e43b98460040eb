-- description: Packets as read. One that opens without a begin is taken to begin with its trace.
--     `covered_until_ns`: when all earlier packets of the recording were over. `last_begin_ns`:
--     when its last packet with events begins.
-- grain: one row per packet of a trace
-- when: raw.packet
WITH begun AS (
    SELECT
        p.* REPLACE (coalesce(p.begin_ns, s.begin_ns, p.last_event_ns) AS begin_ns),
        s.recording_index, s.domain
    FROM raw.packet AS p
    JOIN staging.placed_source AS s ON p.trace_index = s.trace_index
),
ended AS (
    SELECT
        *,
        coalesce(end_ns, last_event_ns, begin_ns) AS known_end_ns,
        -- One that is filled to the last byte ends with its last event, one that opens a chunk when
        -- it begins.
        coalesce(end_ns > greatest(last_event_ns, begin_ns), false) AS is_ended_early
    FROM begun
)
SELECT
    *,
    trace_index + 1 AS trace_id,
    lag(known_end_ns) OVER (
        PARTITION BY recording_index, stream_class_id, stream_instance_id
        ORDER BY begin_ns, trace_index, position
    ) AS previous_end_ns,
    max(known_end_ns) OVER (PARTITION BY recording_index, stream_class_id, stream_instance_id)
        AS stream_end_ns,
    max(last_event_ns) OVER (PARTITION BY recording_index) AS recording_last_event_ns,
    max(greatest(coalesce(end_ns, begin_ns), coalesce(last_event_ns, begin_ns))) OVER (
        PARTITION BY recording_index ORDER BY begin_ns, trace_index, stream_index, position
        ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
    ) AS covered_until_ns,
    max(CASE WHEN event_count > 0 THEN begin_ns END) OVER (PARTITION BY recording_index)
        AS last_begin_ns
FROM ended
