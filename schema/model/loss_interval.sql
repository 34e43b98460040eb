-- name: staging.loss_interval
-- description: Gaps of the traces. Lost events lie between the last event of a packet whose
--     discard counter rose and that packet's end, on its CPU only. Lost packets lie between the
--     packets around them. Tracing was paused where all streams of a trace are silent at once
--     between packets: continuous packets begin where the previous one ended. What comes after the
--     last packet with events is no pause: stopping flushes an empty one into every stream. Kernel
--     traces are left out: what they lost is missing from no process.
-- grain: one row per gap in a trace
-- needs: staging.packet, staging.source
WITH packet AS (
    SELECT p.*
    FROM staging.packet AS p
    JOIN staging.source AS s ON p.trace_index = s.trace_index
    WHERE s.domain IS DISTINCT FROM 'kernel'
),
lost_event AS (
    SELECT
        trace_index + 1 AS trace_id,
        cpu_id AS cpu,
        'loss' AS kind,
        coalesce(last_event_ns, begin_ns) AS start_ns,
        coalesce(end_ns, last_event_ns, begin_ns) AS end_ns,
        discarded_event_count AS event_count
    FROM packet
    WHERE discarded_event_count IS DISTINCT FROM 0
),
stream_packet AS (
    SELECT
        trace_index,
        cpu_id,
        begin_ns,
        lost_packet_count,
        lag(coalesce(end_ns, last_event_ns, begin_ns)) OVER (
            PARTITION BY trace_index, stream_index ORDER BY position
        ) AS previous_end_ns
    FROM packet
),
lost_packet AS (
    SELECT
        trace_index + 1 AS trace_id,
        cpu_id AS cpu,
        'packets' AS kind,
        coalesce(previous_end_ns, begin_ns) AS start_ns,
        begin_ns AS end_ns,
        NULL::BIGINT AS event_count
    FROM stream_packet
    WHERE lost_packet_count IS DISTINCT FROM 0
),
covered AS (
    SELECT
        trace_index,
        begin_ns,
        max(CASE WHEN event_count > 0 THEN begin_ns END) OVER (PARTITION BY trace_index)
            AS last_begin_ns,
        max(greatest(coalesce(end_ns, begin_ns), coalesce(last_event_ns, begin_ns))) OVER (
            PARTITION BY trace_index ORDER BY begin_ns, stream_index, position
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ) AS covered_until_ns
    FROM packet
),
pause AS (
    SELECT
        trace_index + 1 AS trace_id,
        NULL::INTEGER AS cpu,
        'pause' AS kind,
        covered_until_ns AS start_ns,
        begin_ns AS end_ns,
        NULL::BIGINT AS event_count
    FROM covered
    WHERE begin_ns > covered_until_ns AND begin_ns <= last_begin_ns
)
SELECT trace_id, cpu, kind, start_ns, end_ns, event_count FROM lost_event
UNION ALL
SELECT trace_id, cpu, kind, start_ns, end_ns, event_count FROM lost_packet
UNION ALL
SELECT trace_id, cpu, kind, start_ns, end_ns, event_count FROM pause
ORDER BY trace_id, start_ns, end_ns, kind, cpu
