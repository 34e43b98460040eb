-- Reasons that `stat_orphan` gives for takes without a publication, beside what became of the
-- message's events. Compared row by row; the reasons that are right for each are in `accepted`.
WITH accepted AS (
    FROM (VALUES
        ('sent, late start', 'before_tracing'),
        -- Within a millisecond of the moment in which its process joined.
        ('sent, late start', 'publisher_gap'),
        ('sent, pause', 'publisher_gap'),
        ('sent, loss', 'publisher_gap'),
        ('sent, packets', 'publisher_gap'),
        -- Overwritten before the first snapshot.
        ('sent, packets', 'before_tracing'),
        ('sent, truncation', 'publisher_gap'),
        ('sent, truncation', 'publisher_trace_ends'),
        ('sent, stop', 'publisher_trace_ends'),
        ('sent, stop', 'publisher_gap'),
        -- The event that has the stamp is missing itself.
        ('taken, late start', 'receiver_gap'),
        ('taken, pause', 'receiver_gap'),
        ('taken, loss', 'receiver_gap'),
        ('taken, packets', 'receiver_gap'),
        ('taken, truncation', 'receiver_gap'),
        -- The message was kept for subscriptions that come late, or nothing of it is traced.
        ('kept', 'no_stamp'),
        ('no event', 'no_stamp'),
        -- A publication without a trace comes from a process that was not traced.
        ('sent, no event', 'publisher_not_traced'),
        ('sent, no event', 'publisher_without_events'),
        ('sent, no event', 'unknown')
    ) AS a(truth, reason)
),
orphan AS (
    SELECT o.take_id, o.reason, h.hostname AS host, p.pid, r.tid, t.taken_ns
    FROM analysed.store.orphan_take AS o
    JOIN analysed.store.take AS t ON o.take_id = t.take_id
    JOIN analysed.store.thread AS r ON t.thread_id = r.thread_id
    JOIN analysed.store.process AS p ON t.process_id = p.process_id
    JOIN analysed.store.host AS h ON p.host_id = h.host_id
),
matched AS (
    SELECT
        o.take_id, o.reason, any_value(m.truth) AS truth, bool_or(m.is_undecided) AS is_undecided,
        bool_or(m.is_in_hole) AS is_in_hole, bool_or(m.is_beside_hole) AS is_beside_hole,
        bool_or(m.has_absent) AS has_absent, bool_or(m.is_unnamed) AS is_unnamed,
        bool_or(m.is_torn) AS is_torn, bool_or(m.is_unseen) AS is_unseen,
        bool_or(m.is_twin) AS is_twin, bool_or(m.has_silent) AS has_silent,
        bool_or(m.is_taken_beside_hole) AS is_taken_beside_hole, bool_or(m.is_missing) AS is_missing
    FROM orphan AS o
    JOIN truth_time AS t
        ON t.kind = 'take' AND o.host = t.host AND o.pid = t.pid AND o.tid = t.tid
        AND o.taken_ns = t.ts_ns
    JOIN truth_origin AS m ON t.id = m.take_id
    GROUP BY o.take_id, o.reason
)
SELECT
    m.truth,
    m.reason,
    CASE
        WHEN m.is_missing THEN 'its link is missing'
        -- Taken from a ring buffer, with a hole in between.
        WHEN m.truth IN ('recorded', 'kept') AND m.reason = 'publisher_gap' AND m.is_in_hole
            THEN 'events are missing'
        WHEN m.is_undecided AND m.reason = 'publisher_gap' AND m.is_beside_hole
            THEN 'events are missing'
        WHEN m.is_twin
            AND m.reason IN ('ambiguous', 'clock_set', 'publisher_not_traced', 'unknown')
            THEN 'another message has its stamp'
        WHEN m.is_unseen
            AND m.reason IN ('ambiguous', 'clock_set', 'publisher_not_traced', 'unknown')
            THEN 'a stream is missing'
        WHEN m.truth = 'sent, no event' AND m.reason = 'receiver_gap' AND m.is_torn
            THEN 'events are missing'
        WHEN m.truth = 'sent, no event'
            AND m.reason IN ('before_tracing', 'publisher_gap', 'publisher_trace_ends')
            AND m.is_beside_hole
            THEN 'events are missing'
        WHEN m.truth = 'sent, no event' AND m.reason IN ('ambiguous', 'clock_set')
            THEN 'the link is not decided'
        -- Any publisher may have sent a message of a topic that is not known.
        WHEN (m.is_undecided OR m.truth = 'sent, no event') AND m.reason = 'publisher_gap'
            AND (m.is_unnamed OR m.has_silent)
            THEN 'initialisation is missing'
        WHEN m.is_undecided AND m.reason IN ('ambiguous', 'clock_set', 'unknown')
            THEN 'the link is not decided'
        -- Its handle may be another's by then, and what says so is missing.
        WHEN m.truth = 'recorded' AND m.reason = 'receiver_gap' AND m.is_unnamed
            THEN 'initialisation is missing'
        -- What has no event is not told from what lost it.
        WHEN m.truth = 'no event' AND m.reason = 'receiver_gap' AND m.is_taken_beside_hole
            THEN 'events are missing'
        -- One of them was recorded, and another one that was not may have sent it.
        WHEN m.reason = 'unknown' AND m.has_absent THEN 'several publishers'
    END AS undecided,
    count(*) AS messages,
    coalesce(bool_or(a.reason IS NOT NULL), false) AS is_right
FROM matched AS m
LEFT JOIN accepted AS a ON m.truth = a.truth AND m.reason = a.reason
GROUP BY ALL
ORDER BY ALL;
