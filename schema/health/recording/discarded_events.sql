-- title: The tracer discarded events
-- description: Events were lost because the buffers were full. What happened in those gaps is
--     missing, nothing is paired across them, and results near them are marked is_loss_affected.
--     Events of packets that were cut off are not counted here: that is damage of the trace. If
--     packets are missing as well, it is not known how many of the discarded events were in them,
--     and these are not counted either.
-- cause: The sub-buffers are too small or too few for bursts of events, or the disk is too slow to
--     empty them.
-- cure: Record with larger sub-buffers, of the size given above: msgflow record --subbuf-size SIZE,
--     ros2 trace --subbuffer-size-ust, or lttng enable-channel --userspace --subbuf-size=SIZE
--     --num-subbuf=4 CHANNEL before the events are enabled; or record fewer events (--without), or
--     write to a faster disk.
-- grain: one row per trace
-- severity: error
-- when: store.gap WHERE kind = 'loss'
WITH damaged AS (SELECT DISTINCT trace_id FROM store.finding WHERE name = 'damaged_trace'),
loss AS (
    SELECT
        g.run_id, g.trace_id,
        count(*) AS places,
        CASE WHEN count(g.event_count) > 0
            THEN least(sum(g.event_count), 9007199254740992)::BIGINT END AS events,
        max(g.event_count) AS largest,
        sum(g.end_ns - g.start_ns) AS length_ns
    FROM main.gap AS g
    LEFT JOIN damaged AS d ON g.trace_id = d.trace_id
    WHERE g.kind = 'loss' AND (g.event_count IS NOT NULL OR d.trace_id IS NULL)
    GROUP BY g.run_id, g.trace_id
),
fullest AS (
    SELECT
        trace_id,
        max(event_count) AS events,
        bool_or(discarded_event_count IS NULL) AS is_uncounted
    FROM store.packet
    GROUP BY trace_id
),
sized AS (
    SELECT
        l.*, f.is_uncounted,
        -- About 100 bytes for an event, the next power of two that holds the packet and the burst.
        -- LTTng takes no less than a page.
        CASE
            WHEN (l.largest::DOUBLE + f.events) * 100 < 4096 THEN 4
            ELSE (2 ** ceil(log2((l.largest::DOUBLE + f.events) * 100 / 1024)))::BIGINT
        END AS kibibytes
    FROM loss AS l
    JOIN fullest AS f ON l.trace_id = f.trace_id
)
SELECT
    l.run_id, l.trace_id,
    coalesce(l.events, l.places) AS count,
    printf(
        '%s%s in %s, %.3f s in all; ',
        CASE WHEN l.events IS NOT NULL AND l.is_uncounted THEN 'at least ' ELSE '' END,
        CASE WHEN l.events = 1 THEN '1 event'
            ELSE coalesce(format('{:,}', l.events), 'unknown') || ' events' END,
        derive.counted(l.places, 'place'),
        l.length_ns / 1e9
    )
    || CASE
        WHEN l.kibibytes IS NULL
            THEN 'which sub-buffers would have held the largest burst is not known'
        ELSE printf(
            '--subbuf-size=%s would have held the largest burst%s',
            CASE WHEN l.kibibytes < 1024 THEN l.kibibytes || 'K'
                ELSE l.kibibytes // 1024 || 'M' END,
            CASE WHEN l.is_uncounted THEN ' that was counted' ELSE '' END
        )
    END AS detail
FROM sized AS l
