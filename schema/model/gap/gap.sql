-- description: Gaps of the traces: what was lost of them, and when nothing was recorded. A packet
--     counts the events that were lost since the packet before it ended, on its CPU. They were lost
--     behind its own last event, until it ended. Where the next packet is opened late, since there
--     was no room, they may as well have been lost between the end of the one before and its begin;
--     a packet that takes no time leaves only that. Lost packets lie between the packets around
--     them, in whichever chunks of the recording these are. Before the first packet of a stream,
--     its number tells. Behind the last one they are missing where other streams have later events:
--     stopping flushes a packet into every stream. The last three columns are for ASOF joins. A
--     stretch of time touches a gap of its recording in two cases: the last gap that starts before
--     its end starts at or after its begin, or this or an earlier gap ends after its begin. CPU -1
--     means all CPUs.
-- grain: one row per gap in a recording
-- when: staging.pause, staging.packet WHERE domain IS DISTINCT FROM 'kernel'
--     AND (discarded_event_count IS DISTINCT FROM 0 OR lost_packet_count IS DISTINCT FROM 0
--     OR stream_end_ns < recording_last_event_ns)

-- What kernel traces lost is missing from no process.
WITH packet AS (
    SELECT *, min(begin_ns) OVER (PARTITION BY recording_index) AS recording_begin_ns
    FROM staging.packet
    WHERE domain IS DISTINCT FROM 'kernel'
),
lossy_packet AS (
    SELECT
        *,
        lost_packet_count IS NOT DISTINCT FROM 0 AND coalesce(begin_ns > previous_end_ns, false)
            AS is_opened_late,
        known_end_ns <= begin_ns AS is_instant
    FROM packet
    WHERE discarded_event_count IS DISTINCT FROM 0
),
lost_event AS (
    SELECT
        trace_id, cpu_id AS cpu,
        'loss' AS kind,
        coalesce(last_event_ns, begin_ns) AS start_ns,
        known_end_ns AS end_ns, discarded_event_count AS event_count
    FROM lossy_packet
    WHERE NOT (is_instant AND is_opened_late)
    UNION ALL
    -- The counter does not say how many of them were lost before the packet was opened, unless no
    -- time was left for others.
    SELECT
        trace_id, cpu_id, 'loss', previous_end_ns, begin_ns,
        CASE WHEN is_instant THEN discarded_event_count END
    FROM lossy_packet
    WHERE is_opened_late
),
lost_packet AS (
    SELECT
        trace_id, cpu_id AS cpu,
        'packets' AS kind,
        least(coalesce(previous_end_ns, recording_begin_ns), begin_ns) AS start_ns,
        begin_ns AS end_ns,
        NULL::BIGINT AS event_count
    FROM packet
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
    JOIN staging.placed_source AS t ON s.recording_index = t.trace_index
    WHERE s.end_ns < e.last_event_ns AND starts_with(t.tracer, 'lttng')
),
every_gap AS (
    FROM lost_event
    UNION ALL
    FROM lost_packet
    UNION ALL
    FROM missing_end
    UNION ALL
    SELECT trace_id, NULL, 'pause', start_ns, end_ns, NULL FROM staging.pause
)
SELECT
    g.trace_id, g.cpu, g.kind, g.start_ns, g.end_ns, g.event_count, s.recording_index,
    coalesce(g.cpu, -1) AS cpu_id,
    max(g.end_ns) OVER (PARTITION BY s.recording_index, g.cpu ORDER BY g.start_ns)
        AS covered_until_ns,
    max(g.end_ns) OVER (PARTITION BY s.recording_index ORDER BY g.start_ns)
        AS any_covered_until_ns
FROM every_gap AS g
JOIN staging.placed_source AS s ON g.trace_id - 1 = s.trace_index
ORDER BY g.trace_id, g.start_ns, g.end_ns, g.kind, g.cpu
