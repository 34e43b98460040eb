-- name: staging.queued_message
-- description: Messages that threads without executor events took for callbacks, with the one
--     publication of that stamp on the same host: until when it lasted, and when its thread
--     published next.
-- grain: one row per such take
-- when: staging.take_chain WHERE source_timestamp_ns IS NOT NULL AND
--     thread_id NOT IN (SELECT thread_id FROM staging.executor_first)
WITH enabled AS (
    SELECT trace_index
    FROM staging.declared
    WHERE name = 'ros2:rclcpp_executor_get_next_ready'
),
taken AS (
    SELECT
        t.start_event_id, t.thread_id, t.process_id, t.taken_ns, t.source_timestamp_ns,
        s.take_id, s.subscription_id, p.host_id
    FROM staging.take_chain AS t
    JOIN staging.take_subscription AS s ON t.start_event_id = s.start_event_id
    JOIN staging.process AS p ON t.process_id = p.process_id
    SEMI JOIN enabled AS e ON t.trace_index = e.trace_index
    ANTI JOIN staging.executor_first AS x ON t.thread_id = x.thread_id
    WHERE s.callback_start_event_id IS NOT NULL AND t.source_timestamp_ns IS NOT NULL
),
sent AS (
    SELECT
        c.thread_id, c.start_ns, c.end_ns, c.source_timestamp_ns, p.host_id,
        lead(c.start_ns) OVER (PARTITION BY c.thread_id ORDER BY c.start_event_id) AS next_ns
    FROM staging.publication_call AS c
    JOIN staging.process AS p ON c.process_id = p.process_id
)
SELECT
    t.start_event_id, t.take_id, t.subscription_id, t.thread_id, t.process_id, t.taken_ns,
    any_value(s.thread_id) AS publishing_thread_id, any_value(s.start_ns) AS published_ns,
    any_value(s.end_ns) AS end_ns, any_value(s.next_ns) AS next_ns
FROM taken AS t
JOIN sent AS s ON t.host_id = s.host_id AND t.source_timestamp_ns = s.source_timestamp_ns
GROUP BY ALL
HAVING count(*) = 1 AND any_value(s.end_ns) < t.taken_ns
