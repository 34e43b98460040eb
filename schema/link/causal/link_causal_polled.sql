-- description: Messages that a callback instance takes by itself (polling subscriptions), and what
--     it publishes afterwards. Of each subscription the last message that it took before counts.
--     An executor that spins inside of a callback takes messages there, too: each has a callback
--     of its own, but for the copies of messages that come through intra-process buffers, and in
--     Python for feedback that a client of an action drops. A coroutine is one call, but
--     takes only while one of its steps runs.
-- grain: one row per publication inside a callback instance, and subscription it took from before
CREATE OR REPLACE MACRO derive.link_causal_polled(only_run) AS TABLE
WITH RECURSIVE buffered AS (
    SELECT DISTINCT c.subscription_id
    FROM store.callback_instance AS i
    JOIN store.callback AS c ON i.callback_id = c.callback_id
    WHERE i.run_id = only_run AND i.is_intra_process
),
by_hand AS MATERIALIZED (
    FROM derive.take_by_hand(only_run) AS t
    ANTI JOIN buffered AS b ON t.subscription_id = b.subscription_id
    ANTI JOIN (
        SELECT a.feedback_object_id AS subscription_id
        FROM derive.action_object('client', 'subscription') AS a
        JOIN store.process AS p ON a.process_id = p.process_id
        WHERE p.python_version IS NOT NULL
    ) AS f ON t.subscription_id = f.subscription_id
),
run AS MATERIALIZED (
    SELECT
        i.callback_instance_id, i.continues_id, i.parent_id, i.thread_id, i.start_event_id,
        i.effective_end_event_id
    FROM store.callback_instance AS i
    SEMI JOIN by_hand AS t ON i.thread_id = t.thread_id
    WHERE i.run_id = only_run
),
-- The instance that began last, and those around it, each if the one inside was over by then.
around (take_id, event_id, call_id, parent_id, effective_end_event_id) AS (
    SELECT
        t.take_id, t.start_event_id,
        coalesce(i.continues_id, i.callback_instance_id),
        i.parent_id, i.effective_end_event_id
    FROM by_hand AS t
    ASOF JOIN run AS i ON t.thread_id = i.thread_id AND t.start_event_id > i.start_event_id
    UNION ALL
    SELECT
        a.take_id, a.event_id,
        coalesce(i.continues_id, i.callback_instance_id),
        i.parent_id, i.effective_end_event_id
    FROM around AS a
    JOIN run AS i ON a.parent_id = i.callback_instance_id
    WHERE a.event_id >= a.effective_end_event_id
),
polled AS MATERIALIZED (
    SELECT
        a.call_id, t.take_id, t.subscription_id, t.process_id, t.taken_ns, t.start_event_id,
        t.is_loss_affected
    FROM around AS a
    JOIN by_hand AS t ON a.take_id = t.take_id
    WHERE a.event_id < a.effective_end_event_id
),
-- Most processes poll nothing: what they publish is not looked at.
published AS (
    SELECT
        b.publication_id, b.publisher_id, b.trace_id, b.start_ns, b.start_event_id,
        d.is_loss_affected, p.call_id, p.subscription_id
    FROM (
        FROM store.publication
        WHERE run_id = only_run AND process_id IN (SELECT process_id FROM polled)
    ) AS b
    JOIN derive.link_causal_direct(only_run) AS d ON b.publication_id = d.publication_id
    JOIN (SELECT DISTINCT call_id, subscription_id FROM polled) AS p
        ON d.callback_instance_id = p.call_id
),
linked AS MATERIALIZED (
    SELECT
        p.publication_id, p.publisher_id, p.trace_id, p.start_ns, t.take_id, t.taken_ns,
        p.is_loss_affected OR t.is_loss_affected AS is_loss_affected
    FROM published AS p
    ASOF JOIN polled AS t
        ON p.call_id = t.call_id
        AND p.subscription_id = t.subscription_id
        AND p.start_event_id > t.start_event_id
)
SELECT
    only_run AS run_id,
    l.take_id, l.publication_id, l.publisher_id, l.is_loss_affected
FROM linked AS l
ANTI JOIN derive.take_behind_gap('linked') AS g
    ON l.publication_id = g.publication_id AND l.take_id = g.take_id
