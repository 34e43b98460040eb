-- description: Publications that a thread makes after it took a message by hand (rclpy, rclc, wait
--     sets), until its next take. A take of a request or a response counts, too. The link ends at
--     the begin or end of a callback, at the next event of an executor, and at a gap. What is
--     published inside a callback instance is caused by that instance instead. Where callbacks of
--     Python are traced, no message causes anything else. What the middleware publishes by itself
--     (it has no publisher, though nothing was lost) has no cause. Timers of rclpy do not show:
--     what they publish is among the rows, and derive.answer_doubtful tells it apart.
-- grain: one row per publication made after a take without a callback
CREATE OR REPLACE MACRO derive.link_causal_take_adjacent(only_run) AS TABLE
WITH by_hand AS (
    SELECT
        run_id, thread_id,
        start_event_id AS event_id,
        take_id, subscription_id, taken_ns
    FROM derive.take_by_hand(only_run) AS t
    -- Processes whose Python is traced: only that tracer records executors of rclpy.
    ANTI JOIN (
        SELECT p.process_id
        FROM store.process AS p
        JOIN store.executor AS x ON p.process_id = x.process_id
        WHERE p.run_id = only_run AND p.python_version IS NOT NULL
    ) AS p ON t.process_id = p.process_id
),
busy AS (SELECT DISTINCT run_id, thread_id FROM by_hand),
-- What a thread turned to: a message that it took by hand, or something else.
turn AS (
    SELECT run_id, thread_id, event_id, take_id, subscription_id, taken_ns FROM by_hand
    UNION ALL
    SELECT
        i.run_id, i.thread_id,
        unnest([i.start_event_id, i.effective_end_event_id]),
        NULL, NULL, NULL
    FROM store.callback_instance AS i
    SEMI JOIN busy AS w ON i.run_id = w.run_id AND i.thread_id = w.thread_id
    WHERE i.run_id = only_run
    UNION ALL
    SELECT e.run_id, e.thread_id, e.start_event_id, NULL, NULL, NULL
    FROM store.executor_state AS e
    SEMI JOIN busy AS w ON e.run_id = w.run_id AND e.thread_id = w.thread_id
    WHERE e.run_id = only_run
),
alone AS (
    SELECT
        b.run_id, b.thread_id, b.trace_id, b.publication_id, b.publisher_id, b.start_event_id,
        b.start_ns
    FROM store.publication AS b
    SEMI JOIN busy AS w ON b.run_id = w.run_id AND b.thread_id = w.thread_id
    ANTI JOIN derive.link_causal_direct(only_run) AS d ON b.publication_id = d.publication_id
    WHERE b.run_id = only_run AND (b.publisher_id IS NOT NULL OR b.is_loss_affected)
),
adjacent AS MATERIALIZED (
    SELECT
        a.run_id, a.thread_id, t.take_id, t.subscription_id, t.taken_ns, a.publication_id,
        a.publisher_id, a.trace_id, a.start_event_id, a.start_ns
    FROM alone AS a
    ASOF JOIN turn AS t
        ON a.run_id = t.run_id AND a.thread_id = t.thread_id AND a.start_event_id > t.event_id
    WHERE t.take_id IS NOT NULL
),
-- Requests and responses that the thread took. Only their times are stored, not their events.
called AS (
    SELECT
        q.run_id,
        q.receiver_thread_id AS thread_id,
        q.taken_ns
    FROM store.request AS q
    SEMI JOIN busy AS w ON q.run_id = w.run_id AND q.receiver_thread_id = w.thread_id
    WHERE q.run_id = only_run
    UNION ALL
    SELECT r.run_id, r.receiver_thread_id, r.taken_ns
    FROM store.response AS r
    SEMI JOIN busy AS w ON r.run_id = w.run_id AND r.receiver_thread_id = w.thread_id
    WHERE r.run_id = only_run
),
behind_call AS (
    SELECT a.publication_id
    FROM adjacent AS a
    ASOF JOIN called AS c
        ON a.run_id = c.run_id AND a.thread_id = c.thread_id AND a.start_ns >= c.taken_ns
    WHERE c.taken_ns >= a.taken_ns
)
SELECT
    a.run_id, a.thread_id, a.take_id, a.subscription_id, a.taken_ns, a.publication_id,
    a.publisher_id, a.start_event_id, a.start_ns
FROM adjacent AS a
ANTI JOIN derive.take_behind_gap('adjacent') AS g ON a.publication_id = g.publication_id
ANTI JOIN behind_call AS c ON a.publication_id = c.publication_id
