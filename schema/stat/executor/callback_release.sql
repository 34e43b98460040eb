-- name: derive.callback_release
-- kind: macro
-- description: Since when a callback instance can have been due (its release), and by when it was
--     due for certain. A message can have been due since the end of its publication, or since its
--     stamp where the two clocks cannot be compared; a request since it was sent. A timer is due
--     since the first instant after its previous call that is a whole number of periods after its
--     creation; if it ran before that instant, it was reset. All times are those of the
--     executor's clock; times of other clocks are brought to it.
-- grain: one row per callback instance that is not nested in another
-- param: executors VARCHAR  Name of rows of executor_id, until_ns: those to look at. Callback
--     instances that began after the last of these moments are left out (where all are NULL: none)
CREATE OR REPLACE MACRO derive.callback_release(executors) AS TABLE
-- A callback may have run elsewhere before.
WITH every_run AS (
    SELECT
        run_id, callback_instance_id, callback_id, process_id, thread_id, start_ns, take_id,
        request_id, depth,
        lag(start_ns) OVER in_time AS previous_start_ns,
        -- Of lag with an offset, older versions of DuckDB cannot read the definition.
        any_value(start_ns) OVER (in_time ROWS BETWEEN 2 PRECEDING AND 2 PRECEDING)
            AS earlier_start_ns
    FROM store.callback_instance
    -- A plain comparison DuckDB expects to leave few rows, and so compares each with all waits.
    WHERE (start_ns > (SELECT max(until_ns) FROM query_table(executors))) IS DISTINCT FROM true
    WINDOW in_time AS (
        PARTITION BY run_id, callback_id ORDER BY start_ns, callback_instance_id
    )
),
-- A timer is due at creation + k periods. Its creation is recorded a little later than the instant
-- from which the periods count: a hundredth of the period is allowed for that.
slotted AS (
    SELECT
        i.run_id, x.executor_id, i.thread_id, i.callback_id, i.callback_instance_id, i.start_ns,
        i.previous_start_ns, i.take_id, i.request_id, t.period_ns, t.created_ns,
        (i.previous_start_ns + t.period_ns // 100 - t.created_ns) // t.period_ns AS slot,
        (i.earlier_start_ns + t.period_ns // 100 - t.created_ns) // t.period_ns AS earlier_slot
    FROM every_run AS i
    JOIN store.executor_thread AS x ON i.thread_id = x.thread_id
    JOIN store.callback AS c ON i.callback_id = c.callback_id
    LEFT JOIN store.timer AS t ON c.timer_id = t.timer_id AND t.period_ns > 0
    WHERE i.depth = 1
        AND x.executor_id IN (SELECT executor_id FROM query_table(executors))
),
-- A call shortly before such an instant was for that instant, or for the one before it, almost a
-- period late. In the second case the instant is still to come.
timed AS (
    SELECT
        run_id, executor_id, thread_id, callback_id, callback_instance_id, start_ns,
        previous_start_ns, take_id, request_id, period_ns,
        created_ns + period_ns * CASE
            WHEN previous_start_ns < created_ns + period_ns * slot
                AND coalesce(earlier_slot, 0) + 1 < slot
                THEN slot
            ELSE slot + 1
        END AS next_ns
    FROM slotted
),
started AS (
    SELECT
        run_id, executor_id, thread_id, callback_id, callback_instance_id, start_ns,
        previous_start_ns, take_id, request_id,
        previous_start_ns + period_ns AS latest_ns,
        CASE
            WHEN next_ns <= start_ns THEN next_ns
            WHEN next_ns - period_ns > previous_start_ns THEN next_ns - period_ns
            WHEN next_ns - start_ns <= period_ns // 100 THEN start_ns
        END AS due_ns
    FROM timed
),
message AS (
    SELECT
        t.take_id,
        t.taken_ns,
        s.created_ns,
        CASE
            WHEN l.publication_id IS NULL AND t.source_timestamp_ns <= t.taken_ns
                THEN t.source_timestamp_ns
            WHEN p.is_comparable THEN t.taken_ns - greatest(
                derive.corrected_ns(t.taken_ns, tc.offset_ns, tc.drift_ppb, tc.reference_ns)
                - derive.corrected_ns(b.end_ns, bc.offset_ns, bc.drift_ppb, bc.reference_ns),
                0
            )
        END AS origin_ns,
        CASE WHEN l.publication_id IS NULL THEN 'stamp' ELSE 'publication' END AS since
    FROM store.take AS t
    JOIN derive.process_clock AS tc ON t.process_id = tc.process_id
    LEFT JOIN store.subscription AS s ON t.subscription_id = s.subscription_id
    LEFT JOIN store.link_transport AS l ON t.take_id = l.take_id
    LEFT JOIN store.publication AS b ON l.publication_id = b.publication_id
    LEFT JOIN derive.process_clock AS bc ON b.process_id = bc.process_id
    LEFT JOIN derive.clock_comparable AS p
        ON b.process_id = p.process_id AND t.process_id = p.other_process_id
),
request AS (
    SELECT
        q.request_id,
        CASE WHEN p.is_comparable THEN q.taken_ns - greatest(
            derive.corrected_ns(q.taken_ns, rc.offset_ns, rc.drift_ppb, rc.reference_ns)
            - derive.corrected_ns(q.sent_ns, sc.offset_ns, sc.drift_ppb, sc.reference_ns),
            0
        ) END AS origin_ns,
        q.taken_ns
    FROM store.request AS q
    LEFT JOIN store.thread AS sender ON q.sender_thread_id = sender.thread_id
    JOIN store.thread AS receiver ON q.receiver_thread_id = receiver.thread_id
    LEFT JOIN derive.clock_comparable AS p
        ON sender.process_id = p.process_id AND receiver.process_id = p.other_process_id
    LEFT JOIN derive.process_clock AS sc ON sender.process_id = sc.process_id
    JOIN derive.process_clock AS rc ON receiver.process_id = rc.process_id
)
SELECT
    i.run_id,
    i.executor_id,
    i.thread_id,
    i.callback_id,
    i.callback_instance_id,
    i.start_ns,
    i.previous_start_ns,
    CASE
        WHEN i.due_ns IS NOT NULL THEN 'timer'
        WHEN q.origin_ns IS NOT NULL THEN 'request'
        WHEN m.origin_ns IS NOT NULL THEN m.since
    END AS since,
    CASE
        WHEN i.due_ns IS NOT NULL THEN i.due_ns
        WHEN q.origin_ns IS NOT NULL THEN least(q.origin_ns, i.start_ns)
        ELSE m.origin_ns
    END AS origin_ns,
    m.created_ns AS subscribed_ns,
    least(i.latest_ns, q.taken_ns, m.taken_ns, i.start_ns) AS latest_ns
FROM started AS i
LEFT JOIN message AS m ON i.take_id = m.take_id
LEFT JOIN request AS q ON i.request_id = q.request_id
