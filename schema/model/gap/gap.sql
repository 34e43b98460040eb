-- name: staging.gap
-- description: Gaps of the traces. A packet counts what was lost since the one before ended: behind
--     its own last event until it ended, and, since the next packet is opened only when there is
--     room, between the end of the one before and its begin (only there, if the packet takes no
--     time); on its CPU only. Lost packets lie
--     between the packets around them, in whichever chunks of the recording these are; before the
--     first packet of a stream, as its number tells; and behind the last, where others have later
--     events: stopping flushes a packet into every stream. Where all streams of a recording are
--     silent at once between packets, something ended these: stopping, a rotation, a snapshot, or
--     a timer of the tracer; the next ones begin with their first events. It was a stop, and the
--     silence a pause, where it can be nothing else: packets of one trace ended before they were
--     full, not at equal distances, and no snapshot is recorded, whose buffers keep what earlier
--     ones did to them. Else it was one if at least a millisecond passed, and the recording is
--     nowhere else silent for as long, within four times that or a second before and after. Nor is
--     it one where the numbers of all streams skip packets meanwhile: those are lost. What comes
--     after the last packet with events is no pause. Kernel traces are left out: what they lost is
--     missing from no process.
-- grain: one row per gap in a recording
-- needs: staging.packet, staging.recording, staging.source, staging.event,
--     staging.pause_limit
WITH packet AS (
    SELECT
        p.*,
        r.recording_index,
        coalesce(p.end_ns, p.last_event_ns, p.begin_ns) AS known_end_ns,
        -- One that is filled to the last byte ends with its last event, one that opens a chunk when
        -- it begins.
        coalesce(p.end_ns > greatest(p.last_event_ns, p.begin_ns), false) AS is_ended_early
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
        max(greatest(coalesce(end_ns, begin_ns), coalesce(last_event_ns, begin_ns))) OVER earlier
            AS covered_until_ns,
        max(CASE WHEN is_ended_early THEN end_ns END) OVER earlier AS ended_early_ns,
        lag(trace_id) OVER earlier_of_recording AS previous_trace_id
    FROM packet
    WINDOW
        earlier_of_recording AS (
            PARTITION BY recording_index ORDER BY begin_ns, trace_index, stream_index, position
        ),
        earlier AS (
            PARTITION BY recording_index ORDER BY begin_ns, trace_index, stream_index, position
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        )
),
-- When packets were ended before they were full.
ending AS (
    SELECT recording_index, end_ns
    FROM packet
    WHERE is_ended_early
    GROUP BY recording_index, end_ns
),
-- One for all streams, which are ended one after the other.
flush AS (
    SELECT
        recording_index, end_ns,
        row_number() OVER (PARTITION BY recording_index ORDER BY end_ns) AS number
    FROM (
        SELECT
            *, lead(end_ns) OVER (PARTITION BY recording_index ORDER BY end_ns) - end_ns AS until_ns
        FROM ending
    )
    WHERE coalesce(until_ns >= staging.pause_limit().least_ns, true)
),
-- A timer of the tracer ends packets at equal distances: any two others are as far apart.
regular AS (
    SELECT DISTINCT p.recording_index, p.end_ns
    FROM (
        SELECT
            a.recording_index, a.end_ns,
            least(staging.pause_limit().timer_ns, abs(b.end_ns - a.end_ns) // 4) AS slack_ns,
            unnest([2 * b.end_ns - a.end_ns, 2 * a.end_ns - b.end_ns]) AS expected_ns
        FROM flush AS a
        JOIN flush AS b
            ON a.recording_index = b.recording_index
            AND b.number <> a.number
            AND b.number BETWEEN a.number - staging.pause_limit().reach
                AND a.number + staging.pause_limit().reach
    ) AS p
    ASOF JOIN flush AS c
        ON p.recording_index = c.recording_index AND p.expected_ns + p.slack_ns >= c.end_ns
    WHERE c.end_ns >= p.expected_ns - p.slack_ns
),
-- Buffers of which only what was in them at some time is recorded.
snapshot AS (
    SELECT recording_index
    FROM stream_packet
    GROUP BY recording_index
    HAVING bool_or(previous_end_ns IS NULL AND lost_packet_count IS DISTINCT FROM 0)
    UNION
    SELECT r.recording_index
    FROM staging.source AS s
    JOIN staging.recording AS r ON s.trace_index = r.trace_index
    WHERE regexp_matches(s.path, '(^|/)snapshot-\d+-[^/]*(/|$)')
),
silence AS (
    SELECT
        c.trace_id, c.recording_index, c.covered_until_ns AS start_ns, c.begin_ns AS end_ns,
        greatest(
            staging.pause_limit().usual_factor * (c.begin_ns - c.covered_until_ns),
            staging.pause_limit().usual_ns
        ) AS around_ns,
        coalesce(c.ended_early_ns = c.covered_until_ns, false)
        AND coalesce(c.previous_trace_id = c.trace_id, false)
        AND s.recording_index IS NULL
        AND r.recording_index IS NULL AS is_certain
    FROM covered AS c
    LEFT JOIN snapshot AS s ON c.recording_index = s.recording_index
    LEFT JOIN regular AS r
        ON c.recording_index = r.recording_index AND c.covered_until_ns = r.end_ns
    WHERE c.begin_ns - c.covered_until_ns >= staging.pause_limit().least_ns
        AND c.begin_ns <= c.last_begin_ns
),
-- Silences within packets as well, from millisecond to millisecond.
heard AS (
    SELECT r.recording_index, min(e.ts_ns) AS first_ns, max(e.ts_ns) AS last_ns
    FROM staging.event AS e
    JOIN staging.recording AS r ON e.trace_index = r.trace_index
    WHERE r.recording_index IN (SELECT recording_index FROM silence WHERE NOT is_certain)
    GROUP BY r.recording_index, e.ts_ns // staging.pause_limit().least_ns
),
quiet AS (
    SELECT
        recording_index,
        lag(last_ns) OVER (PARTITION BY recording_index ORDER BY first_ns) AS start_ns,
        first_ns AS end_ns
    FROM heard
    QUALIFY end_ns - start_ns >= staging.pause_limit().least_ns
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
        WHERE NOT is_certain
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
