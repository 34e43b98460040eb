-- description: Messages that threads without executor events took for callbacks, with the one
--     publication of that stamp on the same host: with its end, and when its thread published next
--     or ended a callback, since publish() had returned by then. What was published before the
--     thread ran its first callback is left out: an executor does not get that in order.
--     `is_in_order`: the thread serves what came first first, as events executors do: of two
--     messages of two subscriptions that both waited, the older one was always taken first, in both
--     orders of the subscriptions. A wait set has one order of subscriptions. Of 24 real executors
--     with a wait set, each that had ten such pairs took the younger one first in a tenth to half
--     of them. A
--     message may come later than one that was published up to a millisecond later, unless the
--     thread itself published both.
-- grain: one row per such take
-- when: staging.take_chain WHERE source_timestamp_ns IS NOT NULL AND
--     thread_id NOT IN (SELECT thread_id FROM staging.executor_first)

CREATE OR REPLACE TEMP TABLE queued AS
WITH enabled AS (
    SELECT trace_index FROM staging.declared WHERE name = 'ros2:rclcpp_executor_get_next_ready'
),
began AS (
    SELECT
        thread_id,
        min(start_ns) AS start_ns
    FROM staging.callback_run
    GROUP BY thread_id
),
taken AS (
    SELECT
        t.start_event_id, t.thread_id, t.process_id, t.taken_ns, t.source_timestamp_ns, s.take_id,
        s.subscription_id, p.host_id,
        b.start_ns AS began_ns
    FROM staging.take_chain AS t
    JOIN staging.take_subscription AS s ON t.start_event_id = s.start_event_id
    JOIN staging.process AS p ON t.process_id = p.process_id
    JOIN began AS b ON t.thread_id = b.thread_id
    SEMI JOIN enabled AS e ON t.trace_index = e.trace_index
    ANTI JOIN staging.executor_first AS x ON t.thread_id = x.thread_id
    WHERE s.callback_start_event_id IS NOT NULL AND t.source_timestamp_ns IS NOT NULL
),
sent AS (
    SELECT
        c.thread_id, c.start_ns, c.end_ns, c.source_timestamp_ns, p.host_id,
        least(
            lead(c.start_ns) OVER (PARTITION BY c.thread_id ORDER BY c.start_event_id), r.end_ns
        ) AS next_ns
    FROM staging.publication_call AS c
    JOIN staging.process AS p ON c.process_id = p.process_id
    ASOF LEFT JOIN staging.callback_run AS r
        ON c.thread_id = r.thread_id AND c.end_event_id < r.end_event_id
)
SELECT
    t.start_event_id, t.take_id, t.subscription_id, t.thread_id, t.process_id, t.taken_ns,
    any_value(s.thread_id) AS publishing_thread_id,
    any_value(s.start_ns) AS published_ns,
    any_value(s.end_ns) AS end_ns,
    any_value(s.next_ns) AS next_ns
FROM taken AS t
JOIN sent AS s ON t.host_id = s.host_id AND t.source_timestamp_ns = s.source_timestamp_ns
GROUP BY
    t.start_event_id, t.take_id, t.subscription_id, t.thread_id, t.process_id, t.taken_ns,
    t.began_ns
HAVING count(*) = 1 AND any_value(s.end_ns) < t.taken_ns AND any_value(s.start_ns) >= t.began_ns;

WITH served AS (
    SELECT
        m.thread_id, m.subscription_id, m.taken_ns, m.end_ns,
        CASE WHEN m.publishing_thread_id = m.thread_id THEN 0 ELSE 1_000_000 END AS margin_ns,
        lead(m.subscription_id) OVER on_thread AS next_subscription_id,
        lead(m.end_ns) OVER on_thread AS next_ns,
        lead(CASE WHEN m.publishing_thread_id = m.thread_id THEN 0 ELSE 1_000_000 END)
            OVER on_thread AS next_margin_ns
    FROM queued AS m
    WINDOW on_thread AS (PARTITION BY m.thread_id ORDER BY m.start_event_id)
),
pair AS (
    SELECT
        thread_id, subscription_id,
        least(subscription_id, next_subscription_id) AS first_id,
        greatest(subscription_id, next_subscription_id) AS second_id,
        end_ns <= next_ns AS is_in_order
    FROM served
    WHERE subscription_id <> next_subscription_id
        AND abs(next_ns - end_ns) >= greatest(margin_ns, next_margin_ns)
        AND end_ns + margin_ns <= taken_ns
        AND next_ns + next_margin_ns <= taken_ns
),
couple AS (
    SELECT
        thread_id,
        count(*) FILTER (WHERE is_in_order) AS in_order,
        count(*) FILTER (WHERE NOT is_in_order) AS inverted,
        count(DISTINCT subscription_id) = 2 AS is_both_ways
    FROM pair
    GROUP BY thread_id, first_id, second_id
),
in_order AS (
    SELECT thread_id
    FROM couple
    GROUP BY thread_id
    HAVING sum(in_order) >= 10 AND sum(inverted) = 0 AND bool_or(is_both_ways)
)
SELECT
    *,
    thread_id IN (FROM in_order) AS is_in_order
FROM queued
