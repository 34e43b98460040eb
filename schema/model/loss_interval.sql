-- name: staging.loss_interval
-- description: Gaps of the traces. A packet counts what was lost since the one before ended: behind
--     its own last event until it ended, and, since the next packet is opened only when there is
--     room, between the end of the one before and its begin (only there, if the packet takes no
--     time); on its CPU only. Lost packets lie
--     between the packets around them, in whichever chunks of the recording these are; before the
--     first packet of a stream, as its number tells; and behind the last, where others have later
--     events: stopping flushes a packet into every stream. Where all streams of a recording are
--     silent at once between packets, tracing was paused, or packets were ended for another reason
--     (a rotation, a snapshot) and the next ones begin with their first events. It was a pause if
--     at least a millisecond passed, and the recording is nowhere else silent for as long, within
--     four times that or a second before and after. Nor is it one where the numbers of all streams
--     skip packets meanwhile: those are lost. What comes after the last packet with events is no
--     pause. Kernel traces are left out: what they lost is missing from no process.
-- grain: one row per gap in a recording
-- needs: staging.packet, staging.recording, staging.source, staging.event
WITH packet AS (
    SELECT
        p.*, r.recording_index, coalesce(p.end_ns, p.last_event_ns, p.begin_ns) AS known_end_ns
    FROM staging.packet AS p
    JOIN staging.recording AS r ON p.trace_index = r.trace_index
    JOIN staging.source AS s ON p.trace_index = s.trace_index
    WHERE s.domain IS DISTINCT FROM 'kernel'
),
stream_packet AS (
    SELECT
        trace_id,
        recording_index,
        cpu_id,
        begin_ns,
        known_end_ns,
        last_event_ns,
        discarded_event_count,
        lost_packet_count,
        lag(known_end_ns) OVER (
            PARTITION BY recording_index, stream_class_id, stream_instance_id
            ORDER BY begin_ns, trace_index, position
        ) AS previous_end_ns,
        min(begin_ns) OVER (PARTITION BY recording_index) AS recording_begin_ns
    FROM packet
),
lossy_packet AS (
    SELECT
        *,
        lost_packet_count IS NOT DISTINCT FROM 0 AND coalesce(begin_ns > previous_end_ns, false)
            AS is_opened_late,
        known_end_ns <= begin_ns AS is_instant
    FROM stream_packet
    WHERE discarded_event_count IS DISTINCT FROM 0
),
lost_event AS (
    SELECT
        trace_id,
        cpu_id AS cpu,
        'loss' AS kind,
        coalesce(last_event_ns, begin_ns) AS start_ns,
        known_end_ns AS end_ns,
        discarded_event_count AS event_count
    FROM lossy_packet
    WHERE NOT (is_instant AND is_opened_late)
    UNION ALL
    -- How many of them were lost before the packet was opened, nobody counted, unless no time was
    -- left for others.
    SELECT
        trace_id, cpu_id, 'loss', previous_end_ns, begin_ns,
        CASE WHEN is_instant THEN discarded_event_count END
    FROM lossy_packet
    WHERE is_opened_late
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
        recording_index,
        begin_ns,
        max(CASE WHEN event_count > 0 THEN begin_ns END) OVER (PARTITION BY recording_index)
            AS last_begin_ns,
        max(greatest(coalesce(end_ns, begin_ns), coalesce(last_event_ns, begin_ns))) OVER (
            PARTITION BY recording_index ORDER BY begin_ns, trace_index, stream_index, position
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ) AS covered_until_ns
    FROM packet
),
silence AS (
    SELECT
        trace_id, recording_index, covered_until_ns AS start_ns, begin_ns AS end_ns,
        greatest(4 * (begin_ns - covered_until_ns), 1_000_000_000) AS around_ns
    FROM covered
    WHERE begin_ns - covered_until_ns >= 1_000_000 AND begin_ns <= last_begin_ns
),
-- Silences within packets as well, from millisecond to millisecond.
heard AS (
    SELECT r.recording_index, min(e.ts_ns) AS first_ns, max(e.ts_ns) AS last_ns
    FROM staging.event AS e
    JOIN staging.recording AS r ON e.trace_index = r.trace_index
    WHERE r.recording_index IN (SELECT recording_index FROM silence)
    GROUP BY r.recording_index, e.ts_ns // 1_000_000
),
quiet AS (
    SELECT
        recording_index,
        lag(last_ns) OVER (PARTITION BY recording_index ORDER BY first_ns) AS start_ns,
        first_ns AS end_ns
    FROM heard
    QUALIFY end_ns - start_ns >= 1_000_000
),
usual AS (
    SELECT
        q.recording_index, q.start_ns, q.end_ns,
        unnest(range(q.start_ns // 1_000_000_000, q.end_ns // 1_000_000_000 + 1)) AS second
    FROM quiet AS q
    ANTI JOIN silence AS s
        ON q.recording_index = s.recording_index
        AND q.start_ns < s.end_ns
        AND q.end_ns > s.start_ns
),
explained AS (
    SELECT s.recording_index, s.start_ns
    FROM (
        SELECT
            *,
            unnest(
                range(
                    (start_ns - around_ns) // 1_000_000_000,
                    (end_ns + around_ns) // 1_000_000_000 + 1
                )
            ) AS second
        FROM silence
    ) AS s
    JOIN usual AS u
        ON s.recording_index = u.recording_index
        AND s.second = u.second
        AND u.end_ns - u.start_ns >= s.end_ns - s.start_ns
        AND u.start_ns < s.end_ns + s.around_ns
        AND u.end_ns > s.start_ns - s.around_ns
    UNION
    SELECT s.recording_index, s.start_ns
    FROM silence AS s
    JOIN stream_packet AS p
        ON s.recording_index = p.recording_index
        AND s.start_ns >= p.previous_end_ns
        AND s.end_ns <= p.begin_ns
    GROUP BY s.recording_index, s.start_ns
    HAVING bool_and(coalesce(p.lost_packet_count > 0, false))
),
pause AS (
    SELECT
        s.trace_id,
        NULL::INTEGER AS cpu,
        'pause' AS kind,
        s.start_ns,
        s.end_ns,
        NULL::BIGINT AS event_count
    FROM silence AS s
    ANTI JOIN explained AS e
        ON s.recording_index = e.recording_index AND s.start_ns = e.start_ns
)
SELECT trace_id, cpu, kind, start_ns, end_ns, event_count FROM lost_event
UNION ALL
SELECT trace_id, cpu, kind, start_ns, end_ns, event_count FROM lost_packet
UNION ALL
SELECT trace_id, cpu, kind, start_ns, end_ns, event_count FROM missing_end
UNION ALL
SELECT trace_id, cpu, kind, start_ns, end_ns, event_count FROM pause
ORDER BY trace_id, start_ns, end_ns, kind, cpu
