-- description: Silences in which nothing was recorded: tracing had been stopped. All streams of a
--     recording are silent at once between packets, for a millisecond or longer. A silence is a
--     pause where it can be nothing else: packets of one trace ended before they were full, not at
--     equal distances, and no snapshot is recorded, whose buffers keep what earlier ones did to
--     them. Else it is one if the recording is nowhere else silent for as long, within four times
--     that or a second before and after. Where the numbers of all streams skip packets meanwhile,
--     these packets were lost, and nothing paused.
-- grain: one row per pause of a recording
-- when: staging.packet WHERE begin_ns - covered_until_ns >= staging.pause_limit().least_ns
--     AND begin_ns <= last_begin_ns

-- Kernel traces pause no process.
WITH packet AS (SELECT * FROM staging.packet WHERE domain IS DISTINCT FROM 'kernel'),
covered AS (
    SELECT
        trace_id, recording_index, begin_ns, covered_until_ns, last_begin_ns,
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
-- Something ended the packets before: stopping, a rotation, a snapshot, or a timer of the tracer.
-- The next ones begin with their first events. What comes after the last packet with events is left
-- out, and what comes right behind the packets that open a later chunk: these were written while
-- the session recorded, and stopping would have written further ones.
silent AS (
    SELECT
        trace_id, recording_index, covered_until_ns AS start_ns, begin_ns AS end_ns,
        -- Packets of one trace ended before they were full.
        coalesce(ended_early_ns = covered_until_ns, false)
        AND coalesce(previous_trace_id = trace_id, false) AS is_flushed
    FROM covered
    WHERE begin_ns - covered_until_ns >= staging.pause_limit().least_ns
        AND begin_ns <= last_begin_ns
        AND coalesce(covered_until_ns - opened_ns >= staging.pause_limit().least_ns, true)
),
-- When packets were ended before they were full.
ending AS (
    SELECT recording_index, end_ns FROM packet WHERE is_ended_early GROUP BY recording_index, end_ns
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
-- Buffers that were recorded once, with what was in them at that moment.
snapshot AS (
    SELECT recording_index
    FROM packet
    GROUP BY recording_index
    HAVING bool_or(previous_end_ns IS NULL AND lost_packet_count IS DISTINCT FROM 0)
    UNION
    SELECT recording_index
    FROM staging.placed_source
    WHERE regexp_matches(path, '(^|/)snapshot-\d+-[^/]*(/|$)')
),
silence AS (
    SELECT
        c.trace_id, c.recording_index, c.start_ns, c.end_ns,
        greatest(
            staging.pause_limit().usual_factor * (c.end_ns - c.start_ns),
            staging.pause_limit().usual_ns
        ) AS around_ns,
        c.is_flushed AND s.recording_index IS NULL AND r.recording_index IS NULL AS is_certain
    FROM silent AS c
    LEFT JOIN snapshot AS s ON c.recording_index = s.recording_index
    LEFT JOIN regular AS r ON c.recording_index = r.recording_index AND c.start_ns = r.end_ns
),
-- Silences within packets as well, from millisecond to millisecond.
heard AS (
    SELECT r.recording_index, min(e.ts_ns) AS first_ns, max(e.ts_ns) AS last_ns
    FROM staging.event AS e
    JOIN staging.placed_source AS r ON e.trace_index = r.trace_index
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
        ON q.recording_index = s.recording_index AND q.start_ns < s.end_ns AND q.end_ns > s.start_ns
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
    JOIN packet AS p
        ON s.recording_index = p.recording_index
        AND s.start_ns >= p.previous_end_ns
        AND s.end_ns <= p.begin_ns
    GROUP BY s.recording_index, s.start_ns
    HAVING bool_and(coalesce(p.lost_packet_count > 0, false))
)
SELECT s.trace_id, s.start_ns, s.end_ns
FROM silence AS s
ANTI JOIN explained AS e ON s.recording_index = e.recording_index AND s.start_ns = e.start_ns
