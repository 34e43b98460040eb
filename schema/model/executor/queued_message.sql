-- description: Messages that threads without executor events took for callbacks, with the one
--     publication of that stamp on the same host: with its end, and when its thread published next
--     or ended a callback, since publish() had returned by then. What was published before the
--     thread ran its first callback is left out: an executor does not get that in order.
-- grain: one row per such take
-- when: staging.take_chain WHERE source_timestamp_ns IS NOT NULL AND
--     thread_id NOT IN (SELECT thread_id FROM staging.executor_first)
WITH enabled AS (
    SELECT trace_index FROM staging.declared WHERE name = 'ros2:rclcpp_executor_get_next_ready'
),
began AS (
    SELECT thread_id, min(start_ns) AS start_ns FROM staging.callback_run GROUP BY thread_id
),
taken AS (
    SELECT
        t.start_event_id, t.thread_id, t.process_id, t.taken_ns, t.source_timestamp_ns,
        s.take_id, s.subscription_id, p.host_id, b.start_ns AS began_ns
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
    any_value(s.thread_id) AS publishing_thread_id, any_value(s.start_ns) AS published_ns,
    any_value(s.end_ns) AS end_ns, any_value(s.next_ns) AS next_ns
FROM taken AS t
JOIN sent AS s ON t.host_id = s.host_id AND t.source_timestamp_ns = s.source_timestamp_ns
GROUP BY
    t.start_event_id, t.take_id, t.subscription_id, t.thread_id, t.process_id, t.taken_ns,
    t.began_ns
HAVING count(*) = 1 AND any_value(s.end_ns) < t.taken_ns AND any_value(s.start_ns) >= t.began_ns
