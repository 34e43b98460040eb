-- name: staging.loss_interval
-- description: Gaps of the traces. Lost events lie between the last event of a packet whose
--     discard counter rose and that packet's end, on its CPU only. Lost packets lie between the
--     packets around them, in whichever chunks of the recording these are; before the first packet
--     of a stream, as its number tells; and behind the last, where others have later events:
--     stopping flushes a packet into every stream. Tracing was paused where all streams of a
--     recording are silent at once between packets: continuous packets begin where the previous one
--     ended. What comes after the last packet with events is no pause. Nor is what lies between
--     chunks whose packets are numbered: those after a rotation begin with their first event.
--     Kernel traces are left out: what they lost is missing from no process.
-- grain: one row per gap in a recording
-- needs: staging.packet, staging.recording, staging.source
WITH packet AS (
    SELECT
        p.*, r.recording_index, coalesce(p.end_ns, p.last_event_ns, p.begin_ns) AS known_end_ns
    FROM staging.packet AS p
    JOIN staging.recording AS r ON p.trace_index = r.trace_index
    JOIN staging.source AS s ON p.trace_index = s.trace_index
    WHERE s.domain IS DISTINCT FROM 'kernel'
),
lost_event AS (
    SELECT
        trace_id,
        cpu_id AS cpu,
        'loss' AS kind,
        coalesce(last_event_ns, begin_ns) AS start_ns,
        known_end_ns AS end_ns,
        discarded_event_count AS event_count
    FROM packet
    WHERE discarded_event_count IS DISTINCT FROM 0
),
stream_packet AS (
    SELECT
        trace_id,
        cpu_id,
        begin_ns,
        lost_packet_count,
        lag(known_end_ns) OVER (
            PARTITION BY recording_index, stream_class_id, stream_instance_id
            ORDER BY begin_ns, trace_index, position
        ) AS previous_end_ns,
        min(begin_ns) OVER (PARTITION BY recording_index) AS recording_begin_ns
    FROM packet
),
lost_packet AS (
    SELECT
        trace_id,
        cpu_id AS cpu,
        'packets' AS kind,
        least(coalesce(previous_end_ns, recording_begin_ns), begin_ns) AS start_ns,
        begin_ns AS end_ns,
        NULL::BIGINT AS event_count
    FROM stream_packet
    WHERE lost_packet_count IS DISTINCT FROM 0
        AND (previous_end_ns IS NOT NULL OR begin_ns > recording_begin_ns)
),
stream_end AS (
    SELECT
        recording_index,
        arg_max(trace_id, begin_ns) AS trace_id,
        arg_max(cpu_id, begin_ns) AS cpu,
        max(known_end_ns) AS end_ns
    FROM packet
    GROUP BY recording_index, stream_class_id, stream_instance_id
),
recording_end AS (
    SELECT
        recording_index,
        max(last_event_ns) AS last_event_ns,
        max(greatest(known_end_ns, last_event_ns)) AS end_ns
    FROM packet
    GROUP BY recording_index
    HAVING bool_or(end_ns IS NOT NULL)
),
missing_end AS (
    SELECT
        s.trace_id, s.cpu, 'packets' AS kind, s.end_ns AS start_ns, e.end_ns,
        NULL::BIGINT AS event_count
    FROM stream_end AS s
    JOIN recording_end AS e ON s.recording_index = e.recording_index
    JOIN staging.source AS t ON s.recording_index = t.trace_index
    WHERE s.end_ns < e.last_event_ns AND starts_with(t.tracer, 'lttng')
),
covered AS (
    SELECT
        trace_id,
        begin_ns,
        is_numbered AND row_number() OVER (
            PARTITION BY trace_index ORDER BY begin_ns, stream_index, position
        ) = 1 AS is_begin_of_chunk,
        max(CASE WHEN event_count > 0 THEN begin_ns END) OVER (PARTITION BY recording_index)
            AS last_begin_ns,
        max(greatest(coalesce(end_ns, begin_ns), coalesce(last_event_ns, begin_ns))) OVER (
            PARTITION BY recording_index ORDER BY begin_ns, trace_index, stream_index, position
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ) AS covered_until_ns
    FROM packet
),
pause AS (
    SELECT
        trace_id,
        NULL::INTEGER AS cpu,
        'pause' AS kind,
        covered_until_ns AS start_ns,
        begin_ns AS end_ns,
        NULL::BIGINT AS event_count
    FROM covered
    WHERE begin_ns > covered_until_ns AND begin_ns <= last_begin_ns AND NOT is_begin_of_chunk
)
SELECT trace_id, cpu, kind, start_ns, end_ns, event_count FROM lost_event
UNION ALL
SELECT trace_id, cpu, kind, start_ns, end_ns, event_count FROM lost_packet
UNION ALL
SELECT trace_id, cpu, kind, start_ns, end_ns, event_count FROM missing_end
UNION ALL
SELECT trace_id, cpu, kind, start_ns, end_ns, event_count FROM pause
ORDER BY trace_id, start_ns, end_ns, kind, cpu
