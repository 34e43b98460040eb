-- description: Since when a callback instance can have been due (its release), and by when it was
--     due for certain. A message can have been due since the end of its publication, or since its
--     stamp where the two clocks cannot be compared; a request since it was sent. What a ring
--     buffer keeps was due for certain when it was published. A timer is due as derive.timer_due
--     says, after its previous call unless an events executor queued it. All times are those of the
--     executor's clock; times of other clocks are brought to it. `returned_ns`: its own thread had
--     published the message by then.
-- grain: one row per callback instance that is not nested in another
-- param: executors VARCHAR  Name of rows of executor_id, until_ns: those to look at. Callback
--     instances that began after the last of these moments are left out (where all are NULL: none)
-- param: has_calls
CREATE OR REPLACE MACRO derive.callback_release(executors, has_calls := true) AS TABLE
-- A callback may have run elsewhere before.
WITH every_run AS (
    SELECT
        run_id, callback_instance_id, callback_id, process_id, thread_id, start_ns, take_id,
        request_id, depth,
        lag(start_ns) OVER (
            PARTITION BY run_id, callback_id ORDER BY start_ns, callback_instance_id
        ) AS previous_start_ns
    FROM store.callback_instance
    -- A plain comparison DuckDB expects to leave few rows, and so compares each with all waits.
    WHERE (start_ns > (SELECT max(until_ns) FROM query_table(executors))) IS DISTINCT FROM true
),
started AS (
    SELECT
        i.run_id, x.executor_id, i.thread_id, i.callback_id, i.callback_instance_id, i.start_ns,
        i.previous_start_ns, i.take_id, i.request_id, d.due_ns, d.latest_ns,
        CASE
            WHEN c.kind = 'timer' AND (d.due_ns < i.previous_start_ns) IS NOT TRUE
                THEN i.previous_start_ns
        END AS called_ns
    FROM every_run AS i
    JOIN store.executor_thread AS x ON i.thread_id = x.thread_id
    JOIN store.callback AS c ON i.callback_id = c.callback_id
    LEFT JOIN derive.timer_due(executors) AS d ON i.callback_instance_id = d.callback_instance_id
    WHERE i.depth = 1 AND x.executor_id IN (SELECT executor_id FROM query_table(executors))
),
-- Used by messages and requests, at both ends.
clock AS MATERIALIZED (FROM derive.process_clock),
message AS (
    SELECT
        t.take_id, s.created_ns,
        CASE
            WHEN l.publication_id IS NULL AND t.source_timestamp_ns <= t.taken_ns
                THEN t.source_timestamp_ns
            WHEN derive.is_comparable(tc, bc) THEN t.taken_ns - greatest(
                derive.corrected_ns(t.taken_ns, tc) - derive.corrected_ns(b.end_ns, bc), 0
            )
        END AS origin_ns,
        CASE WHEN l.publication_id IS NULL THEN 'stamp' ELSE 'publication' END AS since,
        CASE WHEN t.method = 'ring_buffer' THEN coalesce(origin_ns, t.taken_ns) ELSE t.taken_ns END
            AS latest_ns,
        CASE WHEN b.thread_id = t.thread_id THEN t.taken_ns - d.waited_ns END AS returned_ns
    FROM store.take AS t
    JOIN clock AS tc ON t.process_id = tc.process_id
    LEFT JOIN store.subscription AS s ON t.subscription_id = s.subscription_id
    LEFT JOIN store.link_transport AS l ON t.take_id = l.take_id
    LEFT JOIN store.publication AS b ON l.publication_id = b.publication_id
    LEFT JOIN store.data_arrival AS d ON t.take_id = d.take_id
    LEFT JOIN clock AS bc ON b.process_id = bc.process_id
),
request AS (
    SELECT
        q.request_id,
        CASE WHEN derive.is_comparable(rc, sc) THEN q.taken_ns - greatest(
            derive.corrected_ns(q.taken_ns, rc) - derive.corrected_ns(q.sent_ns, sc), 0
        ) END AS origin_ns,
        q.taken_ns
    FROM store.request AS q
    LEFT JOIN store.thread AS sender ON q.sender_thread_id = sender.thread_id
    JOIN store.thread AS receiver ON q.receiver_thread_id = receiver.thread_id
    LEFT JOIN clock AS sc ON sender.process_id = sc.process_id
    JOIN clock AS rc ON receiver.process_id = rc.process_id
)
SELECT
    i.run_id, i.executor_id, i.thread_id, i.callback_id, i.callback_instance_id, i.start_ns,
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
    coalesce(m.created_ns, i.called_ns) AS subscribed_ns,
    least(i.latest_ns, q.taken_ns, m.latest_ns, i.start_ns) AS latest_ns,
    m.returned_ns
FROM started AS i
LEFT JOIN message AS m ON i.take_id = m.take_id
LEFT JOIN (FROM request WHERE has_calls) AS q ON i.request_id = q.request_id
